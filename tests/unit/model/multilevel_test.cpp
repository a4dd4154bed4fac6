#include "model/multilevel.h"

#include <gtest/gtest.h>

#include <Eigen/IterativeLinearSolvers>

namespace repose::model {
namespace multilevel_test {

using Sparse = Multilevel::Sparse;

/// data + smoothing · (graph Laplacian of a square grid) of side × side vertices.
Sparse grid(int side, double data, double smoothing) {
  std::vector<Eigen::Triplet<double>> entries;
  const auto tie = [&](int p, int q) {
    for (const auto& [i, j] : {std::pair(p, q), std::pair(q, p)}) {
      entries.emplace_back(i, i, smoothing);
      entries.emplace_back(i, j, -smoothing);
    }
  };
  for (int v = 0; v < side * side; ++v) {
    entries.emplace_back(v, v, data);
    if (v % side + 1 < side) tie(v, v + 1);
    if (v + side < side * side) tie(v, v + side);
  }
  Sparse matrix(side * side, side * side);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

/// Conjugate-gradient iterations to 1e-6 for a right side of ones and minus ones.
int64_t iterations(const Sparse& matrix) {
  Eigen::ConjugateGradient<Sparse, Eigen::Lower | Eigen::Upper, Multilevel> solver(matrix);
  solver.setTolerance(1e-6);
  Eigen::VectorXd right(matrix.rows());
  for (int v = 0; v < right.size(); ++v) right[v] = v % 3 == 0 || v < right.size() / 2 ? 1 : -1;
  const Eigen::VectorXd x = solver.solve(right);
  EXPECT_LT((matrix * x - right).norm(), 2e-6 * right.norm());
  return solver.iterations();
}

TEST(Multilevel, needs_hardly_more_iterations_on_a_finer_grid) {
  const int64_t coarse = iterations(grid(50, 1, 100)), fine = iterations(grid(400, 1, 6400));
  EXPECT_LT(coarse, 30);
  EXPECT_LT(fine, 50);
}

TEST(Multilevel, is_symmetric) {
  const Sparse matrix = grid(60, 1, 50);
  Multilevel multilevel;
  multilevel.compute(matrix);
  const Eigen::VectorXd a = Eigen::VectorXd::LinSpaced(matrix.rows(), -1, 2),
                        b = a.array().cube().cos();
  EXPECT_NEAR(a.dot(multilevel.solve(b)), b.dot(multilevel.solve(a)), 1e-9);
}

TEST(Multilevel, solves_a_small_or_unconnected_matrix_at_once) {
  EXPECT_LE(iterations(grid(10, 1, 100)), 1);
  EXPECT_LE(iterations(grid(40, 2, 0)), 1);
}

}  // namespace multilevel_test
}  // namespace repose::model
