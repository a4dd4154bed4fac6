#include "leave_saddle.h"

#include <algorithm>
#include <cmath>

#include "repose/base/error.h"
#include "repose/solve/stability.h"

namespace repose::solve {

using base::check;

bool leave_saddle(discrete::Function& function, linear::TangentSolver& solver, Vec displacement) {
  constexpr double way = 0.3, least = 1e-3, farthest = 10;  // mm
  const base::VecHandle mode = function.positions().make_vector(),
                        trial = function.positions().make_vector();
  const auto value_at = [&](double moved) {
    check(VecCopy(displacement, trial));
    check(VecAXPY(trial, moved, mode));
    return function.evaluate(trial, nullptr);
  };
  const double here = function.evaluate(displacement, nullptr);
  if (!(rough_smallest_eigenvalue(solver, displacement, mode) < 0)) return false;
  for (double share = way; share > least; share /= 3) {
    const double forth = value_at(share), back = value_at(-share);
    double lowest = std::min(forth, back);
    if (!(lowest < here)) continue;
    double best = forth < back ? share : -share;
    for (double next = 2 * best; std::abs(next) < farthest; next *= 2) {
      const double value = value_at(next);
      if (!(value < lowest)) break;
      lowest = value;
      best = next;
    }
    check(VecAXPY(displacement, best, mode));
    return true;
  }
  return false;
}

}  // namespace repose::solve
