#include "other_rest_search.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "pierced_columns.h"
#include "repose/base/agreement.h"
#include "repose/base/collective.h"

namespace repose::solve {

using base::check;

/// A point that presses on a body near an edge, and the gap that it would have from the side round
/// the edge.
struct OtherSide {
  mechanics::LinearGap gap;  ///< of this rank
  double work;               ///< N mm, of the contact's force over the gap
  /// By how much softer than its neighborhood held still the point would have to be for the other
  /// side to have as much energy.
  double softness;
};

namespace {

/// [local points] Blocks on the diagonal of the semidefinite Hessian without contact. Collective.
std::vector<Mat3> diagonal_blocks(discrete::Tangent& tangent, Vec displacement, size_t points) {
  std::vector<Mat3> blocks(points, Mat3::Zero());
  tangent.assemble(displacement);
  tangent.visit_spd_blocks([&](int32_t p, int32_t q, const Mat3& block) {
    if (p == q) blocks[p] += block;
  });
  return blocks;
}

/// Let go, a point with compliance s C and the contact's force f moves by −s C f and has ½ s fᵀCf
/// less energy; to stay outside the other plane, of gap g and normal m, it must have
/// ½ (s mᵀCf − g)² / (s mᵀCm) more. Returns the s at which they are equal.
double softness(const mechanics::LinearGap& other, const Mat3& compliance, const Vec3& force) {
  const Vec3& m = other.gradient.front().second;
  const Vec3 moved = compliance * force;
  const double reach = std::sqrt(force.dot(moved) * m.dot(compliance * m)) - m.dot(moved);
  return -other.gap / reach;
}

/// Returns true for sides of one constraint whose normals are less than 45° apart.
bool alike(const OtherSide& a, const OtherSide& b) {
  constexpr double cosine = 0.7;
  return a.gap.constraint == b.gap.constraint &&
         a.gap.gradient.front().second.dot(b.gap.gradient.front().second) > cosine;
}

/// Returns the sides, of this rank's points, that may have less energy than those pressed on at
/// `displacement`, where the objective was updated last: in a model of one point, whose compliance
/// is a few times the inverse of its block of the Hessian. Softness ascends; of sides of a
/// constraint with normals less than 45° apart it is the softest. Sides are left out over which the
/// contact's force does hardly any work of the `value`. Collective.
std::vector<OtherSide> promising_sides(discrete::Objective& objective, discrete::Tangent& tangent,
                                       Vec displacement, double value) {
  constexpr double softest = 4, least_work = 1e-4;
  const mechanics::BodyContact& contact = objective.contact().bodies();
  const auto position = objective.positions().local();
  const std::vector<Mat3> blocks = diagonal_blocks(tangent, displacement, position.size());
  std::vector<OtherSide> found;
  for (mechanics::LinearGap& gap : contact.other_sides(position)) {
    const size_t c = gap.constraint;
    const double force = contact.multipliers()[c] * gap.area, work = -gap.gap * force;
    if (work < least_work * std::abs(value)) continue;
    const double s =
        softness(gap, blocks[gap.gradient.front().first].inverse(), force * contact.normal(c));
    if (s > 0 && s < softest) found.push_back({std::move(gap), work, s});
  }
  std::ranges::sort(found, {}, &OtherSide::softness);
  std::vector<OtherSide> apart;
  for (OtherSide& side : found)
    if (std::ranges::none_of(apart, [&](const OtherSide& other) { return alike(side, other); }))
      apart.push_back(std::move(side));
  return apart;
}

/// Returns true if an energy is less than that of the rest position so far, by more than rounding.
bool is_less(double value, double value_here) {
  constexpr double rounding = 1e-6;
  return value < value_here - rounding * std::abs(value_here);
}

}  // namespace

OtherRestSearch::OtherRestSearch(discrete::Objective& objective, discrete::Tangent& tangent,
                                 ContactPrograms& programs, ContactDescent& descent)
    : objective_(objective),
      tangent_(tangent),
      programs_(programs),
      descent_(descent),
      prediction_(objective.positions().make_vector()),
      start_(objective.positions().make_vector()) {}

void OtherRestSearch::begin(Vec prediction) { check(VecCopy(prediction, prediction_)); }

/// Returns the bodies on which points press or slide near edges, ascending. Collective.
std::vector<int32_t> OtherRestSearch::touched_near_edges(Vec displacement) {
  discrete::Positions& positions = objective_.positions();
  positions.update(displacement);
  mechanics::BodyContact& contact = objective_.contact().bodies();
  contact.update_gaps(positions.local());
  std::set<int32_t> here = contact.bodies_near_edges(positions.local());
  const std::vector<int32_t> all =
      base::gather(positions.comm(), std::vector<int32_t>(here.begin(), here.end()));
  here.insert(all.begin(), all.end());
  std::vector<int32_t> bodies(here.begin(), here.end());
  base::broadcast(positions.comm(), bodies);
  return bodies;
}

/// Takes displacements of this rank's points as another rest position of a state of the skin: finds
/// the largest distance and its place. Collective.
OtherRest OtherRestSearch::compare_skins(Vec displacement, std::vector<Vec3> other) {
  discrete::Positions& positions = objective_.positions();
  const model::Points& points = positions.part().model.points;
  positions.update(displacement);
  OtherRest found;
  for (int64_t i = 0; i < positions.part().owned_points; ++i) {
    const double apart = (positions.local()[i] - points.position[i] - other[i]).norm();
    if (points.layer[i] != 0 || apart <= found.distance) continue;
    found.distance = apart;
    found.place = points.position[i];
  }
  found.distance = base::max_over_ranks_with(positions.comm(), found.distance, found.place);
  found.displacement = std::move(other);
  return found;
}

/// Returns the displacements of this rank's points in a state. Collective.
std::vector<Vec3> OtherRestSearch::displacements(Vec state) {
  discrete::Positions& positions = objective_.positions();
  positions.update(state);
  std::vector<Vec3> found(positions.part().owned_points);
  for (size_t i = 0; i < found.size(); ++i)
    found[i] = positions.local()[i] - positions.part().model.points.position[i];
  return found;
}

/// Returns how much tissue instruments are in, at a state. Collective.
int64_t OtherRestSearch::pierced(Vec state) {
  objective_.positions().update(state);
  return find_columns_in_instruments(objective_).count();
}

/// Settles without points that are released from a body: these have less energy than the rest
/// position that it is to be compared with. Collective.
Outcome OtherRestSearch::settle(Vec displacement, double accuracy) {
  constexpr int max_rounds = 4;
  const int times = descent_.times();
  Outcome outcome = descent_.settle(displacement, accuracy, max_rounds, true);
  descent_.stiffen(times);
  mechanics::BodyContact& contact = objective_.contact().bodies();
  if (base::on_any_rank(objective_.positions().comm(), contact.count_released() > 0)) {
    contact.restore_released();
    outcome.converged = false;
  }
  return outcome;
}

/// Searches for the rest position that quadratic programs lead to from start_, without rounded
/// bodies. Where it is another one, `displacement` becomes that of less energy, and `outcome`
/// states the distance to the other; the multipliers at `displacement` are `here`. Collective.
void OtherRestSearch::consider(Vec displacement, const discrete::ContactPressures& here,
                               double accuracy, Outcome& outcome) {
  constexpr double apart = 0.2;  // mm, of skins, to count as another one of more energy
  int64_t iterations = 0;
  const End end = programs_.run(start_, accuracy, iterations);
  const bool less = is_less(programs_.value(), outcome.objective);
  OtherRest other = compare_skins(displacement, displacements(start_));
  const bool is_other = other.distance > (less ? 2 * accuracy : apart);
  Outcome there;
  if (is_other && less && end == End::reached)
    there = descent_.finish_reached(start_, accuracy, iterations);
  if (is_other && less && end == End::failed) there = settle(start_, accuracy);
  there.iterations += iterations;
  if (there.converged && is_less(there.objective, outcome.objective) &&
      pierced(start_) <= pierced(displacement)) {
    take_other(displacement, accuracy, std::move(there), outcome);
    return;
  }
  if (is_other && !less && end == End::reached && pierced(start_) == 0) {
    keep_farther(std::move(other), outcome);
    candidate_ = {objective_.positions().make_vector(), objective_.contact().multipliers()};
    check(VecCopy(start_, candidate_->displacement));
  }
  tangent_.change_contact().set_multipliers(here);
}

/// Evaluates a rest position, and takes its gaps. Collective.
OtherRestSearch::Rest OtherRestSearch::linearize(Vec displacement) {
  const double value = programs_.evaluate(displacement);
  const double energy = programs_.without_contact(value);
  programs_.linearize(displacement);
  return {value, energy, programs_.keep()};
}

/// Searches from `displacement` with one point beyond the other side of its body; ends in start_.
/// Fails where the augmented Lagrangian is no less there, which misses the energy by the square of
/// the gaps that are left. Collective; `side` is null on ranks that do not own the point.
OtherRestSearch::End OtherRestSearch::change_side(const OtherSide* side, Vec displacement,
                                                  const Rest& rest, double accuracy) {
  constexpr double promising = 0.2;  // of the work of the contact's force over the gap
  check(VecCopy(displacement, start_));
  programs_.restore(rest.linear);
  const double work = base::max_over_ranks(objective_.positions().comm(), side ? side->work : 0.0);
  const auto beyond = side ? std::span(&side->gap, 1) : std::span<const mechanics::LinearGap>();
  if (!programs_.step_with(beyond, start_)) return End::failed;
  if (programs_.evaluate_tissue(start_) > rest.energy + promising * work) return End::failed;
  int64_t iterations = 0;
  End end = programs_.go_on(start_, accuracy, iterations, 1);
  if (end == End::failed && is_less(programs_.value(), rest.value))
    end = programs_.go_on(start_, accuracy, iterations);
  const bool less = is_less(programs_.value(), rest.value);
  return end == End::reached && !less ? End::failed : end;
}

/// Lets points that press near an edge of a body go round it, one at a time, where that ends at
/// less energy, but for the constraints of this rank that were `tried`, to which it adds. The
/// position that is left is the outcome's other one. Returns whether there was one. Collective.
bool OtherRestSearch::change_sides(Vec displacement, double accuracy, std::set<size_t>& tried,
                                   Outcome& outcome) {
  constexpr int max_failed = 6;  // in a row
  constexpr double none = std::numeric_limits<double>::infinity();
  discrete::Positions& positions = objective_.positions();
  Rest rest = linearize(displacement);
  std::vector<OtherSide> sides = promising_sides(objective_, tangent_, displacement, rest.value);
  std::erase_if(sides, [&](const OtherSide& s) { return tried.contains(s.gap.constraint); });
  size_t next = 0;
  bool changed = false;
  for (int failed = 0; failed < max_failed; ++failed) {
    const discrete::ContactPressures here = objective_.contact().multipliers();
    const double softness = next < sides.size() ? sides[next].softness : none;
    const auto first = base::extreme_over_ranks(positions.comm(), softness, MPI_MINLOC);
    if (first.value == none) break;
    const bool mine = first.rank == base::rank(positions.comm());
    if (mine) tried.insert(sides[next].gap.constraint);
    const End end = change_side(mine ? &sides[next++] : nullptr, displacement, rest, accuracy);
    Outcome there;
    int64_t iterations = 0;
    if (end == End::reached) there = descent_.finish_reached(start_, accuracy, iterations);
    there.iterations += iterations;
    if (there.converged && is_less(there.objective, rest.value) &&
        pierced(start_) <= pierced(displacement)) {
      take_other(displacement, accuracy, there, outcome);
      rest = linearize(displacement);
      changed = true;
      failed = -1;
    } else {
      tangent_.change_contact().set_multipliers(here);
    }
    if (end == End::stopped) return false;
  }
  return changed;
}

/// Changes sides until that ends at no less energy. Returns whether there was a change. Collective.
bool OtherRestSearch::descend(Vec displacement, double accuracy, Outcome& outcome) {
  constexpr int max_passes = 3;  // after a change, other points may follow
  std::set<size_t> tried;
  int passes = 0;
  while (passes < max_passes && change_sides(displacement, accuracy, tried, outcome)) ++passes;
  return passes > 0;
}

/// Changes sides from a rest position that has hardly more energy, too, and takes the end of that
/// where it has less. Collective.
void OtherRestSearch::try_candidate(Vec displacement, double accuracy, Outcome& outcome) {
  constexpr double hardly = 0.015;  // of the energy
  const std::optional<Candidate> candidate = std::exchange(candidate_, {});
  if (!candidate) return;
  const discrete::ContactPressures here = objective_.contact().multipliers();
  tangent_.change_contact().set_multipliers(candidate->pressures);
  check(VecCopy(candidate->displacement, start_));
  Outcome there;
  const double more = programs_.evaluate(start_) - outcome.objective;
  const bool changed = more < hardly * std::abs(outcome.objective) &&
                       descend(candidate->displacement, accuracy, there);
  if (changed && is_less(there.objective, outcome.objective)) {
    check(VecCopy(candidate->displacement, start_));
    take_other(displacement, accuracy, std::move(there), outcome);
  } else {
    tangent_.change_contact().set_multipliers(here);
  }
}

void OtherRestSearch::find(Vec displacement, double accuracy, Outcome& outcome) {
  if (outcome.stopped) return;
  const std::vector<int32_t> bodies = outcome.converged && outcome.overlapped == 0
                                          ? touched_near_edges(displacement)
                                          : std::vector<int32_t>();
  if (!bodies.empty()) {
    const int64_t evaluated = objective_.evaluations();
    const discrete::ContactPressures here = objective_.contact().multipliers();
    check(VecCopy(prediction_, start_));
    descent_.slacken(start_);
    consider(displacement, here, chosen_to, outcome);
    descend(displacement, chosen_to, outcome);
    try_candidate(displacement, chosen_to, outcome);
    if (outcome.other) outcome.other->bodies = bodies;
    programs_.evaluate(displacement);
    evaluations_ += objective_.evaluations() - evaluated;
  }
  outcome = descent_.refine(displacement, accuracy, std::move(outcome));
  if (outcome.other && outcome.other->distance <= 2 * accuracy) outcome.other.reset();
}

void OtherRestSearch::keep_farther(OtherRest other, Outcome& outcome) {
  if (!outcome.other || outcome.other->distance < other.distance) outcome.other = std::move(other);
}

/// Takes start_, which ended in `there`, in place of `displacement`, which becomes another one.
void OtherRestSearch::take_other(Vec displacement, double accuracy, Outcome there,
                                 Outcome& outcome) {
  const auto keep = [&](std::vector<Vec3> displacements) {
    OtherRest other = compare_skins(start_, std::move(displacements));
    if (other.distance > 2 * accuracy) keep_farther(std::move(other), there);
  };
  keep(displacements(displacement));
  if (outcome.other) keep(std::move(outcome.other->displacement));
  there.iterations += outcome.iterations;
  outcome = std::move(there);
  check(VecCopy(start_, displacement));
}

}  // namespace repose::solve
