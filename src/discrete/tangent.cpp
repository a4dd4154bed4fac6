#include "repose/discrete/tangent.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "flops.h"
#include "repose/base/log.h"
#include "repose/base/petsc.h"
#include "repose/mechanics/prism_volume.h"

namespace repose::discrete {

using base::check;
using mechanics::Curvature;

namespace {

/// The most numbers in a row of them.
PetscInt max_around(const std::vector<mechanics::NodalGradient>& rows) {
  size_t maximum = 0;
  for (const mechanics::NodalGradient& row : rows) maximum = std::max(maximum, row.points.size());
  return static_cast<PetscInt>(3 * maximum);
}

}  // namespace

Tangent::Tangent(Objective& objective) : objective_(objective) { make_action(); }

void Tangent::make_action() {
  const Part& part = objective_.positions().part();
  const auto owned = static_cast<PetscInt>(3 * part.unknowns.owned);
  const auto total = static_cast<PetscInt>(3 * part.unknowns.total);
  direction_.assign(part.point_row.size(), Vec3::Zero());
  work_ = direction_;
  check(MatCreateShell(objective_.positions().comm(), owned, owned, total, total, this,
                       action_.out()));
  check(MatSetBlockSize(action_, 3));
  check(MatShellSetOperation(action_, MATOP_MULT, reinterpret_cast<void (*)()>(multiply)));
  check(MatSetOption(action_, MAT_SYMMETRIC, PETSC_TRUE));
  check(MatSetOption(action_, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
}

PetscErrorCode Tangent::multiply(Mat matrix, Vec direction, Vec product) {
  Tangent* self = nullptr;
  if (const PetscErrorCode code = MatShellGetContext(matrix, &self)) return code;
  try {
    const Objective& objective = self->objective_;
    static const PetscLogEvent event = base::log_event("RpHessianAction");
    const base::Logged logged(event, flops_of(objective.loops(), action_flops));
    objective.positions().scatter_to_local(direction, self->direction_);
    std::fill(self->work_.begin(), self->work_.end(), Vec3::Zero());
    mechanics::add_hessian_action(objective.loops(), self->at_, objective.weights(),
                                  self->direction_, self->work_, self->nodal_slopes_,
                                  self->max_slope_);
    Objective::add_blocks(self->blocks_, self->direction_, self->work_);
    objective.positions().restrict_to_owned(self->work_, product);
  } catch (const std::exception&) {
    return PETSC_ERR_LIB;
  }
  return PETSC_SUCCESS;
}

const TangentEntries& Tangent::entries() {
  if (!entries_) entries_ = std::make_unique<TangentEntries>(objective_);
  return *entries_;
}

base::MatHandle Tangent::make_third() { return entries().make(); }

void Tangent::third(std::span<const Vec3> direction, Mat matrix) {
  entries().fill_third(matrix, objective_.positions().local(), direction);
}

void Tangent::lift_diagonal() {
  constexpr double lift = 1e-9;  // keeps factors positive where the convex Hessian is singular
  base::VecHandle diagonal = objective_.positions().make_vector();
  check(MatGetDiagonal(spd_, diagonal));
  PetscScalar* values = nullptr;
  PetscInt size = 0;
  check(VecGetLocalSize(diagonal, &size));
  check(VecGetArray(diagonal, &values));
  for (PetscInt i = 0; i < size; ++i) values[i] = values[i] > 0 ? values[i] * (1 + lift) : 1.0;
  check(VecRestoreArray(diagonal, &values));
  check(MatDiagonalSet(spd_, diagonal, INSERT_VALUES));
}

void Tangent::assemble(Vec displacement) {
  Positions& positions = objective_.positions();
  positions.update(displacement);
  // Takes back the multiples of 1 that TAO's line searches add to a Hessian.
  check(MatAssemblyBegin(action_, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(action_, MAT_FINAL_ASSEMBLY));
  const auto now = positions.local();
  const bool same = base::on_all_ranks(positions.comm(), std::ranges::equal(now, at_));
  if (same && !contact_changed_) return;
  at_.assign(now.begin(), now.end());
  if (!same) {
    ++states_;
    take_slopes();
  }
  set_contact(objective_.contact_blocks(true), objective_.contact_blocks(false));
}

void Tangent::take_slopes() {
  const mechanics::Loops& loops = objective_.loops();
  nodal_slopes_ = mechanics::nodal_slopes(loops.nodal, at_);
  max_slope_.clear();
  if (!limited_) return;
  max_slope_ = mechanics::semidefinite_slopes(
      loops.prisms, objective_.positions().part().model.points.position, at_);
  if (nodal_slopes_.empty()) return;
  for (size_t m = 0; m < max_slope_.size(); ++m) {
    const auto corners = base::pick(at_, loops.prisms.points[m]);
    const int64_t place = loops.nodal.place[loops.prisms.row[m]];
    const double own =
        mechanics::own_slope(loops.nodal, place, mechanics::prism_volume(corners.data()));
    double& slope = nodal_slopes_[place];
    slope = std::clamp(own + slope, -max_slope_[m], max_slope_[m]) - own;
  }
}

bool Tangent::limit_slopes(bool limited) {
  if (!objective_.positions().part().solid) return false;
  limited_ = limited;
  if (!at_.empty()) take_slopes();
  return true;
}

void Tangent::set_contact(std::vector<Objective::Block> exact,
                          std::vector<Objective::Block> convex) {
  blocks_ = std::move(exact);
  std::ranges::copy(objective_.term_blocks(!limited_), std::back_inserter(blocks_));
  convex_contact_ = std::move(convex);
  convex_terms_ = objective_.term_blocks(false);
  contact_changed_ = false;
  ++assemblies_;
}

Mat Tangent::spd_approximation() {
  if (spd_) return spd_;
  spd_ = entries().make();
  check(MatSetOption(spd_, MAT_SPD, PETSC_TRUE));
  return spd_;
}

void Tangent::renew() {
  std::vector<Objective::Block> blocks = convex_terms_;
  blocks.insert(blocks.end(), convex_contact_.begin(), convex_contact_.end());
  entries().fill(spd_approximation(), at_, blocks, Curvature::semidefinite);
  lift_diagonal();
}

Mat Tangent::exact() {
  if (!exact_) exact_ = entries().make();
  const bool averaged = objective_.averages_volumes();
  if (filled_at_ == assemblies_) return averaged ? coupled_ : exact_;
  entries().fill(exact_, at_, blocks_, Curvature::exact);
  filled_at_ = assemblies_;
  if (!averaged) return exact_;
  coupled_ = nodal_coupling();
  check(MatAXPY(coupled_, 1, exact_, DIFFERENT_NONZERO_PATTERN));
  return coupled_;
}

/// Σ k g gᵀ over the points whose volumes are averaged, as GᵀG with a row of √k gᵀ for each.
base::MatHandle Tangent::nodal_coupling() const {
  const Part& part = objective_.positions().part();
  const mechanics::NodalVolumes& nodal = objective_.loops().nodal;
  const auto rows = mechanics::nodal_gradients(nodal, part.owned_points, at_);
  const auto columns = static_cast<PetscInt>(3 * part.unknowns.owned);
  base::MatHandle gradients, product;
  check(MatCreateAIJ(objective_.positions().comm(), static_cast<PetscInt>(part.owned_points),
                     columns, PETSC_DETERMINE, PETSC_DETERMINE, max_around(rows), nullptr,
                     max_around(rows), nullptr, gradients.out()));
  check(MatSetOption(gradients, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  PetscInt row = 0;
  check(MatGetOwnershipRange(gradients, &row, nullptr));
  for (int64_t p = 0; p < part.owned_points; ++p, ++row)
    for (size_t k = 0; k < rows[p].points.size(); ++k) {
      const auto unknown = static_cast<PetscInt>(part.unknown[rows[p].points[k]]);
      if (unknown < 0) continue;
      const PetscInt at[3] = {3 * unknown, 3 * unknown + 1, 3 * unknown + 2};
      const Vec3 entries =
          std::sqrt(nodal.stiffness[p] * objective_.weights().volume_weight) * rows[p].gradient[k];
      check(MatSetValues(gradients, 1, &row, 3, at, entries.data(), INSERT_VALUES));
    }
  check(MatAssemblyBegin(gradients, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(gradients, MAT_FINAL_ASSEMBLY));
  check(
      MatTransposeMatMult(gradients, gradients, MAT_INITIAL_MATRIX, PETSC_DEFAULT, product.out()));
  check(MatSetOption(product, MAT_SYMMETRIC, PETSC_TRUE));
  return product;
}

void Tangent::visit_spd_blocks(const BlockVisitor& visit) const {
  std::vector<Mat3> diagonal(at_.size(), Mat3::Zero());  // summed first: most blocks are there
  const auto join = [&](const auto& ends, const Mat3& block) {
    for (const int32_t p : ends) diagonal[p] += block;
    visit(ends[0], ends[1], -block);
  };
  for (const mechanics::SpringLoop& loop : objective_.loops().springs)
    mechanics::for_each_spring_block(
        loop, at_, objective_.weights().elastic, Curvature::semidefinite,
        [&](int64_t e, const Mat3& block) { join(loop.points[e], block); });
  const mechanics::EdgeLoop& edges = objective_.loops().edges;
  for (int64_t e = 0; e < edges.size(); ++e)
    join(edges.points[e], objective_.weights().elastic * edges.weight[e] * Mat3::Identity());
  const mechanics::PrismLoop& prisms = objective_.loops().prisms;
  mechanics::for_each_prism_block(
      objective_.loops(), at_, objective_.weights(),
      mechanics::semidefinite_slopes(prisms, objective_.positions().part().model.points.position,
                                     at_),
      [&](int64_t e, const mechanics::PrismBlocks& blocks) {
        const auto& corners = prisms.points[e];
        for (int i = 0; i < 6; ++i) {
          diagonal[corners[i]] += blocks[i][i];
          for (int j = i + 1; j < 6; ++j) visit(corners[i], corners[j], blocks[i][j]);
        }
      });
  for (const auto& [p, q] : objective_.links())
    if (level(p, q)) visit(p, q, Mat3::Zero());
  for (size_t p = 0; p < diagonal.size(); ++p)
    visit(static_cast<int32_t>(p), static_cast<int32_t>(p), diagonal[p]);
  visit_level(convex_terms_, visit);
}

/// Multigrid couples no points across a layer.
bool Tangent::level(int32_t p, int32_t q) const {
  const auto& layer = objective_.positions().part().model.points.layer;
  return std::abs(layer[p] - layer[q]) <= 1;
}

void Tangent::visit_level(std::span<const Objective::Block> blocks,
                          const BlockVisitor& visit) const {
  const auto links = objective_.links();
  for (const auto& [p, q, block] : blocks) {
    if (p == q || (level(p, q) && std::ranges::binary_search(links, std::array{p, q})))
      visit(p, q, block);
  }
}

void Tangent::visit_contact_blocks(const BlockVisitor& visit) const {
  visit_level(convex_contact_, visit);
}

}  // namespace repose::discrete
