#pragma once
#include <vector>

#include "repose/discrete/objective.h"

namespace repose::discrete {

/// The exact Hessian of an objective at a state as a matrix without entries (MATSHELL), which acts
/// spring by spring and prism by prism.
class HessianAction {
 public:
  explicit HessianAction(Objective& objective);  ///< at no state; collective
  HessianAction(HessianAction&&) = delete;

  Mat matrix() const { return matrix_; }
  /// Goes to these positions [local points], mm. Not collective.
  void set_position(std::span<const Vec3> position);
  const std::vector<Vec3>& position() const { return position_; }
  /// Takes the further terms' blocks at the positions' last update, and these of contact. Not
  /// collective.
  void set_contact(std::vector<Objective::Block> contact);
  const std::vector<Objective::Block>& blocks() const { return blocks_; }
  /// Limits |φ′| of volumes (semidefinite_slopes of hessian.h) and leaves the negative curvature of
  /// further terms out at the next set_contact(), so that the matrix is positive semidefinite but
  /// for contact, or takes that back. Returns false where the tissue is no solid. Not collective.
  bool limit_slopes(bool limited);

 private:
  static PetscErrorCode multiply(Mat matrix, Vec direction, Vec product);
  void update_slopes();

  Objective& objective_;
  base::MatHandle matrix_;
  std::vector<Vec3> position_;
  std::vector<double> nodal_slopes_;       // where volumes are averaged
  std::vector<double> max_slope_;          // [prisms], or empty: no limit
  std::vector<Objective::Block> blocks_;   // of terms and contact
  std::vector<Vec3> direction_, product_;  // [local points]
  bool limited_ = false;
};

}  // namespace repose::discrete
