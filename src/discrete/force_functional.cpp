#include "repose/discrete/force_functional.h"

#include <algorithm>
#include <cmath>

#include "repose/base/collective.h"

namespace repose::discrete {

using base::check;

namespace {

/// Calls visit(row of this rank's unknowns, F_i) for each of them, at the last update.
template <class Visit>
void for_each_force(Objective& elastic, Visit&& visit) {
  const Part& part = elastic.positions().part();
  const std::vector<Vec3> force = elastic.residual_force();
  for (int64_t i = 0; i < part.owned_points; ++i)
    if (part.unknown[i] >= 0) visit(part.unknown[i] - part.unknowns.first, force[i]);
}

}  // namespace

ForceFunctional::ForceFunctional(Objective& elastic, const mechanics::Weights& weights)
    : Function(elastic.positions()),
      elastic_(elastic),
      weights_(weights),
      unit_(positions_.make_vector()),
      volume_gradient_(positions_.make_vector()),
      direction_(positions_.local().size(), Vec3::Zero()) {
  if (weights.volume == mechanics::VolumeTerm::none) return;
  volume_ = std::make_unique<Objective>(
      positions_, mechanics::Weights{0, weights.volume, weights.volume_weight});
}

double ForceFunctional::largest_force(Vec displacement) {
  positions_.update(displacement);
  double largest = 0;
  for_each_force(elastic_, [&](int64_t, const Vec3& f) { largest = std::max(largest, f.norm()); });
  return base::max_over_ranks(positions_.comm(), largest);
}

std::span<const Vec3> ForceFunctional::directions() {
  PetscScalar* unit = nullptr;
  check(VecGetArray(unit_, &unit));
  for_each_force(elastic_, [&](int64_t row, const Vec3& force) {
    Eigen::Map<Vec3>(unit + 3 * row) = force / std::hypot(force.norm(), epsilon_);
  });
  check(VecRestoreArray(unit_, &unit));
  positions_.scatter_to_local(unit_, direction_);
  return direction_;
}

double ForceFunctional::value_and_gradient(Vec displacement, Vec gradient) {
  positions_.update(displacement);
  double value = 0;
  for_each_force(elastic_, [&](int64_t, const Vec3& force) {
    const double length = std::hypot(force.norm(), epsilon_);
    value += force.squaredNorm() / (length + epsilon_);  // √(|F|² + ε²) − ε without canceling
  });
  value = weights_.elastic * base::sum_over_ranks(positions_.comm(), value);
  if (gradient) {
    elastic_.hessian_action(directions(), gradient);
    check(VecScale(gradient, -weights_.elastic));
  }
  if (volume_) {
    value +=
        volume_->evaluate(displacement, gradient ? static_cast<Vec>(volume_gradient_) : nullptr);
    if (gradient) check(VecAXPY(gradient, 1, volume_gradient_));
  }
  if (std::isfinite(value) && value < overflown) return value;
  if (gradient) check(VecSet(gradient, 0));
  return overflown;
}

ForceHessian::ForceHessian(ForceFunctional& functional, Tangent& elastic)
    : functional_(functional), elastic_(elastic), third_(elastic.make_third()) {
  if (functional.volume()) volume_ = std::make_unique<Tangent>(*functional.volume());
  make_metric();
  const base::VecHandle at_start = functional.positions().make_vector();
  assemble(at_start);
}

void ForceHessian::make_metric() {
  const Part& part = functional_.positions().part();
  const auto owned = static_cast<PetscInt>(3 * part.unknowns.owned);
  const auto total = static_cast<PetscInt>(3 * part.unknowns.total);
  check(MatCreate(functional_.positions().comm(), metric_.out()));
  check(MatSetSizes(metric_, owned, owned, total, total));
  check(MatSetType(metric_, MATAIJ));
  check(MatSetBlockSize(metric_, 3));
  check(MatSeqAIJSetPreallocation(metric_, 3, nullptr));
  check(MatMPIAIJSetPreallocation(metric_, 3, nullptr, 0, nullptr));
}

void ForceHessian::fill_metric() {
  const PetscInt first = static_cast<PetscInt>(functional_.positions().part().unknowns.first);
  for_each_force(functional_.elastic(), [&](int64_t row, const Vec3& force) {
    const double length = std::hypot(force.norm(), functional_.epsilon());
    const Vec3 unit = force / length;
    const Mat3 block =
        functional_.weights().elastic / length * (Mat3::Identity() - unit * unit.transpose());
    const PetscInt place = first + static_cast<PetscInt>(row);
    check(MatSetValuesBlocked(metric_, 1, &place, 1, &place, block.data(), INSERT_VALUES));
  });
  check(MatAssemblyBegin(metric_, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(metric_, MAT_FINAL_ASSEMBLY));
}

void ForceHessian::lift_diagonal() {
  constexpr double lift = 1e-12;  // of the largest diagonal entry, so that factors stay positive
  base::VecHandle diagonal = functional_.positions().make_vector();
  check(MatGetDiagonal(spd_, diagonal));
  PetscReal largest = 0;
  check(VecNorm(diagonal, NORM_INFINITY, &largest));
  check(MatShift(spd_, lift * largest));
  check(MatSetOption(spd_, MAT_SPD, PETSC_TRUE));
}

void ForceHessian::assemble(Vec displacement) {
  elastic_.assemble(displacement);
  if (elastic_.assemblies() == elastic_assemblies_ && functional_.epsilon() == epsilon_) return;
  elastic_assemblies_ = elastic_.assemblies();
  epsilon_ = functional_.epsilon();
  functional_.positions().update(displacement);
  fill_metric();
  if (spd_)
    check(MatPtAP(metric_, elastic_.exact(), MAT_REUSE_MATRIX, PETSC_DEFAULT, spd_.out()));
  else
    check(MatPtAP(metric_, elastic_.exact(), MAT_INITIAL_MATRIX, 2, spd_.out()));
  if (!exact_) check(MatDuplicate(spd_, MAT_DO_NOT_COPY_VALUES, exact_.out()));
  check(MatCopy(spd_, exact_, SAME_NONZERO_PATTERN));
  elastic_.third(functional_.directions(), third_);
  check(MatAXPY(exact_, -functional_.weights().elastic, third_, SUBSET_NONZERO_PATTERN));
  if (volume_) {
    volume_->assemble(displacement);
    volume_->renew();
    check(MatAXPY(exact_, 1, volume_->exact(), SUBSET_NONZERO_PATTERN));
    check(MatAXPY(spd_, 1, volume_->spd_approximation(), SUBSET_NONZERO_PATTERN));
  }
  lift_diagonal();
  ++assemblies_;
}

}  // namespace repose::discrete
