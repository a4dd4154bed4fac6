#pragma once
#include "repose/discrete/function.h"

/// Integration of the equations of motion (Teschner, Girod & Girod 2000, Eqs. 2–5) with unit masses
///     x'' = F − c x',   F = −∇Φ,
/// from rest, by which tissue comes to its rest position the slow way. All functions collective.
namespace repose::paper {

struct Damping {
  double coefficient = 0;  ///< c
};

/// Semi-implicit Euler, v ← v + h (F − c v), x ← x + h v, at most `steps` steps of `step`. Changes
/// `displacement` in place. Returns whether values stayed finite. One force evaluation a step.
bool move_by_euler(discrete::Function& function, Vec displacement, Damping damping, double step,
                   int64_t steps);

struct RungeKuttaSettings {
  double tolerance = 0.1;   ///< mm, of each step
  double first_step = 0.1;  ///< s (unit masses: of √(kg mm/N))
  double duration = 1e300;  ///< ends there
};

/// Bogacki and Shampine's 3(2) pair (1989) with adaptive steps: the error of a step, the largest
/// block of e_x + h e_v, stays below the tolerance. Three force evaluations a step. Changes
/// `displacement` in place. Returns whether it reached the end of the duration; a step that
/// vanishes does not.
bool move_by_runge_kutta(discrete::Function& function, Vec displacement, Damping damping,
                         const RungeKuttaSettings& settings);

}  // namespace repose::paper
