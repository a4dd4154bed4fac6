#pragma once
#include <vector>

#include "repose/model/instruments.h"
#include "repose/solve/repose.h"

namespace repose::solve {

/// How the search for the places of sliding points ended.
struct Sliding {
  int rounds = 0;
  double to_go = 0;            ///< mm, the largest step of a point that was still due
  bool settled = true;         ///< below the accuracy asked for
  bool stopped = false;        ///< a search was asked to end early, …
  double load = 0;             ///< … at this load
  std::vector<Vec3> position;  ///< [this rank's slab] mm, where the last search ended
};

/// Moves the targets of points that slide on instruments until the tissue no longer pulls them
/// along the surface: the model comes to rest with the points held, each goes by the force on it
/// along the surface times a step length of Barzilai and Borwein (1988) and back onto the surface,
/// and so on until no step is longer than half the accuracy, or the settings' interrupt is wanted.
/// `model` and `sliders` are looked at, and the model's targets changed, on rank 0; `start` is the
/// state at the settings' start_load. Collective.
Sliding slide(MPI_Comm comm, model::Model& model, const std::vector<model::Slider>& sliders,
              const Settings& settings, const std::vector<Vec3>& start);

}  // namespace repose::solve
