#pragma once
#include <mpi.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "repose/model/build.h"
#include "repose/solve/repose.h"

namespace repose::app {

/// A scene that is built once and solved for many plans. Each solve begins at a defined state: the
/// initial one or, with its tangents, the rest position of a base plan, which is itself solved from
/// the initial one. So an answer depends on its plan and base alone, not on the solves before it.
/// All members are collective; what they return is on rank 0 unless said otherwise.
class PlanSession {
 public:
  /// A piece of the plan; on all ranks.
  struct Piece {
    std::string name;
    int32_t bone;
    Vec3 centroid;            ///< mm, at load 0
    scene::Placement scenes;  ///< by the scene's moves
  };
  /// [pieces] The motion of each.
  using Placements = std::vector<scene::Placement>;
  struct Request {
    Placements plan;
    double accuracy = 0;    ///< mm
    bool tangents = false;  ///< derivatives by the motions of pieces and stiffnesses of strata
    /// Weights w by row of the point, on rank 0: the gradient of Σ w · x by the same; empty: none.
    std::vector<std::pair<int64_t, Vec3>> functional = {};
    const Placements* base = nullptr;  ///< where it begins; null: the initial state
    bool other_rest = false;           ///< from the initial state, search for another rest position
    bool described = false;            ///< the answer has a description
    std::function<bool()> abandoned = {};  ///< as solve::Settings
  };
  struct Answer {
    solve::Summary summary;                ///< on all ranks
    std::vector<Vec3> position;            ///< [N] mm
    std::vector<model::PointField> field;  ///< [N] contact and tangents
    bool abandoned = false;                ///< there is nothing else then
    bool from_base = false;                ///< the search began at the base and ended there
    std::string description;               ///< of the face and what it touches, as of write()
  };

  /// Reads and builds a scene with changes. Throws InputError where it has no plan, or what a
  /// session does not solve: tearing, the functional force.
  PlanSession(MPI_Comm comm, const std::filesystem::path& input,
              const scene::SceneChanges& changes = {});
  ~PlanSession();
  PlanSession(PlanSession&&) = delete;

  const std::vector<Piece>& pieces() const;
  const scene::Plan& box() const;
  double accuracy() const;                     ///< mm, the scene's
  const model::Model& model() const;           ///< its skin, its bones and names, on rank 0
  const surface::Surface* given_skin() const;  ///< in whose place another is solved, or null
  bool has_cuts() const;                       ///< incisions or parted lips
  Mat3 axes() const;                           ///< rows: left, back and up of the head in the scan
  const surface::Surface& skin() const;        ///< that is solved, before anything moves
  /// Rows of the skin's points in the model, ascending, on all ranks.
  const std::vector<int64_t>& skin_rows() const;
  int64_t points() const;  ///< N, on all ranks

  /// Throws InputError where the plan is outside the box.
  Answer solve(const Request& request);
  /// Returns whether the last answer is that of a plan, at least as accurate; on all ranks.
  bool has_solved(const Placements& plan, double accuracy) const;
  /// Writes the last answer as NAME.h5 with its XDMF files. Returns the summary that it holds, of
  /// the face and what it touches. Throws InputError without an answer.
  std::string write(const std::filesystem::path& name);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace repose::app
