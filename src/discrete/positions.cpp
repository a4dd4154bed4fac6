#include "repose/discrete/positions.h"
#include "repose/base/collective.h"

#include <algorithm>

namespace repose::discrete {

using base::check;

Positions::Positions(MPI_Comm comm, const Part& part)
    : comm_(comm),
      part_(part),
      motion_(part.model),
      local_(part.model.points.position),
      poses_(poses_at(0)) {
  std::vector<PetscInt> blocks;
  for (size_t i = 0; i < part.unknown.size(); ++i) {
    if (part.unknown[i] >= 0) {
      soft_.push_back(static_cast<int32_t>(i));
      blocks.push_back(static_cast<PetscInt>(part.unknown[i]));
    } else {
      fixed_.push_back(static_cast<int32_t>(i));
    }
  }
  const auto count = static_cast<PetscInt>(blocks.size());
  check(VecCreateSeq(PETSC_COMM_SELF, 3 * count, ghosted_.out()));
  check(VecSetBlockSize(ghosted_, 3));
  base::IndexSetHandle from, to;
  check(ISCreateBlock(comm, 3, count, blocks.data(), PETSC_COPY_VALUES, from.out()));
  check(ISCreateStride(PETSC_COMM_SELF, 3 * count, 0, 1, to.out()));
  check(VecScatterCreate(make_vector(), from, ghosted_, to, scatter_.out()));
}

base::VecHandle Positions::make_vector() const {
  base::VecHandle v;
  check(VecCreate(comm_, v.out()));
  check(VecSetBlockSize(v, 3));
  check(VecSetSizes(v, static_cast<PetscInt>(3 * part_.unknowns.owned),
                    static_cast<PetscInt>(3 * part_.unknowns.total)));
  check(VecSetType(v, VECSTANDARD));
  check(VecSet(v, 0));
  return v;
}

std::vector<Vec3> Positions::travel_to(double load) const {
  std::vector<Vec3> travel(local_.size(), Vec3::Zero());
  for (const int32_t i : fixed_) travel[i] = motion_.at(part_.model, i, load) - local_[i];
  return travel;
}

std::vector<Mat4> Positions::poses_at(double load) const {
  std::vector<Mat4> poses;
  for (int32_t b = 0; b < static_cast<int32_t>(part_.model.bones.size()); ++b)
    poses.push_back(motion_.bone_matrix(b, load));
  return poses;
}

void Positions::set_load(double load) {
  load_ = load;
  poses_ = poses_at(load);
  ++revision_;
  for (int32_t i : fixed_) local_[i] = motion_.at(part_.model, i, load);
}

void Positions::set_motion(int32_t bone, const scene::RigidMotion& motion) {
  motion_.set(bone, motion);
  set_load(load_);
}

double Positions::largest_travel() const {
  const model::ContactPairs& pairs = part_.model.contact.pairs;
  std::vector<model::PrescribedMotion::Beside> beside;
  double pushed = 0;
  for (size_t c = 0; c < pairs.point.size(); ++c) {
    const mechanics::RigidBody& body = part_.bodies[pairs.body[c]];
    if (body.bone() >= 0) beside.push_back({body.bone(), pairs.point[c]});
    pushed = std::max(pushed, body.push().norm());
  }
  return base::max_over_ranks(comm_, std::max(pushed, motion_.largest_travel(part_.model, beside)));
}

void Positions::scatter_to_local(Vec in, std::span<Vec3> out) const {
  check(VecScatterBegin(scatter_, in, ghosted_, INSERT_VALUES, SCATTER_FORWARD));
  check(VecScatterEnd(scatter_, in, ghosted_, INSERT_VALUES, SCATTER_FORWARD));
  const PetscScalar* values = nullptr;
  check(VecGetArrayRead(ghosted_, &values));
  for (size_t k = 0; k < soft_.size(); ++k) out[soft_[k]] = Eigen::Map<const Vec3>(values + 3 * k);
  check(VecRestoreArrayRead(ghosted_, &values));
}

void Positions::update(Vec displacement) {
  scatter_to_local(displacement, local_);
  for (int32_t i : soft_) local_[i] += part_.model.points.position[i];
}

void Positions::restrict_to_owned(std::span<const Vec3> values, Vec out) const {
  PetscScalar* target = nullptr;
  check(VecGetArrayWrite(out, &target));
  for (int64_t i = 0; i < part_.owned_points; ++i)
    if (part_.unknown[i] >= 0)
      Eigen::Map<Vec3>(target + 3 * (part_.unknown[i] - part_.unknowns.first)) = values[i];
  check(VecRestoreArrayWrite(out, &target));
}

double largest_block(Vec v) {
  PetscInt size = 0;
  const PetscScalar* values = nullptr;
  check(VecGetLocalSize(v, &size));
  check(VecGetArrayRead(v, &values));
  double largest = 0;
  for (PetscInt k = 0; k + 2 < size; k += 3)
    largest = std::max(largest, Eigen::Map<const Vec3>(values + k).squaredNorm());
  check(VecRestoreArrayRead(v, &values));
  return std::sqrt(base::max_over_ranks(base::comm_of(v), largest));
}

}  // namespace repose::discrete
