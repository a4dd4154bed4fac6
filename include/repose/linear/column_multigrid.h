#pragma once
#include <array>
#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "repose/discrete/function.h"
#include "repose/linear/column_coarsening.h"

namespace repose::linear {

/// Gives a visitor all blocks of a symmetric matrix that touch this rank's points.
using BlockSource = std::function<void(const discrete::BlockVisitor&)>;

/// Preconditioner for layered tissue: multigrid by semicoarsening along the skin
/// (column_coarsening.h), sweeps of Gauss–Seidel by columns down and up on each level
/// (column_level.h): one each on the finest, two on the others. Factors of the coarsest. In single
/// precision and without units: the matrix is scaled to a largest diagonal of about 1. Where the
/// model is a graph without layers, each point is its own column.
class ColumnMultigrid {
 public:
  /// For the unknown points of `part`. Collective.
  ColumnMultigrid(MPI_Comm comm, const discrete::Part& part, const BlockSource& blocks);
  ~ColumnMultigrid();

  /// Takes the numbers of the matrix again; no block may be where there was none. Collective.
  void refill(const BlockSource& blocks);
  /// Adds blocks of own points, in place of those that the last call since refill() added: on each
  /// level only what they change. Collective.
  void set_extra(const BlockSource& blocks);
  /// The values on all levels, for set_numbers() to restore. Not collective.
  struct Numbers;
  std::shared_ptr<const Numbers> numbers() const;
  void set_numbers(const Numbers& numbers);
  /// z ≈ A⁻¹ r, a symmetric positive definite map; both of 3 unknowns a point. Collective.
  void apply(Vec r, Vec z);

 private:
  struct Level;
  class Coarsest;
  void make_fine(const discrete::Part& part, const BlockSource& blocks);
  void fill_fine(const BlockSource& blocks);
  void factor();
  void cycle(size_t level);

  MPI_Comm comm_;
  std::vector<int32_t> number_;  // [local points] among unknown points, own first; −1 if fixed
  double scale_ = 1;             // what is kept is A / scale
  std::unique_ptr<ColumnLevel> fine_;
  std::vector<std::unique_ptr<Coarsening>> coarsening_;
  std::vector<Level> levels_;  // finest first
  std::unique_ptr<Coarsest> coarsest_;
  using Extra = std::map<std::array<int32_t, 2>, Eigen::Matrix3f>;
  Extra extra_;  // by own numbers, ascending
};

}  // namespace repose::linear
