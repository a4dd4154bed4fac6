#pragma once
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "repose/discrete/part.h"

namespace repose::discrete {

/// Assignment of a model's points, or of those of a piece, to ranks and unknowns.
struct Distribution {
  const model::Model& model;         ///< of which rows are meant
  std::vector<int> owner;            ///< [N] rank of each point
  std::vector<int64_t> place;        ///< [N] of each point, rank after rank, column after column
  std::vector<int64_t> unknown;      ///< [N] block number or −1
  std::vector<model::PointSet> set;  ///< [N] with points of non-rigid bones as held
  std::vector<Mat4> bone_transform;  ///< [bones]
  std::vector<mechanics::RigidBody> bodies;
  std::vector<double> contact_offset;  ///< [touches] mm
  int64_t total_points = 0, total_unknowns = 0;
};

/// Points owned by one rank.
struct OwnedRange {
  int rank;
  std::span<const int64_t> points;  ///< rows, by their places
  int64_t first_unknown, unknowns;
};

/// Gives local numbers to rows as they are met, owned points first.
class LocalNumbers {
 public:
  explicit LocalNumbers(int64_t rows) : local_(rows, -1) {}
  int64_t of(int64_t row) {
    if (local_[row] < 0) {
      local_[row] = static_cast<int64_t>(rows_.size());
      rows_.push_back(row);
    }
    return local_[row];
  }
  /// Forgets all, in time proportional to what was met.
  std::vector<int64_t> release() {
    for (int64_t row : rows_) local_[row] = -1;
    return std::exchange(rows_, {});
  }

 private:
  std::vector<int64_t> local_, rows_;
};

/// Sets, and how bones move.
void distribute_motion(Distribution& distribution);

/// The part of one rank; the rows of points, prisms and edges are those of the distribution's
/// model.
Part make_part(const Distribution& distribution, const OwnedRange& owned, LocalNumbers& local);

}  // namespace repose::discrete
