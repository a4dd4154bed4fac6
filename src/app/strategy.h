#pragma once
#include <string>
#include <vector>

#include "job.h"
#include "repose/adapt/grid_sequence.h"
#include "repose/base/options.h"

namespace repose::app {

/// Method by which a job is solved. Only make_strategy decides which parts go together.
struct Strategy {
  /// Purpose of coarser models of the scene.
  enum class Coarse {
    none,
    instead,  ///< the coarsest that is near enough takes the place of the scene's own
    compare   ///< with the scene's own model, to tell how far that is from the continuum
  };
  solve::Settings settings;                    ///< of the scene's own model
  Coarse coarse = Coarse::none;                ///< on all ranks
  std::vector<adapt::Resolution> resolutions;  ///< coarsest first, their number on all ranks
  std::string limit;                           ///< why a solid's go no finer, on rank 0
  bool preview = false;                        ///< the last of them is taken in any case
  bool verifies_path = false;                  ///< solved again in twice the load steps
  bool sensitivity = false;                    ///< requested, of a rest position at load 1
  solve::Derivatives tangents;                 ///< requested ones, on all ranks
  bool tears = false;                          ///< in rounds of searches, on all ranks
  std::string explanation;                     ///< what is done and why, a row each; on rank 0
};

/// Chooses by the job and the options of solve_options(). Throws InputError, one line, where an
/// option is incompatible with the others. Collective.
Strategy make_strategy(MPI_Comm comm, const base::Options& options, const Job& job);

}  // namespace repose::app
