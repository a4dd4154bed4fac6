#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "repose/base/interrupt.h"
#include "repose/base/program.h"
#include "repose/discrete/part.h"
#include "repose/model/motion.h"
#include "repose/model/step.h"
#include "repose/solve/load_path.h"
#include "repose/solve/stability.h"

namespace repose::linear {
struct KeptPreconditioner;
}

namespace repose::solve {

/// Receives each step: its numbers and this rank's rows of its arrays. Called on all ranks.
using Receiver = std::function<void(const model::StepNumbers&, const model::StepRows&)>;

/// Hands the state that a search is at to a receiver, as a step that has not converged. Collective.
using StateSnapshot = std::function<void(const Receiver&)>;

/// A piece of bone whose motion is a parameter of the rest position.
struct PlanPiece {
  int32_t bone = -1;             ///< row of Model::bones
  Vec3 centroid = Vec3::Zero();  ///< mm, at load 0
  scene::Placement placement;    ///< at load 1
};

/// A layer of the tissue of one material, from the skin down.
struct Stratum {
  double thickness = 0;        ///< mm; of the last, below all others, without meaning
  double shear = 0, bulk = 0;  ///< N/mm², model::Moduli
};

/// Derivatives of the rest position at load 1.
struct Derivatives {
  std::vector<PlanPiece> pieces = {};  ///< by their motions
  std::vector<Stratum> strata = {};    ///< by the logarithms of their Young's moduli
  bool fields = true;                  ///< point fields `tangent_…` of the last step
  /// [points] w, this rank's slab: Summary::gradient is that of Σ w · x; empty: none.
  std::vector<Vec3> functional = {};
  /// [prisms of this rank's part] 1 where a region's material, not that of the strata, is; empty:
  /// nowhere.
  std::vector<char> in_region = {};
  /// [elastic supports of this rank's part][strata] ∂ ln k/∂ ln E (model::support_shares).
  std::vector<std::vector<double>> support_shares = {};

  bool requested() const {
    return (fields || !functional.empty()) && !(pieces.empty() && strata.empty());
  }
};

/// Derivatives of a scalar of the rest position.
struct Gradient {
  std::vector<double> by_pieces;  ///< [6 pieces] per mm and per degree
  std::vector<double> by_strata;  ///< [strata] by ln of Young's modulus
  bool finished = false;          ///< the linear solve reached the tolerance, …
  bool convex = false;            ///< … and met no negative curvature; else all are 0
};

/// Settings of a solve.
struct Settings {
  mechanics::Weights weights;                                ///< the objective
  model::Functional functional = model::Functional::energy;  ///< what is minimized
  base::Stages* stages = nullptr;        ///< whose stages "distribute" and "solve" are ended
  base::Interrupt* interrupt = nullptr;  ///< ends the search, and all others that share it
  bool monitor = false;                  ///< print a line for every iteration
  std::string activity = {};             ///< begins the line that a terminal shows
  bool finds_other_rest = true;          ///< contact searches for another rest position at load 1
  bool stability = false;                ///< the smallest eigenvalue where the run ends, …
  bool initial_equilibrium = false;      ///< … and at its start, because the scene requests one
  Derivatives derivatives = {};          ///< of a rest position at load 1
  /// Returns whether to end the search as if interrupted; called at each iteration and before each
  /// derivative, collective.
  std::function<bool()> abandoned = {};
  /// Called at each iteration, on all ranks.
  std::function<void(double load, const StateSnapshot&)> on_iterate;
  PathSettings path;
};

/// Depth of free points inside a rigid body, beyond their initial depth.
struct PenetrationDepth {
  static constexpr double reported = 0.1;  ///< mm, depth from which points are counted
  int64_t points = 0;                      ///< deeper than that
  double deepest = 0;                      ///< mm
  Vec3 where = Vec3::Zero();               ///< mm, current place of the deepest point
};

/// Points of the skin that press on a bone, as lips between teeth do.
struct SkinOnBone {
  int64_t points = 0;
  double pressure = 0;        ///< N/mm², the largest
  Vec3 where = Vec3::Zero();  ///< mm, its place where the run ended
};

/// Contact of the tissue with one body.
struct ContactSummary {
  int64_t points = 0;         ///< that press
  Vec3 force = Vec3::Zero();  ///< N, of the tissue on the body; of cuts' sides, of one on the other
  int64_t inside = 0;         ///< points that were inside the body at the start, and stay so
  double deepest = 0;         ///< mm, of these
  Vec3 where = Vec3::Zero();  ///< mm, the deepest one at the start
  SkinOnBone skin;            ///< nothing where the body is no bone
  PenetrationDepth exact;     ///< into a rigid body's own triangles, at the last step
};

/// Columns of tissue that a body has entered since the start.
struct PiercedColumns {
  int64_t columns = 0;
  int64_t prisms = 0;         ///< that something small has entered between their columns
  int32_t body = -1;          ///< of the model's contact: that at the deepest place
  double depth = 0;           ///< mm, there
  Vec3 where = Vec3::Zero();  ///< mm, there, where the run ended
  int64_t count() const { return columns + prisms; }
};

/// Outcome of a solve, for the end-of-run summary.
struct Summary {
  PathOutcome path;
  model::StepNumbers last;
  int64_t unknowns = 0;                      ///< scalar
  int64_t evaluations = 0;                   ///< of objective and gradient
  int64_t evaluations_for_other = 0;         ///< of these, in search of another rest position
  int64_t assemblies = 0;                    ///< of the Hessian
  std::optional<Spectrum> initial_spectrum;  ///< at the start, where requested
  std::optional<Gradient> gradient;          ///< where requested, of a rest position at load 1
  bool abandoned = false;                    ///< before all derivatives were found
  std::optional<Spectrum> final_spectrum;    ///< where the run ended, where requested
  std::vector<ContactSummary>
      contacts;            ///< a row a body of the model's contact, then the sides of cuts
  PiercedColumns pierced;  ///< by bones, between their two deepest points
  PiercedColumns pierced_by_instrument;  ///< anywhere; with such columns it is not a rest position
};

/// Where a search begins.
struct Start {
  std::vector<Vec3> position =
      {};  ///< this rank's slab, natural order, mm; empty: the initial state
  /// `position` is a guess of the rest position at load 1, tried before the path is followed;
  /// otherwise the state at the settings' start_load.
  bool guess = false;
  bool near = false;  ///< the guess is near to rest: it is tried before anything else
  /// N/mm², [points] this rank's slab: of contact at a near guess or at the start_load; empty:
  /// none.
  std::vector<double> pressure = {};
  /// From RestSolver::make_preconditioner, for a guess that is near rest; or null.
  std::shared_ptr<const linear::KeptPreconditioner> preconditioner = {};
};

/// Finds rest positions of one distributed model for any number of motions of its bones; what these
/// do not change is made once. A search depends on its arguments and the motions alone, not on the
/// searches before. All members are collective.
class RestSolver {
 public:
  /// `part` outlives it; of the settings, weights and functional are those of all searches. Throws
  /// InputError where nothing is free to move.
  RestSolver(MPI_Comm comm, const discrete::Part& part, const Settings& settings);
  ~RestSolver();
  RestSolver(RestSolver&&) = delete;

  /// Gives a bone another whole motion.
  void set_motion(int32_t bone, const scene::RigidMotion& motion);
  /// Follows the rest position along the load path, hands every step to `receive`.
  Summary find(const Settings& settings, const Start& start, const Receiver& receive);
  /// Makes the preconditioner at a rest position of load 1 and of the present motions, for searches
  /// near it; null where it is not multigrid.
  std::shared_ptr<const linear::KeptPreconditioner> make_preconditioner(const Start& rest);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The whole main job on a model (read on rank 0 only): distributes it, follows the rest
/// position along the load path, hands every step to `receive`. Throws InputError where nothing is
/// free to move. Collective.
Summary find_repose(MPI_Comm comm, const model::Model& model, const Settings& settings,
                    const Start& start, const Receiver& receive);

}  // namespace repose::solve
