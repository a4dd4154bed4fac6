#pragma once
#include <petscsf.h>

#include <cstdint>
#include <span>
#include <vector>

#include "repose/base/geometry.h"
#include "repose/base/petsc.h"

/// Matrices of layered tissue in single precision, for preconditioners (column_multigrid.h).
namespace repose::solve {

/// The numbers of a point, and one of padding.
using Lanes = float __attribute__((vector_size(16)));

/// `count` floats, or as many bytes of anything, as one thing to send.
class FloatsType {
 public:
  explicit FloatsType(int count);
  ~FloatsType() { MPI_Type_free(&type_); }
  FloatsType(const FloatsType&) = delete;
  FloatsType& operator=(const FloatsType&) = delete;
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
class ColumnLevel {
 public:
  /// `place` of this rank's points; `ghost`: global numbers (rank after rank) of the ghosts. The
  /// pattern couples points of a column to their neighbours in it only. Collective.
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

  /// The entries of the block at this place of the pattern, column by column.
  float* block(int64_t place) { return value_.data() + 9 * place; }
  const float* block(int64_t place) const { return value_.data() + 9 * place; }
  void clear();
  /// Adds to the block of an own row and a column, which is in the pattern.
  void add(int32_t row, int32_t column, const Mat3& block);
  /// Takes what is right of the diagonal over to what is left of it. Not collective.
  void mirror();
  /// Factors the columns' own blocks, after the entries have changed. Not collective.
  void factor();

  /// x = (L + D)⁻¹ b: a sweep down the numbers from x = 0. D: the columns' blocks, and what keeps
  /// sweeps convergent although ranks sweep at once: half of the norms of the blocks of ghosts on
  /// the diagonal (Baker, Falgout, Kolev & Yang 2011). Own points.
  void forward(std::span<const Lanes> b, std::span<Lanes> x) const;
  /// r = b − A x for the x of forward(), whose ghosts are up to date.
  void residual_of_forward(std::span<const Lanes> x, std::span<Lanes> r) const;
  /// A sweep up the numbers on A x = b, ghosts fixed.
  void backward(std::span<const Lanes> b, std::span<Lanes> x) const;
  /// Brings the ghosts of x up to date. Collective.
  void update_ghosts(std::span<Lanes> x) const { share(x.data(), x.data() + own(), lanes_); }
  /// Sends each own entry to the ranks where it is a ghost; entries of type `unit`. Collective.
  void share(const void* own_entries, void* ghost_entries, MPI_Datatype unit) const;

 private:
  using StarForest = base::Handle<PetscSF, PetscSFDestroy>;
  void damp();
  void find_columns();
  void connect(MPI_Comm comm);
  void solve_column(int32_t begin, int32_t end, std::span<Lanes> x) const;

  std::vector<Place> place_;
  std::vector<int64_t> ghost_;
  int64_t first_ = 0, total_ = 0;
  BlockPattern pattern_;
  std::vector<int32_t> chain_;          // [columns + 1] first points
  std::vector<int32_t> left_, within_;  // [own] blocks left of the column's, and of it
  std::vector<float> value_;            // [9 blocks + 1]
  std::vector<float> damping_;          // [own] added to the columns' blocks
  std::vector<float> inverse_;          // [9 own + 1] of what elimination down columns leaves
  StarForest forest_;
  FloatsType lanes_{4};
};

}  // namespace repose::solve
