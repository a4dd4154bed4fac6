#include "initial_hessian.h"

#include <algorithm>
#include <cmath>

#include "repose/base/petsc.h"

namespace repose::solve {

using base::check;

namespace {

struct LmvmOptions {
  PetscInt initial = 0;  // of choices
  PetscReal price = 12;  // of a renewal, in iterations
};

/// PETSc's way, so that `-help petsc` lists them.
PetscErrorCode read_options(MPI_Comm comm, LmvmOptions& requested) {
  const char* const choices[] = {"diagonal", "stiffness"};
  PetscFunctionBegin;
  PetscOptionsBegin(comm, nullptr, "Initial Hessian of limited-memory BFGS", "");
  PetscCall(PetscOptionsEList("-tao_lmvm_initial", "What it begins with", "", choices, 2,
                              choices[requested.initial], &requested.initial, nullptr));
  PetscCall(PetscOptionsReal("-tao_lmvm_renewal_price",
                             "Iterations that the stiffness may cost before it is renewed", "",
                             requested.price, &requested.price, nullptr));
  PetscOptionsEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

LmvmOptions requested_by_options(MPI_Comm comm, bool solid = false) {
  LmvmOptions requested;
  if (solid) requested.initial = 1;
  base::check_options(read_options(comm, requested));
  return requested;
}

}  // namespace

void StepLag::renew() {
  first_force_ = steps_ = cut_ = 0;
  best_rate_ = slowest;
}

bool StepLag::observe(double force, double length) {
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

InitialHessian::InitialHessian(Tao tao, linear::TangentSolver& solver)
    : solver_(solver), lag_(requested_by_options(base::comm_of(solver.hessian().action())).price) {
  const Mat action = solver.hessian().action();
  PetscInt rows = 0, all_rows = 0;
  check(MatGetLocalSize(action, &rows, nullptr));
  check(MatGetSize(action, &all_rows, nullptr));
  check(
      MatCreateShell(base::comm_of(action), rows, rows, all_rows, all_rows, this, inverse_.out()));
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
  renewals_ = solver_.preconditioner().renewals();
  lag_.renew();
}

bool InitialHessian::needs_renewal(double force, double length) {
  if (renewals_ != solver_.preconditioner().renewals())
    lag_.renew();  // by an estimate of the distance from rest
  renewals_ = solver_.preconditioner().renewals();
  return lag_.observe(force, length);
}

bool begins_with_stiffness(const discrete::Positions& positions) {
  return requested_by_options(positions.comm(), positions.part().solid).initial == 1;
}

}  // namespace repose::solve
