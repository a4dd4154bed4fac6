#pragma once
#include <functional>
#include <string>
#include <vector>

#include "job.h"
#include "repose/solve/sensitivity.h"

/// Sensitivity of a face to the least known properties of a scene.
namespace repose::app {

/// The scene with one of its assumptions replaced by another that is as likely.
struct Variation {
  std::string name;  ///< a phrase, for the report
  scene::Scene scene;
};

/// Border held or free, a lower Poisson's ratio, a stiffer skin, more tissue released from bone:
/// those that apply to a scene.
std::vector<Variation> variations(const scene::Scene& scene);

/// Displacement of the skin under a variation, over the skin that moves by more than 0.5 mm.
struct Sensitivity {
  std::string name;
  bool known = false;                                 ///< the linear system was solved
  bool counted = false;                               ///< some skin moves that far
  double median = 0, percentile_95 = 0, largest = 0;  ///< mm
  Vec3 where = Vec3::Zero();                          ///< mm, the initial place of the largest
};

/// One for each variation of a job that came to rest at `rest`, the largest first, by one linear
/// solve each or, with contact, a few; on rank 0. `watch` is told the share that is done.
/// Collective.
std::vector<Sensitivity> sensitivities(MPI_Comm comm, const Job& job,
                                       const mechanics::Weights& weights,
                                       const solve::RestState& rest,
                                       const std::function<void(double)>& watch);

/// Rows for a person.
std::string describe_sensitivities(const std::vector<Sensitivity>& found);

}  // namespace repose::app
