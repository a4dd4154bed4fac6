#pragma once
#include <memory>
#include <vector>

#include "repose/discrete/objective.h"
#include "repose/model/instruments.h"
#include "repose/solve/repose.h"

namespace repose::solve {

/// Measures how deep points are inside rigid bodies, against the bodies' triangles. The search uses
/// distances that are smoothed on a grid; here they only select the points that are measured.
class ExactPenetration {
 public:
  explicit ExactPenetration(const discrete::Part& part);

  /// [bodies] over the points of all ranks at the objective's last update, at its load; empty
  /// without rigid bodies. Collective.
  std::vector<PenetrationDepth> measure(discrete::Objective& objective);

 private:
  double depth(size_t body, const mechanics::RigidBody& shape, const Vec3& beside);
  void measure_own(discrete::Objective& objective, std::vector<PenetrationDepth>& depths);

  const discrete::Part& part_;
  std::vector<std::unique_ptr<model::MeshDepth>> meshes_;  // [bodies] built when first needed
};

}  // namespace repose::solve
