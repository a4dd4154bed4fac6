#pragma once
#include <functional>

/// Minima of functions of one variable from their values alone (Brent 1973, Algorithms for
/// Minimization without Derivatives, ch. 5; bracketing and constants as in Numerical Recipes,
/// Press et al., 2nd ed. 1992, sec. 10.1 and 10.2).
namespace repose::paper {

using LineFunction = std::function<double(double)>;

/// Three places in order (ascending or descending), the middle one no higher than the others.
struct Bracket {
  double a = 0, b = 0, c = 0;
  double value_b = 0;
};

/// Goes downhill from `first` and `second` by golden-section and parabolic steps until the
/// function rises. A function that falls for `max_steps` steps gives the last three places.
Bracket bracket_minimum(const LineFunction& f, double first, double second);

struct LineMinimum {
  double place = 0, value = 0;
};

/// Brent's method: parabolic interpolation, golden section where it does not serve, until the place
/// is known to `tolerance` of itself.
LineMinimum brent_minimum(const LineFunction& f, const Bracket& bracket, double tolerance);

}  // namespace repose::paper
