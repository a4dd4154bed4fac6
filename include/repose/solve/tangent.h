#pragma once
#include <vector>

#include "repose/mechanics/hessian.h"
#include "repose/solve/objective.h"

namespace repose::solve {

/// The Hessian of an objective: the exact one acts spring by spring and prism by prism, without
/// entries (MATSHELL); the convex one, from which a positive definite preconditioner is made, is
/// assembled of 3×3 blocks (MATAIJ, block size 3), and so is the exact one where its entries are
/// asked for. Each rank assembles its own rows; nothing is added across ranks.
class Tangent : public Hessian {
 public:
  explicit Tangent(Objective& objective);  ///< collective; O(elements) memory

  /// Nothing is done if `displacement` is the state it is at, and nothing has changed since.
  void assemble(Vec displacement) override;
  void renew() override;
  /// The next assembly is done in any case: the elements have changed.
  void forget() { at_.clear(); }

  base::MatHandle make_third() const;  ///< a matrix for third(); collective
  /// The springs' third derivative on `direction` [local points]: ∂(H d)/∂x at the positions' last
  /// update, into `matrix` of make_third(). Collective.
  void third(std::span<const Vec3> direction, Mat matrix);

  Mat exact() override;
  Mat convex() const override { return convex_; }
  Mat action() override { return action_; }

 private:
  static PetscErrorCode multiply(Mat matrix, Vec direction, Vec product);
  /// The block columns of this rank's rows in one part of the matrix, in compressed rows.
  struct BlockRows {
    std::vector<int32_t> begin;   // [owned unknowns + 1]
    std::vector<int32_t> column;  // global block numbers, ascending in each row
  };
  // Where a block goes: index of its first entry among the values of the diagonal part, or, beyond
  // their end, of the off-diagonal part; −1 for a block that is not in this rank's rows.
  using Slot = int32_t;

  void make_pattern();
  void make_matrix();
  void make_action();
  void find_slots();
  bool owns(int32_t point) const;
  Slot find(int32_t row_point, int32_t column_point) const;
  void add(double* const values[2], Slot slot, int32_t row_point, const Mat3& block) const;
  void add_spring(double* const values[2], size_t loop, int64_t spring, const Mat3& block) const;
  template <class Work>
  void refill(Mat matrix, Work&& add_blocks);
  void fill(Mat matrix, mechanics::Curvature curvature);
  void lift_diagonal();

  Objective& objective_;
  const Part& part_;
  BlockRows rows_[2];  // diagonal part, off-diagonal part
  base::MatHandle exact_, convex_, action_;
  base::VecHandle diagonal_;
  std::vector<std::vector<std::array<Slot, 4>>> spring_slots_;  // [loop][spring] ii ij ji jj
  std::vector<std::array<Slot, 36>> prism_slots_;
  std::vector<Vec3> at_;                // [local points] positions of the last assembly
  std::vector<Vec3> direction_, work_;  // [local points]
  int64_t filled_at_ = 0;               // assemblies() when exact_ was filled
};

}  // namespace repose::solve
