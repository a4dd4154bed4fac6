#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "repose/mechanics/energy.h"
#include "repose/mechanics/hessian.h"

/// The kernels' results for a whole piece of tissue as one value, one vector and one matrix.
namespace repose::test {

inline std::vector<Vec3> moved(const std::vector<Vec3>& x, const std::vector<Vec3>& d, double h) {
  std::vector<Vec3> y = x;
  for (size_t i = 0; i < x.size(); ++i) y[i] += h * d[i];
  return y;
}

inline Eigen::VectorXd flattened(const std::vector<Vec3>& x) {
  return Eigen::Map<const Eigen::VectorXd>(x[0].data(), 3 * static_cast<int64_t>(x.size()));
}

struct ValueAndGradient {
  double value = 0;
  Eigen::VectorXd gradient;
};

inline ValueAndGradient evaluate(const mechanics::Loops& loops, const mechanics::Weights& weights,
                                 const std::vector<Vec3>& x) {
  ValueAndGradient result;
  std::vector<Vec3> gradient(x.size(), Vec3::Zero());
  for (const mechanics::SpringLoop& loop : loops.springs)
    result.value +=
        weights.elastic * mechanics::add_spring_gradient(loop, x, weights.elastic, gradient);
  result.value +=
      weights.elastic * mechanics::add_edge_gradient(loops.edges, x, weights.elastic, gradient);
  result.value += mechanics::add_volume_gradient(loops, x, weights, gradient);
  result.gradient = flattened(gradient);
  return result;
}

/// Adds the coupling of averaged volumes beyond prisms: Σ k g gᵀ.
inline void add_nodal_coupling(const mechanics::NodalVolumes& nodal,
                               const mechanics::Weights& weights, const std::vector<Vec3>& x,
                               Eigen::MatrixXd& matrix) {
  const auto points = static_cast<int64_t>(x.size());
  const auto rows = mechanics::nodal_gradients(nodal, points, x);
  for (int64_t p = 0; p < points; ++p) {
    Eigen::VectorXd g = Eigen::VectorXd::Zero(3 * points);
    for (size_t k = 0; k < rows[p].points.size(); ++k)
      g.segment<3>(3 * rows[p].points[k]) += rows[p].gradient[k];
    matrix += weights.volume_weight * nodal.stiffness[p] * g * g.transpose();
  }
}

/// The dense Hessian from the 3×3 blocks.
inline Eigen::MatrixXd assemble(const mechanics::Loops& loops, const mechanics::Weights& weights,
                                const std::vector<Vec3>& x, mechanics::Curvature curvature,
                                const std::vector<double>& slopes = {}) {
  const int64_t n = 3 * static_cast<int64_t>(x.size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n, n);
  const auto add = [&](int32_t i, int32_t j, const Mat3& block) {
    matrix.block<3, 3>(3 * i, 3 * j) += block;
  };
  for (const mechanics::SpringLoop& loop : loops.springs)
    mechanics::for_each_spring_block(loop, x, weights.elastic, curvature,
                                     [&](int64_t e, const Mat3& block) {
                                       const auto [i, j] = loop.points[e];
                                       add(i, i, block);
                                       add(j, j, block);
                                       add(i, j, -block);
                                       add(j, i, -block);
                                     });
  std::vector<double> max_slope = slopes;
  max_slope.resize(loops.prisms.size(), 0.0);
  const bool exact = curvature == mechanics::Curvature::exact;
  for (int64_t e = 0; e < loops.edges.size(); ++e) {
    const auto [i, j] = loops.edges.points[e];
    const Mat3 block = weights.elastic * loops.edges.weight[e] * Mat3::Identity();
    add(i, i, block);
    add(j, j, block);
    add(i, j, -block);
    add(j, i, -block);
  }
  if (exact && !loops.nodal.empty()) add_nodal_coupling(loops.nodal, weights, x, matrix);
  mechanics::for_each_prism_block(loops, x, weights, exact ? std::span<const double>() : max_slope,
                                  [&](int64_t e, const mechanics::PrismBlocks& blocks) {
                                    const auto& corner = loops.prisms.points[e];
                                    for (int i = 0; i < 6; ++i)
                                      for (int j = 0; j < 6; ++j)
                                        add(corner[i], corner[j], blocks[i][j]);
                                  });
  return matrix;
}

inline Eigen::VectorXd hessian_action(const mechanics::Loops& loops,
                                      const mechanics::Weights& weights, const std::vector<Vec3>& x,
                                      const std::vector<Vec3>& d) {
  std::vector<Vec3> product(x.size(), Vec3::Zero());
  mechanics::add_hessian_action(loops, x, weights, d, product,
                                mechanics::nodal_slopes(loops.nodal, x));
  return flattened(product);
}

}  // namespace repose::test
