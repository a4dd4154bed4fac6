#pragma once
#include "repose/discrete/contact.h"
#include "repose/discrete/function.h"
#include "repose/mechanics/energy.h"

namespace repose::discrete {

/// The function that is minimized (docs/theory/model.md Eqs. 11, 12) over the displacements of the
/// unknowns: value, gradient and Hessian action, with gravity and external forces as a potential W
/// = −Σ_{soft} (m g + f^ext) · (x − X). All members are collective unless said otherwise.
class Objective : public Function {
 public:
  Objective(Positions& positions, const mechanics::Weights& weights);

  /// (∂²Φ/∂x²) d with `direction` [local points], at the state of the last update; on request
  /// without contact.
  void hessian_action(std::span<const Vec3> direction, Vec product, bool contact = true);
  /// Adds what bones that go on to `load` change of the gradient by elements that move with them.
  void add_carried(double load, Vec change);

  /// A block of the Hessian between two local points; where they differ, its transpose is that of
  /// the second and the first.
  struct Block {
    int32_t p, q;
    Mat3 block;
  };
  /// Those of further terms and of contact at the last update, exact or of a semidefinite relative.
  /// Not collective.
  std::vector<Block> term_blocks(bool exact) const;
  std::vector<Block> contact_blocks(bool exact);
  /// Pairs of different points that the preconditioner couples by such blocks, ascending.
  std::span<const std::array<int32_t, 2>> links() const { return links_; }
  static void add_blocks(std::span<const Block> blocks, std::span<const Vec3> direction,
                         std::span<Vec3> product);
  Contact& contact() { return contact_; }
  /// Contact's value, at the last update, summed over ranks, N·mm.
  double contact_value();
  /// N, of what is touched on each owned point, at the last update. Not collective.
  std::vector<Vec3> contact_force();

  /// F_i of Eq. 6, of springs without volume term, of a solid whole, with further terms; [owned
  /// points], zero outside soft tissue (N).
  std::vector<Vec3> residual_force();
  /// Summed over ranks, at the last update; those of a solid and of further terms are 0 initially.
  mechanics::Totals totals() const;
  double potential() const;  ///< W, N·mm

  const mechanics::Weights& weights() const { return weights_; }
  /// Limits λ of a solid to `max_bulk` times μ (mechanics::limit_bulk), or no more where it is
  /// infinite. A Hessian is to be invalidated then. Not collective.
  void limit_bulk(double max_bulk);
  double largest_bulk() const { return largest_bulk_; }  ///< λ/μ of all ranks; 0 of springs
  void set_volume_weight(double weight) { weights_.volume_weight = weight; }
  const mechanics::Loops& loops() const { return loops_; }
  bool averages_volumes() const { return averages_volumes_; }  ///< on some rank

 private:
  double value_and_gradient(Vec displacement, Vec gradient) override;
  void subtract_loads(double scale, std::span<Vec3> gradient) const;
  double add_terms(double scale, std::span<Vec3> gradient) const;

  mechanics::Weights weights_;
  mechanics::Loops loops_;
  bool averages_volumes_;
  double largest_bulk_;
  Contact contact_;
  bool loaded_ = false;           // some rank has a weight or an external force
  std::vector<Vec3> load_force_;  // [local points] m g + f^ext on soft tissue; empty if all zero
  mechanics::Totals initial_;     // this rank's share
  std::vector<std::array<int32_t, 2>> links_;
  std::vector<Vec3> work_;  // [local points]
};

}  // namespace repose::discrete
