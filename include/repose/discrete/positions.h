#pragma once
#include <span>
#include <vector>

#include "repose/base/petsc.h"
#include "repose/discrete/part.h"
#include "repose/model/motion.h"

namespace repose::discrete {

/// Where the points of a part are: the unknown displacements of soft-tissue points (a Vec of blocks
/// of 3, mm), and the prescribed motion of all others at a load.
class Positions {
 public:
  Positions(MPI_Comm comm, const Part& part);  ///< collective

  /// Moves bone and held points to where they are at `load`. Not collective.
  void set_load(double load);
  double load() const { return load_; }
  /// Gives a bone another whole motion, and moves its points to where they are at the load. Not
  /// collective.
  void set_motion(int32_t bone, const scene::RigidMotion& motion);
  /// Number of changes of load or motions so far.
  int64_t revision() const { return revision_; }

  /// 4×4 matrix that takes a bone from load 0 to the load.
  const Mat4& bone_matrix(int32_t bone) const { return poses_[bone]; }
  /// [bones] these matrices.
  std::span<const Mat4> poses() const { return poses_; }
  /// [bones] those at a load.
  std::vector<Mat4> poses_at(double load) const;

  /// Longest way of any fixed point from load 0 to 1, mm. Collective.
  double largest_travel() const;

  /// Takes in the displacement of the unknowns, ghosts included (one forward scatter). Collective.
  void update(Vec displacement);
  /// [local points] mm, as of the last update and load.
  std::span<const Vec3> local() const { return local_; }

  /// Returns the way of each fixed point from where it is to its place at a load, mm, 0 for
  /// unknowns [local points].
  std::vector<Vec3> travel_to(double load) const;

  /// A zero vector of unknowns: blocks of 3, this rank's soft-tissue points in local order.
  base::VecHandle make_vector() const;
  /// The rows of `values` [local points] that are unknowns of this rank, into `out`.
  void restrict_to_owned(std::span<const Vec3> values, Vec out) const;
  /// Ghosted copy: `out` [local points] = `in` at soft-tissue points, untouched elsewhere.
  /// Collective.
  void scatter_to_local(Vec in, std::span<Vec3> out) const;

  const Part& part() const { return part_; }
  MPI_Comm comm() const { return comm_; }

 private:
  MPI_Comm comm_;
  const Part& part_;
  model::PrescribedMotion motion_;
  std::vector<int32_t> soft_;   // local rows of soft-tissue points, ghosts included
  std::vector<int32_t> fixed_;  // local rows of the others
  base::VecHandle ghosted_;     // [3 soft_]
  base::ScatterHandle scatter_;
  std::vector<Vec3> local_;
  std::vector<Mat4> poses_;
  double load_ = 0;
  int64_t revision_ = 0;
};

/// Largest Euclidean norm of the 3-vectors of `v`. Collective.
double largest_block(Vec v);

}  // namespace repose::discrete
