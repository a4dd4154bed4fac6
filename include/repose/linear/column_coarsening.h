#pragma once
#include <array>
#include <memory>

#include "repose/linear/column_level.h"

namespace repose::linear {

/// A coarser tissue with as many layers: aggregates of neighboring columns become its columns
/// (semicoarsening along the skin). Each point moves with a few coarse points of its own layer, by
/// weights that are the aggregates' smoothed once over the layer (smoothed aggregation: Vaněk,
/// Mandel & Brezina 1996), the same for x, y and z. Aggregates and weights stay on one rank.
class Coarsening {
 public:
  /// From the numbers that `fine` has, whose points are `at` (mm). Collective.
  Coarsening(MPI_Comm comm, const ColumnLevel& fine, const std::vector<Vec3>& at);

  /// Means of the points that the coarse ones stand for, mm.
  const std::vector<Vec3>& center() const { return center_; }
  /// The coarse matrix Pᵀ A P takes its numbers from `fine`. Not collective.
  void refill(const ColumnLevel& fine);
  ColumnLevel& coarse() { return *coarse_; }
  const ColumnLevel& coarse() const { return *coarse_; }

  /// Adds Pᵀ D P to the coarse matrix for a change D of a block of the fine one, of own points, and
  /// its mirror image: calls visit(row, column, block) for what it adds, column not before row.
  template <class Visit>
  void visit_change(int32_t i, int32_t j, const Eigen::Matrix3f& change, Visit&& visit) const {
    weights_[i].visit([&](int32_t a, float weight_a) {
      weights_[j].visit([&](int32_t b, float weight_b) {
        const Eigen::Matrix3f block = weight_a * weight_b * change;
        if (a == b && i != j)
          visit(a, a, Eigen::Matrix3f(block + block.transpose()));
        else if (a < b || a == b)
          visit(a, b, block);
        else if (i != j)
          visit(b, a, Eigen::Matrix3f(block.transpose()));
      });
    });
  }

  /// coarse = Pᵀ fine; own points of both.
  void restrict_to(std::span<const Lanes> fine, std::span<Lanes> coarse) const;
  /// fine += P coarse; own points of both.
  void add_to(std::span<const Lanes> coarse, std::span<Lanes> fine) const;

 private:
  /// Coarse points that a point moves with and their weights, which add up to 1.
  static constexpr int maximum = 4;
  struct Weights {
    std::array<int32_t, maximum> point;  // numbers of the coarse level; unused ones have weight 0
    std::array<float, maximum> weight;
    /// Calls visit(point, weight) for those that are used.
    template <class Visit>
    void visit(Visit&& visit) const {
      for (int m = 0; m < maximum; ++m)
        if (weight[m] != 0) visit(point[m], weight[m]);
    }
  };
  struct Share {
    int32_t fine;
    float weight;
  };
  struct Candidate {
    double weight;
    int32_t point;
  };
  void find_centers(const std::vector<Vec3>& at, const std::vector<int32_t>& point, int32_t own);
  static void find_candidates(const ColumnLevel& fine, const std::vector<int32_t>& point, int32_t i,
                              std::vector<Candidate>& found);
  void make_linear(const Vec3& at, std::vector<Candidate>& found) const;
  void smooth(const ColumnLevel& fine, const std::vector<Vec3>& at,
              const std::vector<int32_t>& point);
  IndexMap number_ghosts(MPI_Comm comm, const ColumnLevel& fine, int32_t own);
  void transpose(int32_t own);
  BlockPattern find_pattern(const ColumnLevel& fine, int32_t own, int32_t ghosts) const;

  int32_t fine_own_;
  std::vector<Vec3> center_;          // [coarse own] mm
  std::vector<Weights> weights_;      // [fine own + ghosts]
  std::vector<int64_t> share_begin_;  // [coarse own + 1]
  std::vector<Share> share_;          // the transpose of the weights
  std::unique_ptr<ColumnLevel> coarse_;
};

}  // namespace repose::linear
