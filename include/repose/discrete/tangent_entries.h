#pragma once
#include <array>
#include <vector>

#include "repose/discrete/objective.h"
#include "repose/mechanics/hessian.h"

namespace repose::discrete {

/// Matrices of 3×3 blocks (MATAIJ, block size 3) with an entry wherever the terms of an
/// objective couple unknown points, and the places of these in them. Each rank fills its own rows;
/// nothing is added across ranks.
class TangentEntries {
 public:
  explicit TangentEntries(const Objective& objective);  ///< collective; O(elements) memory

  base::MatHandle make() const;  ///< a matrix of zeros; collective
  /// The Hessian with `position` [local points], mm, and these blocks of contact and further terms.
  /// Collective.
  void fill(Mat matrix, std::span<const Vec3> position, std::span<const Objective::Block> blocks,
            mechanics::Curvature curvature) const;
  /// The springs' third derivative on `direction` [local points]: ∂(H d)/∂x. Collective.
  void fill_third(Mat matrix, std::span<const Vec3> position,
                  std::span<const Vec3> direction) const;

 private:
  /// The block columns of this rank's rows in one part of a matrix, in compressed rows.
  struct BlockRows {
    std::vector<PetscInt> begin;  // [owned unknowns + 1]
    std::vector<int32_t> column;  // global block numbers, ascending in each row
  };
  // Where a block goes: index of its first entry among the values of the diagonal part, or, beyond
  // their end, of the off-diagonal part; −1 for a block that is not in this rank's rows.
  using Slot = PetscInt;
  using PairSlots = std::array<Slot, 4>;  // ii ij ji jj

  void make_pattern();
  void make_pattern_matrix();
  void find_slots();
  std::vector<PairSlots> find_pairs(const std::vector<std::array<int32_t, 2>>& points) const;
  bool owns(int32_t point) const;
  Slot find(int32_t row_point, int32_t column_point) const;
  void add(double* const values[2], Slot slot, int32_t row_point, const Mat3& block) const;
  void add_pair(double* const values[2], const std::array<int32_t, 2>& points,
                const PairSlots& slots, const Mat3& block) const;
  template <class Work>
  void refill(Mat matrix, Work&& add_blocks) const;

  const Objective& objective_;
  const Part& part_;
  BlockRows rows_[2];                                 // diagonal part, off-diagonal part
  base::MatHandle pattern_;                           // zeros
  std::vector<std::vector<PairSlots>> spring_slots_;  // [loop][spring]
  std::vector<PairSlots> edge_slots_;
  std::vector<std::array<Slot, 36>> prism_slots_;
};

}  // namespace repose::discrete
