#pragma once
#include <Eigen/Core>
#include <array>
#include <unsupported/Eigen/AutoDiff>

#include "repose/base/geometry.h"

/// Automatic differentiation of a function of a few points, as an oracle for analytic derivatives.
namespace repose::test {

template <int points>
struct Expansion {
  static constexpr int n = 3 * points;
  double value;
  Eigen::Matrix<double, n, 1> gradient;
  Eigen::Matrix<double, n, n> hessian;
};

template <class S, int points>
using Corners = std::array<Eigen::Matrix<S, 3, 1>, points>;

/// Value, gradient and Hessian of `function`, called with Corners of a dual number of duals.
template <int points, class Function>
Expansion<points> differentiate(const std::array<Vec3, points>& at, Function&& function) {
  constexpr int n = 3 * points;
  using First = Eigen::AutoDiffScalar<Eigen::Matrix<double, n, 1>>;
  using Second = Eigen::AutoDiffScalar<Eigen::Matrix<First, n, 1>>;
  Corners<Second, points> x;
  for (int k = 0; k < n; ++k) {
    Second& coordinate = x[k / 3][k % 3];
    coordinate.value() = First(at[k / 3][k % 3], n, k);
    for (int l = 0; l < n; ++l) coordinate.derivatives()[l] = First(l == k ? 1.0 : 0.0);
  }
  const Second result = function(x);
  Expansion<points> expansion;
  expansion.value = result.value().value();
  expansion.gradient = result.value().derivatives();
  for (int l = 0; l < n; ++l) expansion.hessian.col(l) = result.derivatives()[l].derivatives();
  return expansion;
}

}  // namespace repose::test
