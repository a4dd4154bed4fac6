#include "repose/linear/tangent_solver.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "repose/base/error.h"
#include "repose/base/log.h"
#include "repose/base/petsc.h"

extern "C" PetscErrorCode PCCreate_Shell(PC pc);  // in no public header

namespace repose::linear {

using base::check;

namespace {

constexpr const char* columns_type = "columns";

void choose_factors(PC pc) {
  check(PCSetType(pc, PCCHOLESKY));
  check(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
}

/// MUMPS sets too little memory aside for factors on many ranks.
void give_room(PC pc) {
  constexpr int more_memory = 14, percent = 100;  // ICNTL
  PetscBool factors = PETSC_FALSE;
  check(
      PetscObjectTypeCompareAny(reinterpret_cast<PetscObject>(pc), &factors, PCCHOLESKY, PCLU, ""));
  if (!factors) return;
  Mat factor = nullptr;
  MatSolverType type = nullptr;
  check(PCFactorSetUpMatSolverType(pc));
  check(PCFactorGetMatrix(pc, &factor));
  check(MatFactorGetSolverType(factor, &type));
  if (!type || std::string_view(type) != MATSOLVERMUMPS) return;
  check(MatMumpsSetIcntl(factor, more_memory, percent));
}

/// 1 or −1, the same for a number on any ranks (the mixing of SplitMix64: Steele, Lea & Flood
/// 2014).
double random_sign(uint64_t number) {
  uint64_t bits = (number + 1) * 0x9e3779b97f4a7c15u;
  bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9u;
  bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebu;
  return (bits >> 63) == 0 ? 1.0 : -1.0;
}

/// In iterations: what a new preconditioner costs as much as.
constexpr double price_of_columns = 10, price_of_factors = 20;

double price_of_renewal(double usual) {
  PetscReal price = usual;
  base::check_options(PetscOptionsGetReal(nullptr, nullptr, "-pc_renewal_price", &price, nullptr));
  return price;
}

/// MINRES has no natural norm.
void choose_norm(KSP krylov) {
  PetscBool minres = PETSC_FALSE;
  check(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(krylov), KSPMINRES, &minres));
  if (minres) check(KSPSetNormType(krylov, KSP_NORM_PRECONDITIONED));
}

/// Solves with conjugate gradients, as long as it lives, where the preconditioner alone is chosen.
class CgInPlaceOfPreonly {
 public:
  explicit CgInPlaceOfPreonly(KSP krylov) : krylov_(krylov) {
    check(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(krylov), KSPPREONLY, &replaced_));
    if (replaced_) check(KSPSetType(krylov_, KSPCG));
  }
  ~CgInPlaceOfPreonly() {
    if (replaced_) static_cast<void>(KSPSetType(krylov_, KSPPREONLY));
  }
  CgInPlaceOfPreonly(const CgInPlaceOfPreonly&) = delete;
  CgInPlaceOfPreonly& operator=(const CgInPlaceOfPreonly&) = delete;
  bool replaced() const { return replaced_ == PETSC_TRUE; }

 private:
  KSP krylov_;
  PetscBool replaced_ = PETSC_FALSE;
};

bool is_columns(PC pc) {
  PetscBool same = PETSC_FALSE;
  check(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(pc), columns_type, &same));
  return same;
}

}  // namespace

TangentSolver::TangentSolver(discrete::Positions& positions, discrete::Hessian& hessian)
    : positions_(positions),
      hessian_(hessian),
      unknowns_(3 * positions.part().total_unknowns),
      next_(positions.make_vector()),
      work_(positions.make_vector()),
      measured_(positions.make_vector()),
      lag_(price_of_renewal(price_of_factors)) {
  make_krylov();
}

void TangentSolver::make_krylov() {
  check(KSPCreate(positions_.comm(), krylov_.out()));
  check(KSPSetType(krylov_, KSPCG));
  check(KSPSetNormType(krylov_, KSP_NORM_NATURAL));
  check(KSPSetTolerances(krylov_, 1e-3, 0.0, PETSC_DEFAULT, 500));
  choose_preconditioner();
  share_preconditioner(krylov_);
  base::check_options(KSPSetFromOptions(krylov_));
  choose_norm(krylov_);
  const bool columns = is_columns(preconditioner());
  lag_ = LagPolicy(price_of_renewal(columns ? price_of_columns : price_of_factors));
  check(KSPSetOperators(krylov_, hessian_.action(), preconditioner_matrix()));
}

struct KeptPreconditioner {
  std::shared_ptr<ColumnMultigrid> columns;
  std::shared_ptr<const ColumnMultigrid::Numbers> numbers;
  LagPolicy lag;
};

void TangentSolver::reset() {
  columns_.reset();
  factors_ = {};
  krylov_ = {};
  make_krylov();
  renewals_ = 0;
  made_at_ = made_at_state_ = measured_at_ = bounded_at_ = loaded_at_ = -1;
  convex_ = true;
  negative_curvature_ = finished_ = false;
}

std::shared_ptr<const KeptPreconditioner> TangentSolver::make_kept(Vec displacement) {
  reset();
  renew(displacement);
  if (!columns_) return nullptr;
  return std::make_shared<KeptPreconditioner>(
      KeptPreconditioner{columns_, columns_->numbers(), lag_});
}

void TangentSolver::restore(const KeptPreconditioner& kept) {
  reset();
  columns_ = kept.columns;
  columns_->set_numbers(*kept.numbers);
  lag_ = kept.lag;
  renewals_ = 1;
}

void TangentSolver::choose_preconditioner() {
  const PC pc = preconditioner();
  check(PCRegister(columns_type, PCCreate_Shell));
  if (!hessian_.elliptic()) {
    if (unknowns_ <= factors_limit)
      choose_factors(pc);
    else
      check(PCSetType(pc, PCGAMG));
    return;
  }
  check(PCSetType(pc, columns_type));
  check(PCSetApplicationContext(pc, this));
  check(PCShellSetApply(pc, apply_columns));
}

Mat TangentSolver::preconditioner_matrix() {
  return is_columns(preconditioner()) ? hessian_.model() : hessian_.spd_approximation();
}

PC TangentSolver::preconditioner() {
  PC pc = nullptr;
  check(KSPGetPC(krylov_, &pc));
  return pc;
}

void TangentSolver::share_preconditioner(KSP other) {
  if (other != krylov_) check(KSPSetPC(other, preconditioner()));
  check(KSPSetResidualHistory(other, nullptr, PETSC_DECIDE, PETSC_TRUE));
  check(KSPSetPostSolve(other, after_solve, this));
}

PetscErrorCode TangentSolver::after_solve(KSP krylov, Vec, Vec, void* me) {
  try {
    static_cast<TangentSolver*>(me)->lag_.observe(krylov);
  } catch (const std::exception&) {
    return PETSC_ERR_LIB;
  }
  return PETSC_SUCCESS;
}

void TangentSolver::prepare(Vec displacement) {
  hessian_.assemble(displacement);
  const bool moved = hessian_.assemblies() != made_at_;
  if (moved) lag_.move();
  const bool renew = renewals_ == 0 || use_direct_fallback() || (moved && lag_.should_rebuild());
  check(PCSetReusePreconditioner(preconditioner(), renew ? PETSC_FALSE : PETSC_TRUE));
  if (renew) renew_preconditioner();
}

void TangentSolver::renew(Vec displacement) {
  hessian_.assemble(displacement);
  if (hessian_.assemblies() == made_at_) return;
  if (columns_ && hessian_.states() == made_at_state_) return refresh(displacement);
  check(PCSetReusePreconditioner(preconditioner(), PETSC_FALSE));
  renew_preconditioner();
}

bool TangentSolver::use_direct_fallback() const {
  return columns_ && lag_.stagnates() && !factors_ && unknowns_ <= factors_limit;
}

void TangentSolver::renew_preconditioner() {
  static const PetscLogEvent event = base::log_event("PCRenew");
  const base::Logged logged(event);
  const PC pc = preconditioner();
  if (is_columns(pc)) {
    renew_columns();
  } else {
    hessian_.renew();
    give_room(pc);
    check(PCSetUp(pc));
  }
  lag_.renew();
  made_at_ = hessian_.assemblies();
  made_at_state_ = hessian_.states();
  ++renewals_;
}

void TangentSolver::renew_columns() {
  const BlockSource blocks = [this](const discrete::BlockVisitor& visit) {
    hessian_.visit_spd_blocks(visit);
  };
  if (use_direct_fallback()) {
    columns_.reset();
    check(PCCreate(positions_.comm(), factors_.out()));
    choose_factors(factors_);
    lag_ = LagPolicy(price_of_renewal(price_of_factors));
  }
  if (factors_) {
    hessian_.renew();
    check(PCSetOperators(factors_, hessian_.spd_approximation(), hessian_.spd_approximation()));
    give_room(factors_);
    check(PCSetUp(factors_));
  } else if (columns_) {
    columns_->refill(blocks);
  } else {
    columns_ = std::make_shared<ColumnMultigrid>(positions_.comm(), positions_.part(), blocks);
  }
  update_contact();
}

void TangentSolver::refresh(Vec displacement) {
  hessian_.assemble(displacement);
  update_contact();
}

void TangentSolver::update_contact() {
  if (columns_ && positions_.part().contact)
    columns_->set_extra(
        [this](const discrete::BlockVisitor& visit) { hessian_.visit_contact_blocks(visit); });
}

PetscErrorCode TangentSolver::apply_columns(PC pc, Vec r, Vec z) {
  TangentSolver* self = nullptr;
  if (const PetscErrorCode code = PCGetApplicationContext(pc, &self)) return code;
  if (self->factors_) return PCApply(self->factors_, r, z);
  try {
    static const PetscLogEvent event = base::log_event("RpColumns");
    const base::Logged logged(event);
    self->columns_->apply(r, z);
  } catch (const std::exception&) {
    return PETSC_ERR_LIB;
  }
  return PETSC_SUCCESS;
}

void TangentSolver::throw_unsolvable() {
  bool finite = true;
  hessian_.visit_spd_blocks([&](int32_t, int32_t, const Mat3& block) {
    if (!block.allFinite()) finite = false;
  });
  if (!base::on_all_ranks(positions_.comm(), finite))
    discrete::refuse_overflow("stiffnesses", positions_.load());
  throw base::PetscError("the preconditioner of the stiffness matrix could not be made");
}

bool TangentSolver::solve(Vec displacement, Vec rhs, Vec delta, double relative_tolerance) {
  prepare(displacement);
  check(KSPSetOperators(krylov_, hessian_.action(), preconditioner_matrix()));
  check(KSPSetTolerances(krylov_, relative_tolerance, 0.0, PETSC_DEFAULT, PETSC_DEFAULT));
  check(KSPSolve(krylov_, rhs, delta));
  KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
  check(KSPGetConvergedReason(krylov_, &reason));
  if (reason == KSP_DIVERGED_PC_FAILED || reason == KSP_DIVERGED_NANORINF) throw_unsolvable();
  finished_ = reason > 0 && reason != KSP_CONVERGED_ITS;  // preonly asks for no accuracy
  // PETSc's conjugate gradients see the curvature change its sign, not that it has the wrong one.
  PetscReal product = 0;
  check(VecDot(rhs, delta, &product));
  return product >= 0 && reason != KSP_DIVERGED_INDEFINITE_MAT &&
         reason != KSP_DIVERGED_INDEFINITE_PC;
}

void TangentSolver::product_of_solution(Vec rhs, Vec product) {
  Vec left = nullptr;
  check(KSPBuildResidual(krylov_, nullptr, next_, &left));
  check(VecWAXPY(product, -1.0, left, rhs));
}

double TangentSolver::preconditioned_step(Vec gradient) {
  if (renewals_ == 0) return 0;
  measured_at_ = -1;
  check(PCApply(preconditioner(), gradient, work_));
  return discrete::largest_block(work_);
}

double TangentSolver::newton_distance(Vec displacement, Vec gradient) {
  hessian_.assemble(displacement);
  PetscBool same = PETSC_FALSE;  // asked again at the same state
  if (measured_at_ == hessian_.assemblies()) check(VecEqual(gradient, measured_, &same));
  if (same) return distance_;
  check(VecSet(work_, 0));
  negative_curvature_ = !solve(displacement, gradient, work_, usual_);
  distance_ = negative_curvature_ ? std::numeric_limits<double>::infinity()
                                  : discrete::largest_block(work_);
  measured_at_ = hessian_.assemblies();
  bounded_at_ = -1;
  check(VecCopy(gradient, measured_));
  return distance_;
}

/// Upper estimate of a point's compliance, mm/N, by a load of random signs. Soft points move most,
/// and take most of its energy, so that a rough solution suffices.
double TangentSolver::largest_compliance(Vec displacement) {
  hessian_.assemble(displacement);
  if (loaded_at_ == hessian_.assemblies()) return compliance_;
  base::VecHandle load = positions_.make_vector();
  PetscInt begin = 0, end = 0;
  PetscScalar* values = nullptr;
  check(VecGetOwnershipRange(load, &begin, &end));
  check(VecGetArray(load, &values));
  for (PetscInt i = begin; i < end; ++i) values[i - begin] = random_sign(static_cast<uint64_t>(i));
  check(VecRestoreArray(load, &values));
  check(VecSet(next_, 0));
  bool known = false;
  for (const double share : {0.3, 1e-3, 1e-6}) {
    convex_ = solve(displacement, load, next_, share);
    known = convex_ && finished_ && residual_decreased(load, next_);
    if (known || !convex_) break;
  }
  compliance_ = known ? discrete::largest_block(next_) : std::numeric_limits<double>::infinity();
  loaded_at_ = hessian_.assemblies();
  return compliance_;
}

bool TangentSolver::residual_decreased(Vec rhs, Vec delta) {
  base::VecHandle left = positions_.make_vector();
  PetscReal before = 0, after = 0;
  check(MatMult(hessian_.action(), delta, left));
  check(VecAYPX(left, -1, rhs));
  check(VecNorm(rhs, NORM_2, &before));
  check(VecNorm(left, NORM_2, &after));
  return after <= before;
}

bool TangentSolver::is_minimum(Vec displacement) {
  return std::isfinite(largest_compliance(displacement)) || convex_;
}

bool TangentSolver::refine(Vec displacement, Vec gradient, double factor) {
  base::VecHandle left = positions_.make_vector();
  check(MatMult(hessian_.action(), work_, left));
  check(VecAYPX(left, -1, gradient));
  check(VecSet(next_, 0));
  const bool convex = solve(displacement, left, next_, factor);
  check(VecAXPY(work_, 1, next_));
  return convex && finished_;
}

double TangentSolver::error_bound(Vec displacement, Vec gradient, double slack) {
  // The preconditioner's norm, which ends a solve, is the energy's but roughly, and a random load
  // does not find the largest compliance. Stiffnesses of springs may lie twelve orders of magnitude
  // apart, where the preconditioner's rounding adds to it.
  const double margin = positions_.part().solid ? 50 : 200;
  constexpr double finest = 1e-12;
  const CgInPlaceOfPreonly iterating(krylov_);  // one application bounds nothing
  if (iterating.replaced()) measured_at_ = -1;
  const double rough = newton_distance(displacement, gradient);
  if (!(rough > 0) || !std::isfinite(rough) || bounded_at_ == measured_at_) return rough;
  PetscReal energy = 0;
  check(VecDot(gradient, work_, &energy));
  const double reach = margin * std::sqrt(largest_compliance(displacement) * energy);  // mm
  const double bound = std::max(rough, slack);
  double left = usual_ * reach;
  if (left > bound) {
    const double requested = bound / reach;
    left = bound;
    const bool sure = requested > finest && refine(displacement, gradient, requested / usual_);
    distance_ = sure ? std::max(rough, discrete::largest_block(work_))
                     : std::numeric_limits<double>::infinity();
  }
  error_slack_ = left > rough ? 2 * left : 0;
  bounded_at_ = measured_at_;
  return distance_;
}

double TangentSolver::contraction(Vec displacement, Vec trial, Vec gradient) {
  constexpr double endless = std::numeric_limits<double>::infinity();
  constexpr double close = 0.2, max_left = 0.5;
  PetscReal slope = 0, left = 0, next_slope = 0;
  check(VecDot(measured_, work_, &slope));
  check(VecDot(gradient, work_, &left));
  if (std::abs(left) > max_left * slope) return endless;
  check(VecSet(next_, 0));
  const bool convex = solve(trial, gradient, next_, close);
  hessian_.assemble(displacement);
  if (bounded_at_ == measured_at_) bounded_at_ = hessian_.assemblies();
  measured_at_ = hessian_.assemblies();  // what is known there is not lost
  if (!convex) return endless;
  check(VecDot(gradient, next_, &next_slope));
  return std::max(discrete::largest_block(next_) / distance_, std::sqrt(next_slope / slope));
}

}  // namespace repose::linear
