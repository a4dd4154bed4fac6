#include "repose/linear/preconditioner.h"

#include <string_view>

#include "repose/base/log.h"
#include "repose/base/petsc.h"

extern "C" PetscErrorCode PCCreate_Shell(PC pc);  // in no public header

namespace repose::linear {

using base::check;

namespace {

constexpr const char* columns_type = "columns";

/// In iterations: what a new preconditioner costs as much as.
constexpr double price_of_columns = 10, price_of_factors = 20;

double price_of_renewal(double usual) {
  PetscReal price = usual;
  base::check_options(PetscOptionsGetReal(nullptr, nullptr, "-pc_renewal_price", &price, nullptr));
  return price;
}

bool is_columns(PC pc) { return base::has_type(pc, columns_type); }

int64_t unknowns(const discrete::Positions& positions) {
  return 3 * positions.part().unknowns.total;  // scalar, of all ranks
}

}  // namespace

void choose_factors(PC pc) {
  check(PCSetType(pc, PCCHOLESKY));
  check(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
}

void give_room(PC pc) {
  constexpr int more_memory = 14, percent = 100;  // ICNTL
  if (!base::has_type(pc, PCCHOLESKY, PCLU)) return;
  Mat factor = nullptr;
  MatSolverType type = nullptr;
  check(PCFactorSetUpMatSolverType(pc));
  check(PCFactorGetMatrix(pc, &factor));
  check(MatFactorGetSolverType(factor, &type));
  if (!type || std::string_view(type) != MATSOLVERMUMPS) return;
  check(MatMumpsSetIcntl(factor, more_memory, percent));
}

HessianPreconditioner::HessianPreconditioner(discrete::Positions& positions,
                                             discrete::Hessian& hessian)
    : positions_(positions), hessian_(hessian), lag_(price_of_factors) {
  make();
}

void HessianPreconditioner::make() {
  check(PCCreate(positions_.comm(), pc_.out()));
  check(PCRegister(columns_type, PCCreate_Shell));
  if (hessian_.elliptic()) {
    check(PCSetType(pc_, columns_type));
    check(PCSetApplicationContext(pc_, this));
    check(PCShellSetApply(pc_, apply_columns));
  } else if (unknowns(positions_) <= factors_limit) {
    choose_factors(pc_);
  } else {
    check(PCSetType(pc_, PCGAMG));
  }
  base::check_options(PCSetFromOptions(pc_));
  lag_ = LagPolicy(price_of_renewal(is_columns(pc_) ? price_of_columns : price_of_factors));
}

void HessianPreconditioner::reset() {
  columns_.reset();
  factors_ = {};
  pc_ = {};
  make();
  renewals_ = 0;
  made_at_ = made_at_state_ = -1;
}

std::shared_ptr<const KeptPreconditioner> HessianPreconditioner::keep() const {
  if (!columns_) return nullptr;
  return std::make_shared<KeptPreconditioner>(
      KeptPreconditioner{columns_, columns_->numbers(), lag_});
}

void HessianPreconditioner::restore(const KeptPreconditioner& kept) {
  columns_ = kept.columns;
  columns_->set_numbers(*kept.numbers);
  lag_ = kept.lag;
  renewals_ = 1;
}

Mat HessianPreconditioner::matrix() {
  return is_columns(pc_) ? hessian_.model() : hessian_.spd_approximation();
}

void HessianPreconditioner::attach(KSP krylov) {
  check(KSPSetPC(krylov, pc_));
  check(KSPSetResidualHistory(krylov, nullptr, PETSC_DECIDE, PETSC_TRUE));
  check(KSPSetPostSolve(krylov, after_solve, this));
}

PetscErrorCode HessianPreconditioner::after_solve(KSP krylov, Vec, Vec, void* me) {
  return base::run_callback([&] { static_cast<HessianPreconditioner*>(me)->lag_.observe(krylov); });
}

void HessianPreconditioner::renew_if_worn() {
  const bool moved = hessian_.assemblies() != made_at_;
  if (moved) lag_.move();
  const bool renew = renewals_ == 0 || use_direct_fallback() || (moved && lag_.should_rebuild());
  check(PCSetReusePreconditioner(pc_, renew ? PETSC_FALSE : PETSC_TRUE));
  if (renew) rebuild();
}

void HessianPreconditioner::renew() {
  if (hessian_.assemblies() == made_at_) return;
  if (columns_ && hessian_.states() == made_at_state_) return update_contact();
  check(PCSetReusePreconditioner(pc_, PETSC_FALSE));
  rebuild();
}

bool HessianPreconditioner::use_direct_fallback() const {
  return columns_ && lag_.stagnates() && !factors_ && unknowns(positions_) <= factors_limit;
}

void HessianPreconditioner::rebuild() {
  static const PetscLogEvent event = base::log_event("PCRenew");
  const base::Logged logged(event);
  if (is_columns(pc_)) {
    rebuild_columns();
  } else {
    hessian_.renew();
    give_room(pc_);
    check(PCSetUp(pc_));
  }
  lag_.renew();
  made_at_ = hessian_.assemblies();
  made_at_state_ = hessian_.states();
  ++renewals_;
}

void HessianPreconditioner::rebuild_columns() {
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

void HessianPreconditioner::update_contact() {
  if (columns_ && positions_.part().contact)
    columns_->set_extra(
        [this](const discrete::BlockVisitor& visit) { hessian_.visit_contact_blocks(visit); });
}

PetscErrorCode HessianPreconditioner::apply_columns(PC pc, Vec r, Vec z) {
  HessianPreconditioner* self = nullptr;
  if (const PetscErrorCode code = PCGetApplicationContext(pc, &self)) return code;
  if (self->factors_) return PCApply(self->factors_, r, z);
  return base::run_callback([&] {
    static const PetscLogEvent event = base::log_event("RpColumns");
    const base::Logged logged(event);
    self->columns_->apply(r, z);
  });
}

}  // namespace repose::linear
