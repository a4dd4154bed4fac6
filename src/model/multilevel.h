#pragma once
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <vector>

namespace repose::model {

/// Preconditioner of a matrix diag(d) + (graph Laplacian), d ≥ 0, for Eigen's conjugate gradients:
/// one V-cycle over ever coarser graphs, whose vertices are a vertex with its neighbors on the
/// finer one (plain aggregation), with Gauss–Seidel forwards on the way down and backwards on the
/// way up, so that it is symmetric positive definite. Sums over aggregates make a Laplacian too
/// stiff; the coarse one is halved (Braess, "Towards algebraic multigrid for elliptic problems of
/// second order", Computing 55, 1995). Iterations hardly depend on the number of rows; work and
/// memory are in proportion to the entries.
class Multilevel {
 public:
  using Sparse = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  Multilevel& compute(const Sparse& matrix);
  Eigen::VectorXd solve(const Eigen::VectorXd& right) const { return cycle(0, right); }
  Eigen::ComputationInfo info() const { return coarsest_.info(); }

 private:
  struct Level {
    Sparse matrix;
    std::vector<int> aggregate;  // [rows] row of the next coarser level
    int aggregates;
  };
  Eigen::VectorXd cycle(size_t level, const Eigen::VectorXd& right) const;

  std::vector<Level> levels_;  // finest first, without the coarsest
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> coarsest_;
};

}  // namespace repose::model
