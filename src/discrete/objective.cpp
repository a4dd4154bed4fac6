#include "repose/discrete/objective.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

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

/// Grids of rounded bodies in spacings of the exact ones: what measured best on real heads, and
/// where the tissue's mesh is coarser, 0.75 of its edges, by the areas that its points stand for.
/// Collective.
double rounding_times(MPI_Comm comm, const model::Contact& contact) {
  constexpr double minimum = 2.5, of_an_edge = 0.75, square_of_edge = 1.155;  // over a point's area
  const std::vector<double>& of = contact.pairs.area;
  const double area = base::sum_over_ranks(comm, std::accumulate(of.begin(), of.end(), 0.0));
  const auto points = static_cast<double>(base::sum_over_ranks(comm, of.size()));
  const double edge = std::sqrt(square_of_edge * area / std::max(points, 1.0));
  return std::max(minimum, of_an_edge * edge / contact.spacing);
}

/// The contact with bodies whose edges are rounded. Collective.
mechanics::BodyContact rounded_touches(MPI_Comm comm, const Part& part) {
  if (!part.contact) return {};
  const double times = rounding_times(comm, part.model.contact);
  std::vector<mechanics::RigidBody> bodies;
  for (const mechanics::RigidBody& body : part.bodies) bodies.push_back(body.rounded(times));
  model::ContactPairs pairs = part.model.contact.pairs;
  if (!pairs.point.empty()) pairs.offset = mechanics::contact_offsets(part.model, bodies);
  return {pairs, part.model.contact.stiffness, std::move(bodies)};
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
      body_contact_(positions.part().model.contact.pairs, positions.part().model.contact.stiffness,
                    positions.part().bodies),
      other_body_contact_(rounded_touches(positions.comm(), positions.part())),
      cut_face_contact_(positions.part().model.contact.cut_faces,
                        positions.part().model.contact.stiffness),
      load_force_(load_forces(positions.comm(), positions.part().model, loaded_)),
      initial_(mechanics::totals(loops_, positions.part().model.points.position)),
      links_(find_links(loops_, cut_face_contact_)),
      work_(positions.local().size()) {}

void Objective::limit_bulk(double max_bulk) {
  mechanics::limit_bulk(positions_.part().model, max_bulk, loops_);
}

void Objective::round_bodies(bool rounded) {
  if (rounded == rounded_) return;
  rounded_ = rounded;
  other_body_contact_.set_multipliers(body_contact_.multipliers());
  other_body_contact_.set_stiffness(body_contact_.stiffness());
  std::swap(body_contact_, other_body_contact_);
  placed_at_ = -1;
}

void Objective::place_bodies() {
  if (placed_at_ == positions_.revision()) return;
  placed_at_ = positions_.revision();
  mechanics::place_bodies(
      positions_.load(), [&](int32_t bone) { return positions_.bone_matrix(bone); },
      body_contact_.bodies());
}

void Objective::reset_contact() {
  const double stiffness = positions_.part().model.contact.stiffness;
  round_bodies(false);
  body_contact_.reset(stiffness);
  other_body_contact_.reset(stiffness);
  cut_face_contact_.set_multipliers(std::vector<double>(cut_face_contact_.size(), 0.0));
  cut_face_contact_.set_stiffness(stiffness);
  placed_at_ = -1;
}

double Objective::add_contact(double scale, std::span<Vec3> gradient) {
  if (!positions_.part().contact) return 0;
  static const PetscLogEvent event = base::log_event("RpContact");
  const base::Logged logged(event);
  place_bodies();
  return body_contact_.add_gradient(positions_.local(), scale, gradient) +
         cut_face_contact_.add_gradient(positions_.local(), scale, gradient);
}

double Objective::add_terms(double scale, std::span<Vec3> gradient) const {
  double value = 0;
  for (const mechanics::TermLoop& loop : loops_.terms)
    value += loop.add_gradient(positions_.local(), scale, gradient);
  return value;
}

double Objective::contact_value() {
  return base::sum_over_ranks(positions_.comm(), add_contact(0.0, work_));
}

std::vector<Vec3> Objective::contact_force() {
  std::fill(work_.begin(), work_.end(), Vec3::Zero());
  add_contact(-1.0, work_);
  return {work_.begin(), work_.begin() + positions_.part().owned_points};
}

std::vector<Objective::Block> Objective::term_blocks(bool exact) const {
  std::vector<Block> blocks;
  for (const mechanics::TermLoop& loop : loops_.terms)
    loop.for_each_block(positions_.local(), exact, [&](int32_t p, int32_t q, const Mat3& block) {
      blocks.push_back({p, q, weights_.elastic * block});
    });
  return blocks;
}

std::vector<Objective::Block> Objective::contact_blocks(bool exact) {
  std::vector<Block> blocks;
  if (!positions_.part().contact) return blocks;
  const auto add = [&](int64_t p, int64_t q, const Mat3& block) {
    blocks.push_back({static_cast<int32_t>(p), static_cast<int32_t>(q), weights_.elastic * block});
  };
  place_bodies();
  body_contact_.update_gaps(positions_.local());
  body_contact_.for_each_block(exact, [&](int64_t p, const Mat3& block) { add(p, p, block); });
  cut_face_contact_.update_gaps(positions_.local());
  cut_face_contact_.for_each_block(exact, add);
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
  value += weights_.elastic * add_contact(weights_.elastic, work_);
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
  add_contact(1.0, work_);
  subtract_loads(1.0, work_);
  std::vector<Vec3> force(part.owned_points, Vec3::Zero());
  for (int64_t i = 0; i < part.owned_points; ++i)
    if (part.unknown[i] >= 0) force[i] = -work_[i];
  return force;
}

mechanics::Totals Objective::totals() const {
  mechanics::Totals t = mechanics::totals(loops_, positions_.local());
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

ContactState contact_state(Objective& objective) {
  constexpr double looked_at = 6;  // mm
  const auto points = static_cast<size_t>(objective.positions().part().owned_points);
  ContactState state{std::vector<double>(points, looked_at), std::vector<double>(points, 0.0),
                     objective.contact_force()};
  const auto add = [&](int64_t point, double gap, double pressure) {
    state.gap[point] = std::min(state.gap[point], gap);
    state.pressure[point] += pressure;
  };
  mechanics::BodyContact& body_contact = objective.body_contact();
  body_contact.update_all_gaps(objective.positions().local());
  for (size_t c = 0; c < body_contact.gaps().size(); ++c)
    add(body_contact.pairs().point[c], body_contact.gaps()[c], body_contact.pressure(c));
  mechanics::CutFaceContact& cut_faces = objective.cut_face_contact();
  cut_faces.update_gaps(objective.positions().local());
  for (size_t w = 0; w < cut_faces.size(); ++w)
    add(cut_faces.point(w), cut_faces.gap(w), cut_faces.pressure(w));
  return state;
}

}  // namespace repose::discrete
