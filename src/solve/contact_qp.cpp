#include "contact_qp.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "repose/base/collective.h"

namespace repose::solve {

using base::check;
using discrete::Objective;
using mechanics::LinearGap;

namespace {

// mm: gaps beyond the first do not close in a step; beyond the second the exact distance serves.
constexpr double farthest = 5, smoothed_to = 1;

}  // namespace

ContactQp::ContactQp(discrete::Objective& objective, discrete::Tangent& tangent,
                     linear::TangentSolver& solver)
    : objective_(objective),
      tangent_(tangent),
      solver_(solver),
      stiffness_(objective.positions().part().model.contact.stiffness),
      moved_(objective.positions().local().size(), Vec3::Zero()),
      force_(objective.positions().make_vector()),
      left_(objective.positions().make_vector()),
      direction_(objective.positions().make_vector()),
      change_(objective.positions().make_vector()),
      response_(objective.positions().make_vector()) {}

void ContactQp::linearize(Vec displacement) {
  objective_.positions().update(displacement);
  objective_.place_bodies();
  gaps_ =
      objective_.body_contact().linear_gaps(objective_.positions().local(), farthest, smoothed_to);
  add_gaps();
}

void ContactQp::linearize(Vec displacement, double load, std::span<const Vec3> travel) {
  discrete::Positions& positions = objective_.positions();
  const double before = positions.load();
  positions.update(displacement);
  objective_.place_bodies();
  gaps_ = objective_.body_contact().linear_gaps(positions.local(), farthest, smoothed_to);
  const std::vector<mechanics::RigidBody> bodies = objective_.body_contact().bodies();
  positions.set_load(load);
  objective_.place_bodies();
  positions.set_load(before);
  positions.update(displacement);
  objective_.body_contact().carry(positions.local(), bodies, gaps_);
  objective_.place_bodies();
  add_gaps();
  for (size_t k = touching_; k < gaps_.size(); ++k)
    for (const auto& [p, gradient] : gaps_[k].gradient) gaps_[k].gap += gradient.dot(travel[p]);
}

void ContactQp::add_gaps() {
  touching_ = gaps_.size();
  objective_.cut_face_contact().update_gaps(objective_.positions().local());
  std::ranges::copy(objective_.cut_face_contact().linear_gaps(farthest), std::back_inserter(gaps_));
  take_multipliers();
  curvature_.clear(), convex_curvature_.clear();
  const double scale = objective_.weights().elastic;
  const auto touching = std::span(gaps_).first(touching_);
  for (const bool exact : {true, false})
    objective_.body_contact().for_each_curvature(
        touching, exact, [&](int64_t point, const Mat3& block) {
          const auto p = static_cast<int32_t>(point);
          (exact ? curvature_ : convex_curvature_).push_back({p, p, scale * block});
        });
  objective_.cut_face_contact().for_each_curvature(std::span(gaps_).subspan(touching_),
                                                   [&](int32_t p, int32_t q, const Mat3& block) {
                                                     curvature_.push_back({p, q, scale * block});
                                                   });
}

void ContactQp::replace(const LinearGap& by) {
  const auto bodies = std::span(gaps_).first(touching_);
  const auto gap = std::ranges::find(bodies, by.constraint, &LinearGap::constraint);
  if (gap == bodies.end()) return;
  *gap = by;
  multiplier_[gap - bodies.begin()] = 0;
  const int32_t point = by.gradient.front().first;
  for (auto* blocks : {&curvature_, &convex_curvature_})
    std::erase_if(*blocks, [&](const Objective::Block& b) { return b.p == point && b.q == point; });
}

void ContactQp::take_multipliers() {
  multiplier_.clear();
  for (size_t k = 0; k < gaps_.size(); ++k) {
    const auto from = k < touching_ ? objective_.body_contact().multipliers()
                                    : objective_.cut_face_contact().multipliers();
    multiplier_.push_back(from[gaps_[k].constraint]);
  }
}

void ContactQp::give_multipliers() {
  std::vector<double> body_contact(objective_.body_contact().multipliers().size(), 0.0),
      cut_faces(objective_.cut_face_contact().size(), 0.0);
  for (size_t k = 0; k < gaps_.size(); ++k)
    (k < touching_ ? body_contact : cut_faces)[gaps_[k].constraint] = multiplier_[k];
  objective_.body_contact().set_multipliers(body_contact);
  objective_.cut_face_contact().set_multipliers(cut_faces);
}

double ContactQp::pressure(size_t k) const {
  return multiplier_[k] - stiffness_ * (gaps_[k].gap + closed_[k]);
}

double ContactQp::change(const LinearGap& gap, std::span<const Vec3> moved) const {
  double change = 0;
  for (const auto& [p, gradient] : gap.gradient) change += gradient.dot(moved[p]);
  return change;
}

bool ContactQp::choose_active() {
  std::vector<char> active(gaps_.size());
  for (size_t k = 0; k < gaps_.size(); ++k) active[k] = gaps_[k].slides || pressure(k) > 0;
  int changed = active != active_;
  MPI_Allreduce(MPI_IN_PLACE, &changed, 1, MPI_INT, MPI_MAX, objective_.positions().comm());
  active_ = std::move(active);
  return changed;
}

void ContactQp::set_blocks() {
  std::vector<Objective::Block> exact = curvature_, convex = convex_curvature_;
  const auto add_to = [](std::vector<Objective::Block>& blocks) {
    return [&](int32_t p, int32_t q, const Mat3& block) { blocks.push_back({p, q, block}); };
  };
  for (size_t k = 0; k < gaps_.size(); ++k) {
    if (!active_[k]) continue;
    const double weight = objective_.weights().elastic * gaps_[k].area * stiffness_;
    const LinearGap& gap = gaps_[k];
    mechanics::visit_products(gap.gradient, weight, add_to(exact));
    mechanics::visit_products(gap.lumped.empty() ? gap.gradient : gap.lumped, weight,
                              add_to(convex));
  }
  tangent_.set_contact(std::move(exact), std::move(convex));
  solver_.preconditioner().update_contact();
}

void ContactQp::add_pushes(std::span<const double> pressure, Vec to) {
  std::vector<Vec3> push(moved_.size(), Vec3::Zero());
  for (size_t k = 0; k < gaps_.size(); ++k) {
    if (!active_[k]) continue;
    const double weight = objective_.weights().elastic * gaps_[k].area * pressure[k];
    for (const auto& [p, gradient] : gaps_[k].gradient) push[p] += weight * gradient;
  }
  objective_.positions().restrict_to_owned(push, response_);
  check(VecAXPY(to, 1.0, response_));
}

double ContactQp::move_multipliers() {
  double maximum = 0;
  for (size_t k = 0; k < gaps_.size(); ++k) {
    const double now = gaps_[k].slides ? pressure(k) : std::max(0.0, pressure(k));
    maximum = std::max(maximum, std::abs(now - multiplier_[k]));
    multiplier_[k] = now;
  }
  return base::max_over_ranks(objective_.positions().comm(), maximum / stiffness_);
}

/// Where the function is least along the direction: a piecewise quadratic one, `slope` and
/// `curvature` without its gaps.
double ContactQp::line_search(double slope, double curvature) {
  constexpr int max_pieces = 30;
  constexpr double flat = 1e-3;
  double share = 0, low = 0, high = std::numeric_limits<double>::infinity(), first = 0;
  for (int n = 0; n < max_pieces; ++n) {
    double sums[2] = {0, 0};
    for (size_t k = 0; k < gaps_.size(); ++k) {
      const double now = pressure(k) - share * stiffness_ * closing_[k];
      if (!gaps_[k].slides && !(now > 0)) continue;
      const double weight = objective_.weights().elastic * gaps_[k].area;
      sums[0] -= weight * now * closing_[k];
      sums[1] += weight * stiffness_ * closing_[k] * closing_[k];
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

/// Minimizes the augmented Lagrangian of the present multipliers from `step`: Newton steps on its
/// active sets, with the least along each.
bool ContactQp::minimize(Vec displacement, Vec slope, double tolerance, Vec step) {
  constexpr int max_sets = 30;
  constexpr double coarse = 0.1, share_left = 0.1;  // of a linear system; of the step
  bool full = false;                                // the latest step was not shortened
  for (int set = 0; set < max_sets; ++set) {
    const bool changed = choose_active();
    if (full && !changed) return true;
    if (changed) set_blocks();
    check(VecCopy(force_, left_));
    check(VecAXPY(left_, 1.0, slope));
    check(VecScale(left_, -1.0));
    PetscReal along = 0, curvature = 0;
    std::vector<double> acting(gaps_.size());
    for (size_t k = 0; k < gaps_.size(); ++k) acting[k] = pressure(k);
    add_pushes(acting, left_);
    const bool convex = solver_.solve(displacement, left_, direction_, coarse);
    if (!convex || !solver_.finished()) return false;
    objective_.positions().scatter_to_local(direction_, moved_);
    for (size_t k = 0; k < gaps_.size(); ++k) {
      closing_[k] = change(gaps_[k], moved_);
      acting[k] = -stiffness_ * closing_[k];
    }
    solver_.product_of_solution(left_, change_);
    add_pushes(acting, change_);  // H δ without the stiffness of gaps
    check(VecDot(change_, direction_, &curvature));
    PetscReal held = 0;
    check(VecDot(force_, direction_, &along));
    check(VecDot(slope, direction_, &held));
    const double share = line_search(along + held, curvature);
    full = std::abs(share - 1) <= coarse;
    check(VecAXPY(step, share, direction_));
    check(VecAXPY(force_, share, change_));
    for (size_t k = 0; k < gaps_.size(); ++k) closed_[k] += share * closing_[k];
    const double moved = share * discrete::largest_block(direction_);
    if (moved <= std::max(tolerance, share_left * discrete::largest_block(step))) return true;
  }
  return false;
}

/// Rounds of minimizations and new multipliers.
bool ContactQp::search(Vec displacement, Vec slope, double tolerance, Vec step) {
  constexpr int max_rounds = 3;  // the next program goes on with the multipliers
  constexpr double share = 0.1;  // of the step
  check(VecSet(step, 0));
  check(VecSet(force_, 0));
  closed_.assign(gaps_.size(), 0.0);
  closing_.assign(gaps_.size(), 0.0);
  active_.assign(gaps_.size(), 2);  // none chosen yet
  tangent_.assemble(displacement);
  for (int round = 0; round < max_rounds; ++round) {
    if (!minimize(displacement, slope, tolerance, step)) return false;
    const double changed = move_multipliers();
    if (changed <= std::max(tolerance, share * discrete::largest_block(step))) break;
  }
  return true;
}

bool ContactQp::solve(Vec displacement, Vec slope, double tolerance, Vec step) {
  const std::vector<double> multiplier = multiplier_;
  bool found = search(displacement, slope, tolerance, step);
  reduced_ = !found;
  if (reduced_) {
    multiplier_ = multiplier;
    curvature_ = convex_curvature_;
    found = search(displacement, slope, tolerance, step);
  }
  if (!found && tangent_.limit_slopes(true)) {
    multiplier_ = multiplier;
    found = search(displacement, slope, tolerance, step);
    tangent_.limit_slopes(false);
  }
  if (found) give_multipliers();
  return found;
}

}  // namespace repose::solve
