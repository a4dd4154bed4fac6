#pragma once
#include <span>

#include "repose/linear/index_map.h"

namespace repose::linear {

/// Nonzero blocks of a matrix, in compressed rows.
struct BlockPattern {
  std::vector<int64_t> begin{0};  ///< [rows + 1]
  std::vector<int32_t> column;    ///< ascending in each row
  /// Returns the place of a block, or that of the next one where there is none.
  int64_t find(int32_t i, int32_t j) const {
    const auto first = column.begin();
    return std::lower_bound(first + begin[i], first + begin[i + 1], j) - first;
  }
};

/// Order of Gauss–Seidel sweeps over columns of points that makes them sweeps of one matrix,
/// whatever the number of ranks: first the columns at borders between ranks, neighboring ranks in
/// turn, then all others at once (Adams 2001, "A distributed memory unstructured Gauss–Seidel
/// algorithm for multigrid smoothers").
class SweepOrder {
 public:
  /// `begin` [columns + 1]: first points of this rank's columns, and their number. Not collective.
  SweepOrder(const IndexMap& points, const BlockPattern& pattern, std::span<const int32_t> begin);

  /// Returns whether a column is at the border, or coupled to one that is.
  bool beside_border(int32_t column) const { return beside_border_[column] != 0; }
  /// Calls sweep(column) for this rank's columns in order, or in reverse order, and update_ghosts()
  /// between the turns of ranks. Collective.
  template <class Sweep, class UpdateGhosts>
  void forward(Sweep&& sweep, UpdateGhosts&& update_ghosts) const {
    for (int turn = 0; turn < turns_; ++turn) {
      if (turn == turn_) std::for_each(order_.begin(), order_.begin() + border_, sweep);
      update_ghosts();
    }
    std::for_each(order_.begin() + border_, order_.end(), sweep);
  }
  template <class Sweep, class UpdateGhosts>
  void backward(Sweep&& sweep, UpdateGhosts&& update_ghosts) const {
    std::for_each(order_.rbegin(), order_.rend() - border_, sweep);
    for (int turn = turns_; turn-- > 0;) {
      if (turn == turn_) std::for_each(order_.rend() - border_, order_.rend(), sweep);
      if (turn > 0) update_ghosts();
    }
  }

 private:
  std::vector<int32_t> order_;       // columns, those at the border first
  std::ptrdiff_t border_;            // number of those at the border
  std::vector<char> beside_border_;  // [columns]
  int turn_, turns_;                 // of this rank, and of all
};

}  // namespace repose::linear
