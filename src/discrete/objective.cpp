#include "repose/discrete/objective.h"

#include <algorithm>
#include <cmath>

#include "flops.h"
#include "repose/base/collective.h"
#include "repose/base/error.h"
#include "repose/base/log.h"
#include "repose/mechanics/prism_volume.h"

namespace repose::discrete {

namespace {

/// Weight and external force of each local point; empty if there is none on any rank.
std::vector<Vec3> load_forces(MPI_Comm comm, const model::Model& model, bool& loaded) {
  std::vector<Vec3> force(model.points.position.size(), Vec3::Zero());
  bool any = false;
  for (size_t i = 0; i < force.size(); ++i) {
    if (model.points.set[i] != model::PointSet::soft_tissue) continue;
    force[i] = model.points.mass[i] * model.gravity + model.points.external_force[i];
    any |= !force[i].isZero(0);
  }
  loaded = base::on_any_rank(comm, any);
  if (!loaded) force.clear();
  return force;
}

/// Pairs of different points that blocks of further terms and of cuts may couple, ascending.
std::vector<std::array<int32_t, 2>> find_links(const mechanics::Loops& loops,
                                               const mechanics::CutFaceContact& cut_faces) {
  std::vector<std::array<int32_t, 2>> links(cut_faces.links().begin(), cut_faces.links().end());
  for (const mechanics::TermLoop& loop : loops.terms)
    loop.for_each_link([&](int32_t p, int32_t q) {
      if (p != q) links.push_back({p, q});
    });
  base::sort_unique(links);
  return links;
}

/// Replaces what is not finite by nothing and cuts blocks to a length that can still be squared.
void make_finite(std::span<Vec3> gradient) {
  constexpr double longest = 1e100;
  for (Vec3& g : gradient) {
    if (!g.allFinite()) g.setZero();
    const double length = g.lpNorm<Eigen::Infinity>();
    if (length > longest) g *= longest / length;
  }
}

}  // namespace

void refuse_overflow(const char* what, double load) {
  base::refuse(
      "{} at load {:.4g} are too large for floating-point numbers: elongations are huge beside "
      "s_ref, or the moduli are; check the units, tissue.springs and how far bones move",
      what, load);
}

Objective::Objective(Positions& positions, const mechanics::Weights& weights)
    : Function(positions),
      weights_(weights),
      loops_(mechanics::make_loops(positions.part().model, positions.part().owned_springs,
                                   positions.part().owned_prisms, positions.part().owned_edges,
                                   positions.part().owned_points)),
      averages_volumes_(base::on_any_rank(positions.comm(), !loops_.nodal.empty())),
      largest_bulk_(base::max_over_ranks(
          positions.comm(), mechanics::largest_bulk(positions.part().model, loops_.prisms))),
      contact_(positions),
      load_force_(load_forces(positions.comm(), positions.part().model, loaded_)),
      initial_(mechanics::totals(loops_, positions.part().model.points.position)),
      links_(find_links(loops_, contact_.cut_faces())),
      work_(positions.local().size()) {}

void Objective::limit_bulk(double max_bulk) {
  mechanics::limit_bulk(positions_.part().model, max_bulk, loops_);
}

double Objective::add_terms(double scale, std::span<Vec3> gradient) const {
  double value = 0;
  for (const mechanics::TermLoop& loop : loops_.terms)
    value += loop.add_gradient(positions_.local(), positions_.poses(), scale, gradient);
  return value;
}

double Objective::contact_value() {
  return base::sum_over_ranks(positions_.comm(), contact_.add_gradient(0.0, work_));
}

std::vector<Vec3> Objective::contact_force() {
  std::fill(work_.begin(), work_.end(), Vec3::Zero());
  contact_.add_gradient(-1.0, work_);
  return {work_.begin(), work_.begin() + positions_.part().owned_points};
}

std::vector<Objective::Block> Objective::term_blocks(bool exact) const {
  std::vector<Block> blocks;
  for (const mechanics::TermLoop& loop : loops_.terms)
    loop.for_each_block(positions_.local(), positions_.poses(), exact,
                        [&](int32_t p, int32_t q, const Mat3& block) {
                          blocks.push_back({p, q, weights_.elastic * block});
                        });
  return blocks;
}

std::vector<Objective::Block> Objective::contact_blocks(bool exact) {
  std::vector<Block> blocks;
  contact_.for_each_block(exact, [&](int64_t p, int64_t q, const Mat3& block) {
    blocks.push_back({static_cast<int32_t>(p), static_cast<int32_t>(q), weights_.elastic * block});
  });
  return blocks;
}

void Objective::subtract_loads(double scale, std::span<Vec3> gradient) const {
  for (size_t i = 0; i < load_force_.size(); ++i) gradient[i] -= scale * load_force_[i];
}

double Objective::potential() const {
  const Part& part = positions_.part();
  double w = 0;
  if (loaded_)
    for (int64_t i = 0; i < part.owned_points; ++i)
      w -= load_force_[i].dot(positions_.local()[i] - part.model.points.position[i]);
  return base::sum_over_ranks(positions_.comm(), w);
}

double Objective::value_and_gradient(Vec displacement, Vec gradient) {
  static const PetscLogEvent event = base::log_event("RpEvaluate");
  const base::Logged logged(event, flops_of(loops_, gradient_flops));
  positions_.update(displacement);
  std::fill(work_.begin(), work_.end(), Vec3::Zero());
  double value = 0;
  for (const mechanics::SpringLoop& loop : loops_.springs)
    value += weights_.elastic *
             mechanics::add_spring_gradient(loop, positions_.local(), weights_.elastic, work_);
  value += weights_.elastic * mechanics::add_edge_gradient(loops_.edges, positions_.local(),
                                                           weights_.elastic, work_) -
           initial_.solid_energy;
  value += mechanics::add_volume_gradient(loops_, positions_.local(), weights_, work_);
  value += weights_.elastic * (add_terms(weights_.elastic, work_) - initial_.term_energy);
  value += weights_.elastic * contact_.add_gradient(weights_.elastic, work_);
  subtract_loads(weights_.elastic, work_);
  value = base::sum_over_ranks(positions_.comm(), value);
  if (loaded_) value += weights_.elastic * potential();
  if (!std::isfinite(value) || value > overflown) {
    value = overflown;
    make_finite(work_);
  }
  if (gradient) positions_.restrict_to_owned(work_, gradient);
  return value;
}

void Objective::add_blocks(std::span<const Block> blocks, std::span<const Vec3> direction,
                           std::span<Vec3> product) {
  for (const auto& [p, q, block] : blocks) {
    product[p] += block * direction[q];
    if (p != q) product[q] += block.transpose() * direction[p];
  }
}

void Objective::hessian_action(std::span<const Vec3> direction, Vec product, bool contact) {
  std::fill(work_.begin(), work_.end(), Vec3::Zero());
  mechanics::add_hessian_action(loops_, positions_.local(), weights_, direction, work_,
                                mechanics::nodal_slopes(loops_.nodal, positions_.local()));
  add_blocks(term_blocks(true), direction, work_);
  if (contact) add_blocks(contact_blocks(true), direction, work_);
  positions_.restrict_to_owned(work_, product);
}

void Objective::add_carried(double load, Vec change) {
  const std::vector<Mat4> poses = positions_.poses_at(load);
  std::fill(work_.begin(), work_.end(), Vec3::Zero());
  for (const mechanics::TermLoop& loop : loops_.terms) {
    loop.add_gradient(positions_.local(), poses, weights_.elastic, work_);
    loop.add_gradient(positions_.local(), positions_.poses(), -weights_.elastic, work_);
  }
  const base::VecHandle part = positions_.make_vector();
  positions_.restrict_to_owned(work_, part);
  base::check(VecAXPY(change, 1, part));
}

std::vector<Vec3> Objective::residual_force() {
  const Part& part = positions_.part();
  std::fill(work_.begin(), work_.end(), Vec3::Zero());
  for (const mechanics::SpringLoop& loop : loops_.springs)
    mechanics::add_spring_gradient(loop, positions_.local(), 1.0, work_);
  if (loops_.solid()) {
    mechanics::add_edge_gradient(loops_.edges, positions_.local(), 1.0, work_);
    mechanics::add_volume_gradient(loops_, positions_.local(), weights_, work_);
  }
  add_terms(1.0, work_);
  contact_.add_gradient(1.0, work_);
  subtract_loads(1.0, work_);
  std::vector<Vec3> force(part.owned_points, Vec3::Zero());
  for (int64_t i = 0; i < part.owned_points; ++i)
    if (part.unknown[i] >= 0) force[i] = -work_[i];
  return force;
}

mechanics::Totals Objective::totals() const {
  mechanics::Totals t = mechanics::totals(loops_, positions_.local(), positions_.poses());
  MPI_Comm comm = positions_.comm();
  t.spring_energy = base::sum_over_ranks(comm, t.spring_energy);
  t.solid_energy = base::sum_over_ranks(comm, t.solid_energy - initial_.solid_energy);
  t.fixed_energy = base::sum_over_ranks(comm, t.fixed_energy - initial_.fixed_energy);
  t.term_energy = base::sum_over_ranks(comm, t.term_energy - initial_.term_energy);
  t.volume_squares = base::sum_over_ranks(comm, t.volume_squares);
  t.penalty_unit = base::sum_over_ranks(comm, t.penalty_unit);
  t.volume_error_max = base::max_over_ranks(comm, t.volume_error_max);
  t.inverted = base::sum_over_ranks(comm, t.inverted);
  return t;
}

}  // namespace repose::discrete
