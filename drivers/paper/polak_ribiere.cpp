#include "polak_ribiere.h"

#include <cmath>

#include "line_minimum.h"

namespace repose::paper {

using base::check;

namespace {

/// Moves `displacement` to the minimum along `direction`.
void minimize_along(discrete::Function& function, Vec direction, double tolerance, Vec displacement,
                    Vec trial) {
  const LineFunction value = [&](double step) {
    check(VecWAXPY(trial, step, direction, displacement));
    return function.evaluate(trial, nullptr);
  };
  const LineMinimum found = brent_minimum(value, bracket_minimum(value, 0, 1), tolerance);
  check(VecAXPY(displacement, found.place, direction));
}

}  // namespace

double dot(Vec x, Vec y) {
  PetscScalar product = 0;
  check(VecDot(x, y, &product));
  return product;
}

PolakRibiereOutcome polak_ribiere(discrete::Function& function, Vec displacement,
                                  const PolakRibiereSettings& settings) {
  const discrete::Positions& positions = function.positions();
  const base::VecHandle gradient = positions.make_vector(), residual = positions.make_vector(),
                        direction = positions.make_vector(), trial = positions.make_vector();
  PolakRibiereOutcome outcome;
  outcome.value = function.evaluate(displacement, gradient);
  check(VecAXPY(residual, -1, gradient));
  check(VecCopy(residual, direction));
  while (outcome.iterations < settings.max_iterations) {
    const double length = dot(residual, residual);
    if (length == 0) break;
    minimize_along(function, direction, settings.line_tolerance, displacement, trial);
    ++outcome.iterations;
    const double before = outcome.value;
    outcome.value = function.evaluate(displacement, gradient);
    const double scale = 0.5 * (std::abs(before) + std::abs(outcome.value)) + 1e-300;
    if (std::abs(before - outcome.value) <= settings.value_tolerance * scale) break;
    // γ = (g − g_old) · g / (g_old · g_old) with g = −∇Φ
    const double gamma = (dot(gradient, gradient) + dot(residual, gradient)) / length;
    check(VecAXPBY(residual, -1, 0, gradient));
    check(VecAYPX(direction, gamma, residual));
  }
  return outcome;
}

}  // namespace repose::paper
