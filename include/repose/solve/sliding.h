#pragma once
#include <vector>

#include "repose/model/instruments.h"
#include "repose/solve/repose.h"

namespace repose::solve {

/// How the search for the places of sliding points ended.
struct Sliding {
  int rounds = 0;
  double to_go = 0;     ///< mm, the largest step of a point that was still due
  bool settled = true;  ///< below the accuracy asked for
};

/// Moves the targets of points that slide on instruments until the tissue no longer pulls them
/// along the surface: the model comes to rest with the points held, each goes by the force on it
/// along the surface times a step length of Barzilai and Borwein (1988) and back onto the surface,
/// and so on until no step is longer than half the accuracy. `model` and `sliders` are looked at,
/// and the model's targets changed, on rank 0. Collective.
Sliding slide(MPI_Comm comm, model::Model& model, const std::vector<model::Slider>& sliders,
              const Settings& settings);

}  // namespace repose::solve
