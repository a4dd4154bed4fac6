#include "contact_gaps.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "repose/base/collective.h"

namespace repose::solve {

using base::check;
using mechanics::LinearGap;

namespace {

constexpr double smoothed_to = 1;  // mm: of gaps beyond the exact distance serves

double change(const LinearGap& gap, std::span<const Vec3> moved) {
  double change = 0;
  for (const auto& [p, gradient] : gap.gradient) change += gradient.dot(moved[p]);
  return change;
}

}  // namespace

ContactGaps::ContactGaps(discrete::Objective& objective)
    : objective_(objective),
      stiffness_(objective.positions().part().model.contact.stiffness),
      least_stiffness_(stiffness_),
      moved_(objective.positions().local().size(), Vec3::Zero()),
      forces_(objective.positions().make_vector()) {}

void ContactGaps::linearize(Vec displacement, double reach) {
  objective_.positions().update(displacement);
  objective_.contact().place_bodies();
  gaps_ =
      objective_.contact().bodies().linear_gaps(objective_.positions().local(), reach, smoothed_to);
  add_gaps(reach);
}

void ContactGaps::linearize(Vec displacement, double load, std::span<const Vec3> travel) {
  discrete::Positions& positions = objective_.positions();
  const double before = positions.load();
  positions.update(displacement);
  objective_.contact().place_bodies();
  gaps_ = objective_.contact().bodies().linear_gaps(positions.local(), farthest, smoothed_to);
  const std::vector<mechanics::RigidBody> bodies = objective_.contact().bodies().bodies();
  positions.set_load(load);
  objective_.contact().place_bodies();
  positions.set_load(before);
  positions.update(displacement);
  objective_.contact().bodies().carry(positions.local(), bodies, gaps_);
  objective_.contact().place_bodies();
  add_gaps(farthest);
  for (size_t k = touching_; k < gaps_.size(); ++k)
    for (const auto& [p, gradient] : gaps_[k].gradient) gaps_[k].gap += gradient.dot(travel[p]);
}

/// Adds those of cuts, and takes multipliers and curvature of all.
void ContactGaps::add_gaps(double reach) {
  mechanics::BodyContact& bodies = objective_.contact().bodies();
  mechanics::CutFaceContact& cuts = objective_.contact().cut_faces();
  touching_ = gaps_.size();
  cuts.update_gaps(objective_.positions().local());
  std::ranges::copy(cuts.linear_gaps(reach), std::back_inserter(gaps_));
  state_.assign(gaps_.size(), {});
  const discrete::ContactPressures multipliers = objective_.contact().multipliers();
  for (size_t k = 0; k < gaps_.size(); ++k) state_[k].multiplier = multipliers[constraint(k)];
  curvature_.clear(), convex_curvature_.clear();
  curvature_share_ = 1;
  const double scale = objective_.weights().elastic;
  const auto touching = std::span(gaps_).first(touching_);
  for (const bool exact : {true, false})
    bodies.for_each_curvature(touching, exact, [&](int64_t point, const Mat3& block) {
      const auto p = static_cast<int32_t>(point);
      (exact ? curvature_ : convex_curvature_).push_back({p, p, scale * block});
    });
  cuts.for_each_curvature(std::span(gaps_).subspan(touching_),
                          [&](int32_t p, int32_t q, const Mat3& block) {
                            curvature_.push_back({p, q, scale * block});
                          });
}

void ContactGaps::replace(const LinearGap& by) {
  const auto bodies = std::span(gaps_).first(touching_);
  const auto gap = std::ranges::find(bodies, by.constraint, &LinearGap::constraint);
  if (gap == bodies.end()) return;
  *gap = by;
  state_[gap - bodies.begin()].multiplier = 0;
  const int32_t point = by.gradient.front().first;
  for (auto* blocks : {&curvature_, &convex_curvature_})
    std::erase_if(
        *blocks, [&](const discrete::Objective::Block& b) { return b.p == point && b.q == point; });
}

void ContactGaps::stiffen() {
  constexpr double factor = 4, most = 64;
  if (stiffness_ >= most * least_stiffness_) return;
  stiffness_ *= factor;
  for (State& state : state_) state.active = -1;
}

void ContactGaps::begin() {
  for (State& state : state_) state = {state.multiplier};
}

bool ContactGaps::choose_active() {
  bool changed = false;
  for (size_t k = 0; k < gaps_.size(); ++k) {
    const signed char active = gaps_[k].slides || pressure(k) > 0;
    changed |= std::exchange(state_[k].active, active) != active;
  }
  return base::on_any_rank(objective_.positions().comm(), changed);
}

std::pair<ContactGaps::Blocks, ContactGaps::Blocks> ContactGaps::blocks() const {
  std::pair<Blocks, Blocks> blocks({}, convex_curvature_);
  const auto add_share = [&](const Blocks& of, double share) {
    if (share == 0) return;
    for (const auto& [p, q, block] : of) blocks.first.push_back({p, q, share * block});
  };
  add_share(curvature_, curvature_share_);
  add_share(convex_curvature_, 1 - curvature_share_);
  const auto add_to = [](Blocks& to) {
    return [&](int32_t p, int32_t q, const Mat3& block) { to.push_back({p, q, block}); };
  };
  for (size_t k = 0; k < gaps_.size(); ++k) {
    if (!state_[k].active) continue;
    const LinearGap& gap = gaps_[k];
    const double weight = objective_.weights().elastic * gap.area * stiffness_;
    mechanics::visit_products(gap.gradient, weight, add_to(blocks.first));
    mechanics::visit_products(gap.lumped.empty() ? gap.gradient : gap.lumped, weight,
                              add_to(blocks.second));
  }
  return blocks;
}

template <class Pressure>
void ContactGaps::add_forces_of(Pressure&& of, Vec to) {
  std::vector<Vec3> force(moved_.size(), Vec3::Zero());
  for (size_t k = 0; k < gaps_.size(); ++k) {
    if (!state_[k].active) continue;
    const double weight = objective_.weights().elastic * gaps_[k].area * of(k);
    for (const auto& [p, gradient] : gaps_[k].gradient) force[p] += weight * gradient;
  }
  objective_.positions().restrict_to_owned(force, forces_);
  check(VecAXPY(to, 1.0, forces_));
}

void ContactGaps::add_forces(Vec to) {
  add_forces_of([&](size_t k) { return pressure(k); }, to);
}

void ContactGaps::add_change_of_forces(Vec to) {
  add_forces_of([&](size_t k) { return -stiffness_ * state_[k].closing; }, to);
}

void ContactGaps::set_direction(Vec direction) {
  objective_.positions().scatter_to_local(direction, moved_);
  for (size_t k = 0; k < gaps_.size(); ++k) state_[k].closing = change(gaps_[k], moved_);
}

void ContactGaps::set_changes(std::span<const double> changes) {
  for (size_t k = 0; k < gaps_.size(); ++k) state_[k].closing = changes[constraint(k)];
}

double ContactGaps::line_search(double slope, double curvature) const {
  constexpr int max_pieces = 30;
  constexpr double flat = 1e-3;
  double share = 0, low = 0, high = std::numeric_limits<double>::infinity(), first = 0;
  for (int n = 0; n < max_pieces; ++n) {
    double sums[2] = {0, 0};
    for (size_t k = 0; k < gaps_.size(); ++k) {
      const double closing = state_[k].closing;
      const double now = pressure(k) - share * stiffness_ * closing;
      if (!gaps_[k].slides && !(now > 0)) continue;
      const double weight = objective_.weights().elastic * gaps_[k].area;
      sums[0] -= weight * now * closing;
      sums[1] += weight * stiffness_ * closing * closing;
    }
    MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE, MPI_SUM, objective_.positions().comm());
    const double here = slope + share * curvature + sums[0], bend = curvature + sums[1];
    if (n == 0) first = here;
    if (std::abs(here) <= flat * std::abs(first) || !(bend > 0)) break;
    (here < 0 ? low : high) = share;
    share -= here / bend;
    if (!(share > low && share < high)) share = std::isfinite(high) ? (low + high) / 2 : 2 * low;
  }
  return share;
}

void ContactGaps::move(double share) {
  for (State& state : state_) state.closed += share * state.closing;
}

double ContactGaps::move_multipliers() {
  double maximum = 0;
  for (size_t k = 0; k < gaps_.size(); ++k) {
    const double now = gaps_[k].slides ? pressure(k) : std::max(0.0, pressure(k));
    maximum = std::max(maximum, std::abs(now - state_[k].multiplier));
    state_[k].multiplier = now;
  }
  return base::max_over_ranks(objective_.positions().comm(), maximum / stiffness_);
}

std::vector<double> ContactGaps::multipliers() const {
  std::vector<double> multipliers;
  for (const State& state : state_) multipliers.push_back(state.multiplier);
  return multipliers;
}

void ContactGaps::set_multipliers(const std::vector<double>& to) {
  for (size_t k = 0; k < to.size(); ++k) state_[k].multiplier = to[k];
}

void ContactGaps::give_multipliers() {
  discrete::ContactPressures given(objective_.contact().size(), 0.0);
  for (size_t k = 0; k < gaps_.size(); ++k) given[constraint(k)] = state_[k].multiplier;
  objective_.contact().set_multipliers(std::move(given));
}

}  // namespace repose::solve
