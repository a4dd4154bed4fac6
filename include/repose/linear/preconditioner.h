#pragma once
#include <petscksp.h>

#include <memory>

#include "repose/linear/column_multigrid.h"
#include "repose/linear/lag_policy.h"

namespace repose::linear {

using PcHandle = base::Handle<PC, PCDestroy>;

/// Chooses MUMPS' Cholesky factors.
void choose_factors(PC pc);
/// Gives MUMPS more memory: it sets too little aside for factors on many ranks. Nothing where there
/// are other factors, or none. The matrix is known.
void give_room(PC pc);

/// A preconditioner and what has been found out with it.
struct KeptPreconditioner {
  std::shared_ptr<ColumnMultigrid> columns;
  std::shared_ptr<const ColumnMultigrid::Numbers> numbers;
  LagPolicy lag;
};

/// Preconditioner of a Hessian, made from its convex relative: by default multigrid on columns
/// (`-pc_type columns`, column_multigrid.h); falls back to MUMPS' Cholesky factors when that
/// stagnates; these also serve where multigrid does not work, up to `factors_limit` unknowns. One
/// made at one state serves the next ones until it is worn out (lag_policy.h). `-pc_…` options
/// apply, and `-pc_renewal_price`: the iterations that it may cost before it is renewed. The
/// Hessian is assembled by the caller. All members collective.
class HessianPreconditioner {
 public:
  static constexpr int64_t factors_limit = 600000;  ///< scalar unknowns

  HessianPreconditioner(discrete::Positions& positions, discrete::Hessian& hessian);
  HessianPreconditioner(HessianPreconditioner&&) = delete;

  operator PC() const { return pc_; }
  /// Returns the matrix that it is made from.
  Mat matrix();
  /// Makes `krylov` use it; its solves add to the lag.
  void attach(KSP krylov);

  /// Renews it at the Hessian's state if it is worn out.
  void renew_if_worn();
  /// Makes it at the Hessian's state, unless it was made there.
  void renew();
  /// Rebuilds it at the Hessian's state.
  void rebuild();
  /// Takes over the Hessian's present contact, where it is multigrid.
  void update_contact();

  /// Goes back to the state after construction.
  void reset();
  /// Returns the present state for restore(); null where it is not multigrid.
  std::shared_ptr<const KeptPreconditioner> keep() const;
  void restore(const KeptPreconditioner& kept);  ///< right after construction or reset()

  bool by_factors() const { return factors_ != nullptr; }  ///< the direct fallback is in use
  int64_t renewals() const { return renewals_; }

 private:
  static PetscErrorCode after_solve(KSP krylov, Vec rhs, Vec solution, void* me);
  static PetscErrorCode apply_columns(PC pc, Vec r, Vec z);
  void make();
  bool use_direct_fallback() const;
  void rebuild_columns();

  discrete::Positions& positions_;
  discrete::Hessian& hessian_;
  PcHandle pc_;
  std::shared_ptr<ColumnMultigrid> columns_;
  PcHandle factors_;  // in the place of columns_
  LagPolicy lag_;
  int64_t renewals_ = 0;
  int64_t made_at_ = -1, made_at_state_ = -1;  // assemblies and states at the last renewal
};

}  // namespace repose::linear
