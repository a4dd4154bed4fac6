#pragma once
#include <functional>

#include "repose/discrete/positions.h"

namespace repose::discrete {

constexpr double overflown = 1e100;  ///< stands for a value that is more, or none

/// Refuses a state at a load, `what` of which overflow, saying what to check.
[[noreturn]] void refuse_overflow(const char* what, double load);

/// A function of the displacements of the unknowns that a solver minimizes.
class Function {
 public:
  explicit Function(Positions& positions) : positions_(positions) {}
  Function(Function&&) = delete;
  virtual ~Function() = default;

  /// Φ at `displacement` and, if `gradient` is not null, ∇Φ. A value that overflows comes back as
  /// `overflown`, so that a line search can retreat from it. Collective.
  double evaluate(Vec displacement, Vec gradient) {
    ++evaluations_;
    return value_and_gradient(displacement, gradient);
  }
  int64_t evaluations() const { return evaluations_; }
  Positions& positions() const { return positions_; }

 protected:
  virtual double value_and_gradient(Vec displacement, Vec gradient) = 0;

  Positions& positions_;

 private:
  int64_t evaluations_ = 0;
};

/// Takes a block B of a symmetric matrix: of local points p and q; where p ≠ q, Bᵀ is that of q and
/// p. Blocks of the same points add up.
using BlockVisitor = std::function<void(int32_t p, int32_t q, const Mat3& block)>;

/// A function's second derivatives as matrices of 3×3 blocks: the exact ones (or what stands for
/// them), which act, and a positive definite relative from which a preconditioner is made.
class Hessian {
 public:
  Hessian() = default;
  Hessian(Hessian&&) = delete;
  virtual ~Hessian() = default;

  /// Goes to `displacement`; may do nothing where it is already. Collective.
  virtual void assemble(Vec displacement) = 0;
  virtual Mat exact() = 0;  ///< its entries, at the state of the last assemble(); collective
  /// The entries of the relative, which may stay behind: renew() brings them to the state of the
  /// last assemble(). Collective.
  virtual Mat spd_approximation() = 0;
  virtual void renew() {}
  /// Returns an operator that acts as exact(), with or without entries.
  virtual Mat action() { return exact(); }
  /// The one whose quadratic model a Newton method steps by.
  virtual Mat model() { return action(); }
  /// Returns whether multigrid can precondition it: it couples neighbors as elasticity does, and
  /// its relative can be visited.
  virtual bool elliptic() const { return true; }
  /// Shows all blocks of the relative that touch this rank's points, at the state of the last
  /// assemble(), but for those of contact, which change more often. Not collective.
  virtual void visit_spd_blocks(const BlockVisitor&) const {}
  /// Shows those of contact, where visit_spd_blocks couples points. Not collective.
  virtual void visit_contact_blocks(const BlockVisitor&) const {}
  int64_t assemblies() const { return assemblies_; }
  /// Returns the assemblies at a new displacement or load; at others contact alone changed.
  int64_t states() const { return states_; }

 protected:
  int64_t assemblies_ = 0, states_ = 0;
};

}  // namespace repose::discrete
