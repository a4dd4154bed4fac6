#include "repose/discrete/hessian_action.h"

#include <algorithm>
#include <iterator>

#include "flops.h"
#include "repose/base/log.h"
#include "repose/mechanics/hessian.h"
#include "repose/mechanics/prism_volume.h"

namespace repose::discrete {

using base::check;

HessianAction::HessianAction(Objective& objective)
    : objective_(objective),
      direction_(objective.positions().local().size(), Vec3::Zero()),
      product_(direction_) {
  const UnknownBlocks& unknowns = objective.positions().part().unknowns;
  const auto owned = static_cast<PetscInt>(3 * unknowns.owned);
  const auto total = static_cast<PetscInt>(3 * unknowns.total);
  check(MatCreateShell(objective.positions().comm(), owned, owned, total, total, this,
                       matrix_.out()));
  check(MatSetBlockSize(matrix_, 3));
  check(MatShellSetOperation(matrix_, MATOP_MULT, reinterpret_cast<void (*)()>(multiply)));
  check(MatSetOption(matrix_, MAT_SYMMETRIC, PETSC_TRUE));
  check(MatSetOption(matrix_, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
}

PetscErrorCode HessianAction::multiply(Mat matrix, Vec direction, Vec product) {
  HessianAction* self = nullptr;
  if (const PetscErrorCode code = MatShellGetContext(matrix, &self)) return code;
  return base::run_callback([&] {
    const Objective& objective = self->objective_;
    static const PetscLogEvent event = base::log_event("RpHessianAction");
    const base::Logged logged(event, flops_of(objective.loops(), action_flops));
    objective.positions().scatter_to_local(direction, self->direction_);
    std::ranges::fill(self->product_, Vec3::Zero());
    mechanics::add_hessian_action(objective.loops(), self->position_, objective.weights(),
                                  self->direction_, self->product_, self->nodal_slopes_,
                                  self->max_slope_);
    Objective::add_blocks(self->blocks_, self->direction_, self->product_);
    objective.positions().restrict_to_owned(self->product_, product);
  });
}

void HessianAction::set_position(std::span<const Vec3> position) {
  position_.assign(position.begin(), position.end());
  update_slopes();
}

void HessianAction::update_slopes() {
  const mechanics::Loops& loops = objective_.loops();
  nodal_slopes_ = mechanics::nodal_slopes(loops.nodal, position_);
  max_slope_.clear();
  if (!limited_) return;
  max_slope_ = mechanics::semidefinite_slopes(
      loops.prisms, objective_.positions().part().model.points.position, position_);
  if (nodal_slopes_.empty()) return;
  for (size_t m = 0; m < max_slope_.size(); ++m) {
    const auto corners = base::pick(position_, loops.prisms.points[m]);
    const int64_t place = loops.nodal.place[loops.prisms.row[m]];
    const double own =
        mechanics::own_slope(loops.nodal, place, mechanics::prism_volume(corners.data()));
    double& slope = nodal_slopes_[place];
    slope = std::clamp(own + slope, -max_slope_[m], max_slope_[m]) - own;
  }
}

bool HessianAction::limit_slopes(bool limited) {
  if (!objective_.positions().part().solid) return false;
  limited_ = limited;
  if (!position_.empty()) update_slopes();
  return true;
}

void HessianAction::set_contact(std::vector<Objective::Block> contact) {
  blocks_ = std::move(contact);
  std::ranges::copy(objective_.term_blocks(!limited_), std::back_inserter(blocks_));
}

}  // namespace repose::discrete
