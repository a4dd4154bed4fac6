#include "repose/discrete/tangent.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "repose/base/petsc.h"

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
  check(MatAssemblyBegin(action(), MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(action(), MAT_FINAL_ASSEMBLY));
  const auto now = positions.local();
  const bool same = base::on_all_ranks(
      positions.comm(), !state_changed_ && std::ranges::equal(now, action_.position()));
  if (same && !contact_changed_) return;
  if (!same) {
    ++states_;
    action_.set_position(now);
  }
  state_changed_ = false;
  set_contact(objective_.contact_blocks(true), objective_.contact_blocks(false));
}

void Tangent::set_contact(std::vector<Objective::Block> exact,
                          std::vector<Objective::Block> convex) {
  action_.set_contact(std::move(exact));
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
  entries().fill(spd_approximation(), action_.position(), blocks, Curvature::semidefinite);
  lift_diagonal();
}

Mat Tangent::exact() {
  if (!exact_) exact_ = entries().make();
  const bool averaged = objective_.averages_volumes();
  if (filled_at_ == assemblies_) return averaged ? coupled_ : exact_;
  entries().fill(exact_, action_.position(), action_.blocks(), Curvature::exact);
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
  const auto rows = mechanics::nodal_gradients(nodal, part.owned_points, action_.position());
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
  const std::vector<Vec3>& at = action_.position();
  std::vector<Mat3> diagonal(at.size(), Mat3::Zero());  // summed first: most blocks are there
  const auto join = [&](const auto& ends, const Mat3& block) {
    for (const int32_t p : ends) diagonal[p] += block;
    visit(ends[0], ends[1], -block);
  };
  for (const mechanics::SpringLoop& loop : objective_.loops().springs)
    mechanics::for_each_spring_block(
        loop, at, objective_.weights().elastic, Curvature::semidefinite,
        [&](int64_t e, const Mat3& block) { join(loop.points[e], block); });
  const mechanics::EdgeLoop& edges = objective_.loops().edges;
  for (int64_t e = 0; e < edges.size(); ++e)
    join(edges.points[e], objective_.weights().elastic * edges.weight[e] * Mat3::Identity());
  const mechanics::PrismLoop& prisms = objective_.loops().prisms;
  mechanics::for_each_prism_block(
      objective_.loops(), at, objective_.weights(),
      mechanics::semidefinite_slopes(prisms, objective_.positions().part().model.points.position,
                                     at),
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
