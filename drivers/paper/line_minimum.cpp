#include "line_minimum.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace repose::paper {

namespace {

constexpr double golden = 1.618033988749895;                   // a longer interval over a shorter
constexpr double golden_part = 2 - golden;                     // where it cuts the longer part
constexpr double furthest = 100;                               // parabolic step over the last one
constexpr double tiny_curvature = 1e-20, tiny_length = 1e-10;  // against division by zero
constexpr int max_steps = 100;

struct Point {
  double x = 0, value = 0;
};

/// Where the parabola through three points has its extremum.
double parabola_extremum(const Point& a, const Point& b, const Point& c) {
  const double r = (b.x - a.x) * (b.value - c.value);
  const double q = (b.x - c.x) * (b.value - a.value);
  const double bend = std::copysign(std::max(std::abs(q - r), tiny_curvature), q - r);
  return b.x - ((b.x - c.x) * q - (b.x - a.x) * r) / (2 * bend);
}

bool between(double x, double one, double other) { return (one - x) * (x - other) > 0; }

/// The three best places so far and the interval that holds the minimum.
struct Search {
  double low, high;
  Point best, second, third;
  double step = 0, step_before = 0;

  double middle() const { return 0.5 * (low + high); }

  /// The parabolic step, or, where it leaves the interval or does not shrink, the golden one.
  void choose_step(double accuracy) {
    const double before = std::exchange(step_before, step);
    if (std::abs(before) > accuracy) {
      const double r = (best.x - second.x) * (best.value - third.value);
      double q = (best.x - third.x) * (best.value - second.value);
      double p = (best.x - third.x) * q - (best.x - second.x) * r;
      q = 2 * (q - r);
      if (q > 0) p = -p;
      q = std::abs(q);
      const bool shrinks = std::abs(p) < std::abs(0.5 * q * before);
      if (shrinks && p > q * (low - best.x) && p < q * (high - best.x)) {
        step = p / q;
        const double place = best.x + step;
        if (place - low < 2 * accuracy || high - place < 2 * accuracy)
          step = std::copysign(accuracy, middle() - best.x);
        return;
      }
    }
    step_before = (best.x >= middle() ? low : high) - best.x;
    step = golden_part * step_before;
  }

  void take(const Point& tried) {
    if (tried.value <= best.value) {
      (tried.x >= best.x ? low : high) = best.x;
      third = std::exchange(second, std::exchange(best, tried));
      return;
    }
    (tried.x < best.x ? low : high) = tried.x;
    if (tried.value <= second.value || second.x == best.x)
      third = std::exchange(second, tried);
    else if (tried.value <= third.value || third.x == best.x || third.x == second.x)
      third = tried;
  }
};

}  // namespace

Bracket bracket_minimum(const LineFunction& f, double first, double second) {
  const auto at = [&](double x) { return Point{x, f(x)}; };
  Point a = at(first), b = at(second);
  if (b.value > a.value) std::swap(a, b);
  Point c = at(b.x + golden * (b.x - a.x));
  for (int step = 0; b.value > c.value && step < max_steps; ++step) {
    const double limit = b.x + furthest * (c.x - b.x);
    double x = parabola_extremum(a, b, c);
    if (between(x, b.x, c.x)) {
      const Point u = at(x);
      if (u.value < c.value) return {b.x, u.x, c.x, u.value};
      if (u.value > b.value) return {a.x, b.x, u.x, b.value};
      x = c.x + golden * (c.x - b.x);
    } else if (between(limit, c.x, x)) {
      x = limit;
    } else if (!between(x, c.x, limit)) {
      x = c.x + golden * (c.x - b.x);
    }
    a = std::exchange(b, std::exchange(c, at(x)));
  }
  return {a.x, b.x, c.x, b.value};
}

LineMinimum brent_minimum(const LineFunction& f, const Bracket& bracket, double tolerance) {
  Search s{std::min(bracket.a, bracket.c), std::max(bracket.a, bracket.c), {}, {}, {}};
  s.best = s.second = s.third = {bracket.b, bracket.value_b};
  for (int step = 0; step < max_steps; ++step) {
    const double accuracy = tolerance * std::abs(s.best.x) + tiny_length;
    if (std::abs(s.best.x - s.middle()) <= 2 * accuracy - 0.5 * (s.high - s.low)) break;
    s.choose_step(accuracy);
    const double moved = std::abs(s.step) >= accuracy ? s.step : std::copysign(accuracy, s.step);
    const double x = s.best.x + moved;
    s.take({x, f(x)});
  }
  return {s.best.x, s.best.value};
}

}  // namespace repose::paper
