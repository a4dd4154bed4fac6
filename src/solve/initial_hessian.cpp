#include "repose/solve/initial_hessian.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "repose/base/petsc_versions.h"

namespace repose::solve {

using base::check;

namespace {

double price_of_renewal() {
  PetscReal price = 12;
  check(PetscOptionsGetReal(nullptr, nullptr, "-tao_lmvm_renewal_price", &price, nullptr));
  return price;
}

}  // namespace

void StepWear::renew() {
  first_force_ = steps_ = cut_ = 0;
  best_rate_ = slowest;
}

bool StepWear::take(double force, double length) {
  if (first_force_ == 0) {
    first_force_ = force;
    return false;
  }
  constexpr double few = 4;  // iterations, whose rate says nothing yet
  ++steps_;
  cut_ += 1 - std::min(1.0, length);
  const double folds = std::log(first_force_ / force);
  if (steps_ < few) return cut_ > price_;
  best_rate_ = std::max(best_rate_, folds / steps_);
  return cut_ + steps_ - folds / best_rate_ > price_;
}

InitialHessian::InitialHessian(Tao tao, TangentSolver& solver)
    : solver_(solver), wear_(price_of_renewal()) {
  const Mat convex = solver.hessian().convex();
  PetscInt rows = 0, all_rows = 0;
  check(MatGetLocalSize(convex, &rows, nullptr));
  check(MatGetSize(convex, &all_rows, nullptr));
  check(MatCreateShell(PetscObjectComm(reinterpret_cast<PetscObject>(convex)), rows, rows, all_rows,
                       all_rows, this, inverse_.out()));
  check(MatShellSetOperation(inverse_, MATOP_SOLVE, reinterpret_cast<void (*)()>(apply)));
  check(MatSetUp(inverse_));
  check(TaoLMVMSetH0(tao, inverse_));
}

PetscErrorCode InitialHessian::apply(Mat matrix, Vec vector, Vec product) {
  InitialHessian* self = nullptr;
  const PetscErrorCode code = MatShellGetContext(matrix, &self);
  return code ? code : PCApply(self->solver_.preconditioner(), vector, product);
}

void InitialHessian::renew(Vec displacement) {
  solver_.renew(displacement);
  renewals_ = solver_.renewals();
  wear_.renew();
}

bool InitialHessian::worn_out(double force, double length) {
  if (renewals_ != solver_.renewals()) wear_.renew();  // by a look at the distance from rest
  renewals_ = solver_.renewals();
  return wear_.take(force, length);
}

bool begins_with_stiffness() {
  char chosen[32] = "diagonal";
  check(
      PetscOptionsGetString(nullptr, nullptr, "-tao_lmvm_initial", chosen, sizeof chosen, nullptr));
  const std::string_view name(chosen);
  if (name != "diagonal" && name != "stiffness")
    base::refuse("-tao_lmvm_initial: '{}' is none of diagonal, stiffness", name);
  return name == "stiffness";
}

}  // namespace repose::solve
