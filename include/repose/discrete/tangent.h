#pragma once
#include <memory>

#include "repose/discrete/hessian_action.h"
#include "repose/discrete/tangent_entries.h"

namespace repose::discrete {

/// The Hessian of an objective: the exact one acts without entries; the convex one, from which a
/// positive definite preconditioner is made, is given block by block. Matrices of either are made
/// only where they are requested.
class Tangent : public Hessian {
 public:
  explicit Tangent(Objective& objective) : objective_(objective), action_(objective) {}

  /// Nothing is done if `displacement` is the state it is at, and nothing has changed since.
  void assemble(Vec displacement) override;
  /// The next assembly is done in any case: the elements have changed.
  void invalidate() { state_changed_ = true; }
  /// The next assembly takes the objective's contact as it is then.
  void forget_contact() { contact_changed_ = true; }
  /// Returns the objective's contact, to be changed: the next assembly takes it as it is then.
  Contact& change_contact() {
    forget_contact();
    return objective_.contact();
  }

  /// Takes these blocks, exact and of the semidefinite relative, in place of the objective's
  /// contact until the state changes.
  void set_contact(std::vector<Objective::Block> exact, std::vector<Objective::Block> convex);

  bool limit_slopes(bool limited) { return action_.limit_slopes(limited); }

  base::MatHandle make_third();  ///< a matrix for third(); collective
  /// The springs' third derivative on `direction` [local points]: ∂(H d)/∂x at the positions' last
  /// update, into `matrix` of make_third(). Collective.
  void third(std::span<const Vec3> direction, Mat matrix);

  Mat exact() override;
  Mat spd_approximation() override;
  void renew() override;
  Mat action() override { return action_.matrix(); }
  void visit_spd_blocks(const BlockVisitor& visit) const override;
  void visit_contact_blocks(const BlockVisitor& visit) const override;

 private:
  const TangentEntries& entries();
  base::MatHandle nodal_coupling() const;
  void lift_diagonal();
  bool level(int32_t p, int32_t q) const;
  void visit_level(std::span<const Objective::Block> blocks, const BlockVisitor& visit) const;

  Objective& objective_;
  HessianAction action_;
  std::unique_ptr<TangentEntries> entries_;
  base::MatHandle exact_, spd_;
  base::MatHandle coupled_;  // exact_ and what averaged volumes couple
  std::vector<Objective::Block> convex_terms_, convex_contact_;  // of the relative
  bool state_changed_ = true, contact_changed_ = true;
  int64_t filled_at_ = -1;  // assemblies() when exact_ was filled
};

}  // namespace repose::discrete
