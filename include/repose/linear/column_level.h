#pragma once
#include <petscsf.h>

#include <cstdint>
#include <span>
#include <vector>

#include "repose/base/geometry.h"
#include "repose/base/petsc.h"

/// Matrices of layered tissue for preconditioners (column_multigrid.h).
namespace repose::linear {

class UpperSums;

/// The numbers of a point, and one of padding.
using Lanes = float __attribute__((vector_size(16)));

/// `count` floats, or as many bytes of anything, as one thing to send.
class FloatsType {
 public:
  explicit FloatsType(int count);
  ~FloatsType() { MPI_Type_free(&type_); }
  FloatsType(FloatsType&&) = delete;
  operator MPI_Datatype() const { return type_; }

 private:
  MPI_Datatype type_;
};

/// Where a point is in layered tissue.
struct Place {
  int32_t column;  ///< any number: successive points with the same one are a column's
  int32_t layer;
};

/// Which blocks of a matrix are not zero, in compressed rows.
struct BlockPattern {
  std::vector<int64_t> begin{0};  ///< [rows + 1]
  std::vector<int32_t> column;    ///< ascending in each row
  int32_t rows() const { return static_cast<int32_t>(begin.size() - 1); }
};

/// A symmetric positive semidefinite matrix of 3×3 blocks, this rank's rows of it, and
/// Gauss–Seidel on it column by column: the points of a column, each coupled to those above and
/// below it, are solved for at once. Rows and columns of blocks have local numbers: this rank's
/// points, column by column from the top, then ghosts. Vectors are [own points + ghosts].
///
/// Sweeps are those of one matrix, whatever the number of ranks: first the columns at borders
/// between ranks, neighboring ranks in turn, then all others at once (Adams 2001, "A distributed
/// memory unstructured Gauss–Seidel algorithm for multigrid smoothers").
class ColumnLevel {
 public:
  /// `place` of this rank's points; `ghost`: global numbers (rank after rank) of the ghosts. The
  /// pattern couples points of a column to their neighbors in it only. Collective.
  ColumnLevel(MPI_Comm comm, std::vector<Place> place, std::vector<int64_t> ghost,
              BlockPattern pattern);

  int32_t own() const { return static_cast<int32_t>(place_.size()); }
  int32_t ghosts() const { return static_cast<int32_t>(ghost_.size()); }
  int64_t first() const { return first_; }  ///< global number of this rank's first point
  int64_t total() const { return total_; }  ///< points of all ranks
  int64_t global(int32_t number) const {    ///< of an own point or a ghost
    return number < own() ? first_ + number : ghost_[number - own()];
  }
  const std::vector<Place>& place() const { return place_; }
  const BlockPattern& pattern() const { return pattern_; }
  /// First points of this rank's columns, and own().
  const std::vector<int32_t>& columns() const { return chain_; }

  /// The block at this place of the pattern.
  const Eigen::Matrix3f& block(int64_t place) const { return numbers_.block[place]; }
  /// The place of the diagonal block of an own row, which those right of it follow.
  int64_t diagonal(int32_t row) const { return pattern_.begin[row] + diagonal_[row]; }
  /// Sets all blocks again; those left of the diagonal are mirror images. Not collective.
  void fill(const UpperSums& sums);
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
  void update_ghosts(std::span<Lanes> x) const { share(x.data(), x.data() + own(), lanes_); }
  /// Sends each own entry to the ranks where it is a ghost; entries of type `unit`. Collective.
  void share(const void* own_entries, void* ghost_entries, MPI_Datatype unit) const;

 private:
  using StarForest = base::Handle<PetscSF, PetscSFDestroy>;
  void factor_column(size_t column);
  /// Σ of the blocks [k, end) of a row with x.
  Lanes row_product(int64_t k, int64_t end, std::span<const Lanes> x) const;
  void solve_column(int64_t column, std::span<Lanes> x) const;
  /// b − A x of an own row, but for the blocks of its own column.
  Lanes residual_around(int32_t i, std::span<const Lanes> b, std::span<const Lanes> x) const;
  void backward_column(size_t column, std::span<const Lanes> b, std::span<Lanes> x) const;
  void find_columns();
  void connect(MPI_Comm comm);
  void find_border();

  std::vector<Place> place_;
  std::vector<int64_t> ghost_;
  int64_t first_ = 0, total_ = 0;
  BlockPattern pattern_;
  std::vector<int32_t> chain_;            // [columns + 1] first points
  std::vector<int32_t> left_, within_;    // [own] blocks left of the column's, and of it
  std::vector<int32_t> diagonal_;         // [own] blocks left of the diagonal
  std::vector<size_t> border_;            // columns coupled to ghosts, the last first
  std::vector<char> is_border_, beside_;  // [columns] of the border, or coupled to a column of it
  int turn_ = 0, turns_ = 1;              // of this rank among its neighbors, and of all
  Numbers numbers_;
  StarForest forest_;
  FloatsType lanes_{4};
};

/// Sums of a level's blocks on the diagonal and right of it, from which it is filled.
class UpperSums {
 public:
  explicit UpperSums(const ColumnLevel& level);
  /// To the block of an own row and a column not left of it, which is in the pattern.
  void add(int32_t row, int32_t column, const Eigen::Matrix3f& block);
  /// Returns the blocks of a row from the diagonal on.
  std::span<const Eigen::Matrix3f> row(int32_t i) const {
    return std::span(sum_).subspan(begin_[i], begin_[i + 1] - begin_[i]);
  }

 private:
  const ColumnLevel& level_;
  std::vector<int64_t> begin_;  // [own + 1] in blocks
  std::vector<Eigen::Matrix3f> sum_;
};

}  // namespace repose::linear
