#pragma once
#include <mpi.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "repose/discrete/part.h"
#include "repose/model/build.h"
#include "repose/solve/prestress.h"

namespace repose::app {

/// A scene or a model, read and built: what is to be solved.
struct Job {
  discrete::LocalModel local_model;  ///< on all ranks
  scene::Solve requested;            ///< the scene's, of springs with a bulk modulus; on all ranks
  std::optional<model::Anatomy> anatomy;  ///< of a scene, on rank 0
  std::optional<solve::ReferenceState>
      reference_state;                      ///< of an initial equilibrium, on all ranks
  bool initial_equilibrium = false;         ///< before the bones move, on all ranks
  bool remeshed = false;                    ///< the skin is not the given one, on all ranks
  std::string building;                     ///< what the builder has to say, on rank 0
  std::vector<std::string> warnings;        ///< about implausible input, on rank 0
  std::vector<std::vector<int64_t>> held;   ///< points of each instrument, on rank 0
  std::vector<std::string> bodies;          ///< that the tissue may touch, on rank 0
  std::vector<model::Cut> cuts;             ///< on rank 0
  std::optional<double> tearing;            ///< N, on rank 0
  std::optional<scene::Material> material;  ///< of a scene, on all ranks
};

/// Reads a scene (.yaml) with changes or a model (.h5), builds the scene's model with its initial
/// equilibrium and makes its incisions. Each rank makes its part of a scene's model. Where no
/// tissue fits, these places of the skin are written to NAME_refused.ply. Throws
/// InputError. `watch` is told the share that is done, on rank 0. Collective.
Job read_job(MPI_Comm comm, const std::filesystem::path& input,
             const std::function<void(double)>& watch = {},
             const scene::SceneChanges& changes = {});

}  // namespace repose::app
