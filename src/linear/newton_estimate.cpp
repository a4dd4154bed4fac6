#include "repose/linear/newton_estimate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "repose/base/petsc.h"

namespace repose::linear {

using base::check;

namespace {

/// 1 or −1, the same for a number on any ranks (the mixing of SplitMix64: Steele, Lea & Flood
/// 2014).
double random_sign(uint64_t number) {
  uint64_t bits = (number + 1) * 0x9e3779b97f4a7c15u;
  bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9u;
  bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebu;
  return (bits >> 63) == 0 ? 1.0 : -1.0;
}

}  // namespace

NewtonEstimate::NewtonEstimate(TangentSolver& solver)
    : solver_(solver),
      step_(solver.positions().make_vector()),
      gradient_(solver.positions().make_vector()),
      next_(solver.positions().make_vector()) {}

double NewtonEstimate::preconditioned_distance(Vec gradient) {
  if (solver_.preconditioner().renewals() == 0) return 0;
  measured_at_ = -1;
  check(PCApply(solver_.preconditioner(), gradient, step_));
  return discrete::largest_block(step_);
}

double NewtonEstimate::distance(Vec displacement, Vec gradient) {
  solver_.hessian().assemble(displacement);
  PetscBool same = PETSC_FALSE;  // asked again at the same state
  if (measured_at_ == solver_.hessian().assemblies()) check(VecEqual(gradient, gradient_, &same));
  if (same) return distance_;
  check(VecSet(step_, 0));
  negative_curvature_ = !solver_.solve(displacement, gradient, step_, usual_);
  distance_ = negative_curvature_ ? std::numeric_limits<double>::infinity()
                                  : discrete::largest_block(step_);
  measured_at_ = solver_.hessian().assemblies();
  bounded_ = false;
  check(VecCopy(gradient, gradient_));
  return distance_;
}

double NewtonEstimate::largest_compliance(Vec displacement) {
  solver_.hessian().assemble(displacement);
  auto& [compliance, convex, at] = random_load_;
  if (at == solver_.hessian().assemblies()) return compliance;
  base::VecHandle load = solver_.positions().make_vector();
  PetscInt begin = 0, end = 0;
  PetscScalar* values = nullptr;
  check(VecGetOwnershipRange(load, &begin, &end));
  check(VecGetArray(load, &values));
  for (PetscInt i = begin; i < end; ++i) values[i - begin] = random_sign(static_cast<uint64_t>(i));
  check(VecRestoreArray(load, &values));
  check(VecSet(next_, 0));
  bool known = false;
  for (const double share : {0.3, 1e-3, 1e-6}) {
    convex = solver_.solve(displacement, load, next_, share);
    known = convex && solver_.finished() && residual_decreased(load, next_);
    if (known || !convex) break;
  }
  at = solver_.hessian().assemblies();
  return compliance =
             known ? discrete::largest_block(next_) : std::numeric_limits<double>::infinity();
}

bool NewtonEstimate::residual_decreased(Vec rhs, Vec delta) {
  base::VecHandle left = solver_.positions().make_vector();
  PetscReal before = 0, after = 0;
  check(MatMult(solver_.hessian().action(), delta, left));
  check(VecAYPX(left, -1, rhs));
  check(VecNorm(rhs, NORM_2, &before));
  check(VecNorm(left, NORM_2, &after));
  return after <= before;
}

bool NewtonEstimate::is_minimum(Vec displacement) {
  return std::isfinite(largest_compliance(displacement)) || random_load_.convex;
}

bool NewtonEstimate::refine(Vec displacement, Vec gradient, double factor) {
  base::VecHandle left = solver_.positions().make_vector();
  check(MatMult(solver_.hessian().action(), step_, left));
  check(VecAYPX(left, -1, gradient));
  check(VecSet(next_, 0));
  const bool convex = solver_.solve(displacement, left, next_, factor);
  check(VecAXPY(step_, 1, next_));
  return convex && solver_.finished();
}

double NewtonEstimate::bound(Vec displacement, Vec gradient, double slack) {
  // The preconditioner's norm, which ends a solve, is the energy's but roughly, and a random load
  // does not find the largest compliance. Stiffnesses of springs may lie twelve orders of magnitude
  // apart, where the preconditioner's rounding adds to it.
  const double margin = solver_.positions().part().solid ? 50 : 200;
  constexpr double finest = 1e-12;
  const CgInPlaceOfPreonly iterating(solver_.krylov());  // one application bounds nothing
  if (iterating.replaced()) measured_at_ = -1;
  const double rough = distance(displacement, gradient);
  if (!(rough > 0) || !std::isfinite(rough) || bounded_) return rough;
  PetscReal energy = 0;
  check(VecDot(gradient, step_, &energy));
  const double reach = margin * std::sqrt(largest_compliance(displacement) * energy);  // mm
  const double bound = std::max(rough, slack);
  double left = usual_ * reach;
  if (left > bound) {
    const double requested = bound / reach;
    left = bound;
    const bool sure = requested > finest && refine(displacement, gradient, requested / usual_);
    distance_ = sure ? std::max(rough, discrete::largest_block(step_))
                     : std::numeric_limits<double>::infinity();
  }
  error_slack_ = left > rough ? 2 * left : 0;
  bounded_ = true;
  return distance_;
}

double NewtonEstimate::contraction(Vec displacement, Vec trial, Vec gradient) {
  constexpr double endless = std::numeric_limits<double>::infinity();
  constexpr double close = 0.2, max_left = 0.5;
  PetscReal slope = 0, left = 0, next_slope = 0;
  check(VecDot(gradient_, step_, &slope));
  check(VecDot(gradient, step_, &left));
  if (std::abs(left) > max_left * slope) return endless;
  check(VecSet(next_, 0));
  const bool convex = solver_.solve(trial, gradient, next_, close);
  solver_.hessian().assemble(displacement);
  measured_at_ = solver_.hessian().assemblies();  // what is known there is not lost
  if (!convex) return endless;
  check(VecDot(gradient, next_, &next_slope));
  return std::max(discrete::largest_block(next_) / distance_, std::sqrt(next_slope / slope));
}

}  // namespace repose::linear
