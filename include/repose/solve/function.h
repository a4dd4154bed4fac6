#pragma once
#include "repose/solve/positions.h"

namespace repose::solve {

/// A function of the displacements of the unknowns that a solver minimises.
class Function {
 public:
  explicit Function(Positions& positions) : positions_(positions) {}
  Function(const Function&) = delete;
  Function& operator=(const Function&) = delete;
  virtual ~Function() = default;

  /// Φ at `displacement` and, if `gradient` is not null, ∇Φ. A value that overflows comes back as
  /// a large finite number so that a line search can retreat from it. Collective.
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

/// A function's second derivatives as matrices of 3×3 blocks: the exact ones (or what stands for
/// them), which act, and a positive definite relative from which a preconditioner is made. The
/// relative may stay behind: it is brought to the state only by renew().
class Hessian {
 public:
  Hessian() = default;
  Hessian(const Hessian&) = delete;
  Hessian& operator=(const Hessian&) = delete;
  virtual ~Hessian() = default;

  /// Goes to `displacement`; may do nothing where it is already. Collective.
  virtual void assemble(Vec displacement) = 0;
  /// Brings convex() to the state of the last assemble(). Collective.
  virtual void renew() {}
  virtual Mat exact() = 0;  ///< its entries; collective
  virtual Mat convex() const = 0;
  /// What acts as exact(), with or without entries.
  virtual Mat action() { return exact(); }
  /// The one whose quadratic model a Newton method steps by.
  virtual Mat model() { return action(); }
  /// Whether multigrid can precondition it: it couples neighbours as elasticity does.
  virtual bool elliptic() const { return true; }
  int64_t assemblies() const { return assemblies_; }

 protected:
  int64_t assemblies_ = 0;
};

}  // namespace repose::solve
