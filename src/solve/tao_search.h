#pragma once
#include <petsctao.h>

#include <functional>
#include <memory>

#include "initial_hessian.h"
#include "stopping_test.h"

namespace repose::solve {

using TaoHandle = base::Handle<Tao, TaoDestroy>;

/// Iterate of TAO's, from the first state on.
struct TaoIterate {
  int64_t number;  ///< since the search began
  double value;
  StoppingTest::Iterate state;
};

/// TAO's minimization of a function, by the method given or what `-tao_type` chooses, with the
/// forcing terms of its linear systems and the renewals of the initial Hessian of limited-memory
/// BFGS. All members collective.
class TaoSearch {
 public:
  TaoSearch(discrete::Function& function, linear::TangentSolver& solver, TaoType type);
  TaoSearch(TaoSearch&&) = delete;

  /// Returns whether the search ends at an iterate; the same on all ranks.
  using Ends = std::function<bool(const TaoIterate&)>;
  /// Minimizes from `displacement`, in place. Returns the iterations. What the function or `ends`
  /// throws is thrown again.
  int64_t run(Vec displacement, Ends ends);

  Method method() const;
  static bool is_chosen();     ///< the method, by `-tao_type`
  std::string reason() const;  ///< why the latest search ended

 private:
  struct Callbacks;
  void make_forcing();
  void set_forcing();
  bool step_was_cut() const;
  bool should_restart(int64_t iterations) const;

  discrete::Function& function_;
  linear::TangentSolver& solver_;
  TaoHandle tao_;
  std::unique_ptr<InitialHessian> initial_;    // of limited-memory BFGS, where it is requested
  bool sets_forcing_ = false;                  // of Newton's linear systems; else an option does
  double first_force_ = 0, latest_force_ = 0;  // N, largest block of ∇Φ at these iterates
  bool slowed_ = false;                        // the initial Hessian is to be renewed
  int64_t before_ = 0;                         // iterations before TAO's present ones
  Ends ends_;
  base::VecHandle gradient_;  // where the value alone is requested
};

}  // namespace repose::solve
