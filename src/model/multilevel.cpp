#include "multilevel.h"

namespace repose::model {
namespace {

using Sparse = Multilevel::Sparse;

constexpr int solved_directly = 500;  // rows
constexpr double coarse_stiffness = 0.5;

/// The aggregate of the neighbor a row is tied to most, −1 where none has one.
int strongest(const Sparse& matrix, const std::vector<int>& aggregate, int row) {
  int best = -1;
  double strength = 0;
  for (Sparse::InnerIterator it(matrix, row); it; ++it) {
    if (it.col() == row || aggregate[it.col()] < 0 || -it.value() <= strength) continue;
    best = aggregate[it.col()];
    strength = -it.value();
  }
  return best;
}

/// Shares all rows out to aggregates and returns their number: first each row none of whose
/// neighbors is taken, with all of them, then the rows left over.
int make_aggregates(const Sparse& matrix, std::vector<int>& aggregate) {
  const auto rows = static_cast<int>(matrix.rows());
  aggregate.assign(rows, -1);
  int count = 0;
  for (int row = 0; row < rows; ++row) {
    bool taken = false;
    for (Sparse::InnerIterator it(matrix, row); it; ++it) taken |= aggregate[it.col()] >= 0;
    if (taken) continue;
    for (Sparse::InnerIterator it(matrix, row); it; ++it) aggregate[it.col()] = count;
    ++count;
  }
  const std::vector<int> first = aggregate;
  for (int row = 0; row < rows; ++row) {
    if (first[row] >= 0) continue;
    const int joined = strongest(matrix, first, row);
    aggregate[row] = joined >= 0 ? joined : count++;
  }
  return count;
}

/// Sums over aggregates, the entries between them times coarse_stiffness; sums of rows are kept.
Sparse coarser(const Sparse& matrix, const std::vector<int>& aggregate, int count) {
  std::vector<Eigen::Triplet<double>> entries;
  std::vector<double> diagonal(count, 0.0);
  for (int row = 0; row < matrix.rows(); ++row)
    for (Sparse::InnerIterator it(matrix, row); it; ++it) {
      const int a = aggregate[row], b = aggregate[it.col()];
      const double between = a == b ? 0 : coarse_stiffness * it.value();
      diagonal[a] += it.value() - between;
      if (a != b) entries.emplace_back(a, b, between);
    }
  for (int a = 0; a < count; ++a) entries.emplace_back(a, a, diagonal[a]);
  Sparse coarse(count, count);
  coarse.setFromTriplets(entries.begin(), entries.end());
  return coarse;
}

/// One Gauss–Seidel step of a row.
void relax(const Sparse& matrix, const Eigen::VectorXd& right, int row, Eigen::VectorXd& x) {
  double sum = right[row], diagonal = 0;
  for (Sparse::InnerIterator it(matrix, row); it; ++it)
    if (it.col() == row)
      diagonal = it.value();
    else
      sum -= it.value() * x[it.col()];
  x[row] = sum / diagonal;
}

}  // namespace

Multilevel& Multilevel::compute(const Sparse& matrix) {
  levels_.clear();
  Sparse current = matrix;
  while (current.rows() > solved_directly) {
    Level level;
    level.aggregates = make_aggregates(current, level.aggregate);
    if (level.aggregates == current.rows()) break;
    Sparse next = coarser(current, level.aggregate, level.aggregates);
    level.matrix.swap(current);
    levels_.push_back(std::move(level));
    current.swap(next);
  }
  coarsest_.compute(current);
  return *this;
}

Eigen::VectorXd Multilevel::cycle(size_t depth, const Eigen::VectorXd& right) const {
  if (depth == levels_.size()) return coarsest_.solve(right);
  const Level& level = levels_[depth];
  const auto rows = static_cast<int>(level.matrix.rows());
  Eigen::VectorXd x = Eigen::VectorXd::Zero(rows);
  for (int row = 0; row < rows; ++row) relax(level.matrix, right, row, x);
  const Eigen::VectorXd residual = right - level.matrix * x;
  Eigen::VectorXd coarse = Eigen::VectorXd::Zero(level.aggregates);
  for (int row = 0; row < rows; ++row) coarse[level.aggregate[row]] += residual[row];
  coarse = cycle(depth + 1, coarse);
  for (int row = 0; row < rows; ++row) x[row] += coarse[level.aggregate[row]];
  for (int row = rows - 1; row >= 0; --row) relax(level.matrix, right, row, x);
  return x;
}

}  // namespace repose::model
