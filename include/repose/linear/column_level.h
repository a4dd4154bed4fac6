#pragma once
#include <compare>

#include "repose/base/geometry.h"
#include "repose/linear/sweep_order.h"

/// Matrices of layered tissue for preconditioners (column_multigrid.h).
namespace repose::linear {

/// The numbers of a point, and one of padding.
using Lanes = float __attribute__((vector_size(16)));

/// Where a point is in layered tissue.
struct Place {
  int32_t column;  ///< any number: successive points with the same one are a column's
  int32_t layer;
  auto operator<=>(const Place&) const = default;
};

/// A symmetric positive semidefinite matrix of 3×3 blocks, this rank's rows of it, and
/// Gauss–Seidel on it column by column: the points of a column, each coupled to those above and
/// below it, are solved for at once, in the order of sweep_order.h. Rows and columns of blocks have
/// local numbers: this rank's points, column by column from the top, then ghosts. Vectors are [own
/// points + ghosts].
class ColumnLevel {
 public:
  /// `place` [own]. The pattern couples points of a column to their neighbors in it only.
  ColumnLevel(IndexMap points, std::vector<Place> place, BlockPattern pattern);

  const IndexMap& points() const { return points_; }
  int32_t own() const { return points_.own(); }
  int32_t ghosts() const { return points_.ghosts(); }
  const std::vector<Place>& place() const { return place_; }
  const BlockPattern& pattern() const { return pattern_; }
  /// First points of this rank's columns, and own().
  const std::vector<int32_t>& columns() const { return columns_; }

  /// The block at this place of the pattern.
  const Eigen::Matrix3f& block(int64_t place) const { return numbers_.block[place]; }
  /// The place of the diagonal block of an own row, which those right of it follow.
  int64_t diagonal(int32_t row) const { return diagonal_[row]; }
  /// Sets all blocks to zero; add_upper() and then mirror_upper() set them again.
  void clear() { std::ranges::fill(numbers_.block, Eigen::Matrix3f::Zero()); }
  /// Adds to the block of an own row and a column not left of it, which is in the pattern.
  void add_upper(int32_t row, int32_t column, const Eigen::Matrix3f& block);
  /// Sets blocks that are no normal numbers to zero, and those left of the diagonal to mirror
  /// images.
  void mirror_upper();
  /// Adds to the block of two own points, and to its mirror image; it is in the pattern.
  void add(int32_t row, int32_t column, const Eigen::Matrix3f& block);
  /// Factors the columns' own blocks, after the entries have changed: all, or those of the given
  /// own points, ascending. Not collective.
  void factor();
  void factor(std::span<const int32_t> points);

  /// The values of the matrix and its factors, without the pattern.
  struct Numbers {
    std::vector<Eigen::Matrix3f> block;  ///< [blocks + 1]
    std::vector<float> lift;             ///< [own] added to the diagonal of the columns' blocks
    std::vector<float> inverse;          ///< [9 own + 1] factors of the columns' blocks
  };
  const Numbers& numbers() const { return numbers_; }
  void set_numbers(const Numbers& numbers) { numbers_ = numbers; }  ///< of the same pattern

  /// x = (L + D)⁻¹ b: a sweep in order from x = 0, D being the columns' blocks. Own points and
  /// ghosts. Collective.
  void forward(std::span<const Lanes> b, std::span<Lanes> x) const;
  /// r = b − A x for the x of forward(). Not collective.
  void residual_of_forward(std::span<const Lanes> b, std::span<const Lanes> x,
                           std::span<Lanes> r) const;
  /// A sweep in reverse order on A x = b, from an x whose ghosts are up to date, which are not
  /// afterwards. Collective.
  void backward(std::span<const Lanes> b, std::span<Lanes> x) const;
  /// Brings the ghosts of x up to date. Collective.
  void update_ghosts(std::span<Lanes> x) const {
    points_.share(x.data(), x.data() + own(), lanes_);
  }

 private:
  std::vector<int64_t> find_columns();
  void factor_column(int32_t column);
  /// Returns the end of an own row's blocks left of those of its column.
  int64_t left_end(int32_t column, int32_t row) const {
    return diagonal_[row] - (row > columns_[column] ? 1 : 0);
  }
  /// Returns the begin of an own row's blocks right of those of its column.
  int64_t right_begin(int32_t column, int32_t row) const {
    return diagonal_[row] + (row + 1 < columns_[column + 1] ? 2 : 1);
  }
  /// Σ of the blocks [k, end) of a row with x.
  Lanes row_product(int64_t k, int64_t end, std::span<const Lanes> x) const;
  void solve_column(int32_t column, std::span<Lanes> x) const;
  /// b − A x of an own row, but for the blocks of its own column.
  Lanes residual_around(int32_t column, int32_t row, std::span<const Lanes> b,
                        std::span<const Lanes> x) const;

  IndexMap points_;
  std::vector<Place> place_;
  BlockPattern pattern_;
  std::vector<int32_t> columns_;   // [columns + 1] first points
  std::vector<int64_t> diagonal_;  // [own] places of the diagonal blocks
  SweepOrder order_;
  Numbers numbers_;
  FloatsType lanes_{4};
};

}  // namespace repose::linear
