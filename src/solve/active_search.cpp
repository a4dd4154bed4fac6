#include "repose/solve/active_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "active_region.h"
#include "repose/base/agreement.h"
#include "repose/base/error.h"
#include "repose/base/geometry.h"
#include "repose/discrete/gather.h"
#include "repose/discrete/natural_rows.h"
#include "repose/model/motion.h"
#include "repose/solve/problem.h"

namespace repose::solve {

using base::check;
using base::pick;

namespace {

constexpr double newton_steps = 2;  // as the Minimiser's: the estimate is so many Newton steps long
constexpr double own_share = 0.5;   // of the accuracy, for the search in the region
// What the fit of displacements on heads gives: they fall by exp(−0.7) over a thickness.
constexpr double decay = 0.7;
constexpr double border_share = 0.4;  // of the accuracy, the displacement at the first border
constexpr double narrowest = 3;       // thicknesses, of a region and of half a band
constexpr double least_growth = 1, most_growth = 6;  // thicknesses
constexpr double finer = 0.2;    // of own_share, in a region that grew: what it freed has to go
constexpr double quantum = 0.5;  // thicknesses: reaches are whole multiples, on any ranks
constexpr double infinity = std::numeric_limits<double>::infinity();

/// How many thicknesses a displacement needs to fall by a factor.
double reach_of(double factor) {
  return quantum * std::ceil(std::log(std::max(factor, 1.0)) / decay / quantum);
}

/// What rank 0 decides before anything is shared out; the same on all ranks.
struct Plan {
  bool go = false;
  double reach = 0;    // thicknesses, of the first region
  double largest = 0;  // distance of a column
  int64_t columns = 0;
};

/// A model shared out with the objective on it, and its points' natural rows.
struct Shared {
  discrete::Part part;
  discrete::Positions positions;
  discrete::NaturalRows natural;
  base::VecHandle displacement, gradient;

  Shared(MPI_Comm comm, const model::Model& model)
      : part(discrete::distribute(comm, model)),
        positions(comm, part),
        natural(comm, part),
        displacement(positions.make_vector()),
        gradient(positions.make_vector()) {}

  /// 1 at the unknowns of flagged points, else 0. `flags` [N] on rank 0.
  base::VecHandle mask(const std::vector<char>& flags) const {
    std::vector<Vec3> all(flags.size());
    for (size_t i = 0; i < flags.size(); ++i) all[i] = Vec3::Constant(flags[i] ? 1 : 0);
    base::VecHandle v = positions.make_vector();
    positions.keep_owned(natural.owned(base::scatter(positions.comm(), all)), v);
    return v;
  }
  /// Goes to `position` [N] on rank 0, at a load.
  void go_to(const std::vector<Vec3>& position, double load) {
    natural.take(base::scatter(positions.comm(), position), positions, displacement);
    positions.set_load(load);
  }
};

base::VecHandle masked(Vec v, Vec mask) {
  base::VecHandle kept;
  check(VecDuplicate(v, kept.out()));
  check(VecPointwiseMult(kept, v, mask));
  return kept;
}

/// Sum of the Euclidean norms of the 3-vectors of `v`. Collective.
double sum_of_blocks(Vec v) {
  PetscInt size = 0;
  const PetscScalar* values = nullptr;
  check(VecGetLocalSize(v, &size));
  check(VecGetArrayRead(v, &values));
  double sum = 0, all = 0;
  for (PetscInt k = 0; k + 2 < size; k += 3) sum += Eigen::Map<const Vec3>(values + k).norm();
  check(VecRestoreArrayRead(v, &values));
  MPI_Comm comm = PetscObjectComm(reinterpret_cast<PetscObject>(v));
  MPI_Allreduce(&sum, &all, 1, MPI_DOUBLE, MPI_SUM, comm);
  return all;
}
/// What holding the border does.
struct Border {
  double force = 0;  // N, largest
  double error = 0;  // mm
};

class RegionSearch {
 public:
  RegionSearch(MPI_Comm comm, const model::Model& model, const Settings& settings,
               const Receiver& receive)
      : comm_(comm), model_(model), settings_(settings), receive_(receive) {}

  bool pays();
  const std::string& why() const { return why_; }  // it pays or does not, on rank 0
  Summary run(const Start& start, base::Stages& stages);

 private:
  bool first() const { return base::rank(comm_) == 0; }
  Plan make_plan();
  void rest(double reach, const Start& start);
  Start restricted(const Start& start) const;
  Settings settings_inside() const;
  void take(model::StepNumbers numbers, const model::StepRows& rows);
  void emit(model::StepNumbers& numbers, double border_error);
  double error_on_the_way();
  Border border();
  Border border(double width, double& passed_on);
  double growth(double error, double allowed) const;
  double correct(Shared& band, const Submodel& part, Vec step, Vec mask);
  void go_to(const std::vector<Vec3>& position, double load);
  double outside_force() { return discrete::largest_block(masked(whole_->gradient, outside_)); }

  MPI_Comm comm_;
  const model::Model& model_;
  const Settings& settings_;
  const Receiver& receive_;

  Plan plan_;
  std::string why_;
  std::optional<ActiveRegion> region_;  // on rank 0
  std::optional<Shared> whole_;
  std::optional<discrete::Objective> objective_;  // of the whole
  double value_ = 0;                              // of the objective
  base::VecHandle outside_;                       // 1 at the whole's unknowns that are held
  double reach_ = 0;                              // thicknesses, of the region
  double width_ = narrowest;    // thicknesses, of the band on either side of its border
  Submodel part_;               // on rank 0
  std::vector<Vec3> position_;  // [N] on rank 0, of the state reached
  double load_ = 0;             // of that state
  std::optional<model::StepNumbers> pending_;  // of the last step, not handed on yet
  double quiet_ = 0;  // N, largest force outside in the initial state: rounding
  Border measured_;   // last, for the steps on the way
  Summary summary_;
};

Plan RegionSearch::make_plan() {
  constexpr int64_t fewest_points = 10000;  // below, nothing is saved
  constexpr double largest_share = 0.6;     // of the points
  const int64_t soft = model::count(model_).soft;
  const bool asked = settings_.extent == Extent::region;
  Plan plan;
  why_ = fmt::format("fewer than {} points of soft tissue", fewest_points);
  if (!asked && soft < fewest_points) return plan;
  region_.emplace(model_, initial_forces(model_));
  why_ = "nothing moves and all is at rest";
  if (region_->moved() + region_->uneasy() == 0) return plan;
  const double uneasy_share =
      static_cast<double>(region_->uneasy()) / static_cast<double>(region_->columns());
  if (asked && uneasy_share > largest_share)
    base::refuse(
        "-active_region on: {} of {} columns are not at rest before the bones move, so little can "
        "be left out; leave the option out",
        region_->uneasy(), region_->columns());
  const double travel = model::PrescribedMotion(model_).largest_travel(model_);
  const double size = std::max(travel, region_->uneasy() > 0 ? 1.0 : 0.0);  // mm
  plan.reach = std::max(narrowest, reach_of(size / (border_share * settings_.path.accuracy)));
  plan.largest = region_->largest();
  plan.columns = region_->columns();
  const std::vector<char> active = region_->points(0, plan.reach);
  const auto unknown = std::count(active.begin(), active.end(), 1);
  why_ = fmt::format("{} of {} points of soft tissue feel what moves", unknown, soft);
  plan.go = asked || static_cast<double>(unknown) <= largest_share * static_cast<double>(soft);
  return plan;
}

bool RegionSearch::pays() {
  base::on_first_rank(comm_, [&] { plan_ = make_plan(); });
  static_assert(std::is_trivially_copyable_v<Plan>);
  MPI_Bcast(&plan_, sizeof plan_, MPI_BYTE, 0, comm_);
  return plan_.go;
}

Settings RegionSearch::settings_inside() const {
  Settings settings = settings_;
  settings.extent = Extent::whole;
  if (settings_.under_way)
    settings.under_way = [this](double load, const Look&) { settings_.under_way(load, nullptr); };
  settings.path.accuracy *= own_share;
  return settings;
}

Start RegionSearch::restricted(const Start& start) const {
  if (!start.guess) return {};
  const std::vector<Vec3> all = discrete::gather_points(comm_, start.position);
  return {base::scatter(comm_, first() ? pick(all, part_.point_row) : all), start.guess};
}

/// Finds the rest position of the region of a reach, from `start` or, later, the present state.
void RegionSearch::rest(double reach, const Start& start) {
  reach_ = std::min(reach, plan_.largest + quantum);
  std::vector<char> held;
  base::on_first_rank(comm_, [&] {
    part_ = submodel(model_, region_->points(0, reach_));
    held = region_->points(reach_, infinity);
  });
  outside_ = whole_->mask(held);
  if (!pending_) quiet_ = outside_force();
  Settings settings = settings_inside();
  Start from = restricted(start);
  if (pending_) {
    settings.path.start_load = 1;
    settings.path.accuracy *= finer;
    from = {base::scatter(comm_, first() ? pick(position_, part_.point_row) : position_)};
  }
  base::Stages unused(comm_);
  const Summary found =
      find_repose(comm_, part_.model, settings, from, unused,
                  [this](const auto& numbers, const auto& rows) { take(numbers, rows); });
  const PathOutcome before = summary_.path;
  const bool again = summary_.region->rounds++ > 0;
  summary_.path = found.path;
  summary_.path.iterations += before.iterations;
  summary_.path.halvings += before.halvings;
  if (again) {
    summary_.path.steps = before.steps;
    summary_.path.leapt = before.leapt;
  }
  summary_.unknowns = found.unknowns;
  summary_.evaluations += found.evaluations;
  summary_.assemblies += found.assemblies;
}

void RegionSearch::go_to(const std::vector<Vec3>& position, double load) {
  whole_->go_to(position, load);
  value_ = objective_->evaluate(whole_->displacement, whole_->gradient);
}

/// A step of the search in the region, as one of the whole.
void RegionSearch::take(model::StepNumbers numbers, const model::StepRows& rows) {
  const std::vector<Vec3> places = discrete::gather_points(comm_, rows.position);
  if (first()) {
    position_ = model_.points.position;
    for (size_t k = 0; k < places.size(); ++k) position_[part_.point_row[k]] = places[k];
  }
  load_ = numbers.load;
  go_to(position_, load_);
  if (load_ < 1 && numbers.converged) return emit(numbers, error_on_the_way());
  if (pending_) {
    numbers.iterations += pending_->iterations;
    numbers.evaluations += pending_->evaluations;
    numbers.seconds += pending_->seconds;
  }
  pending_ = numbers;
}

void RegionSearch::emit(model::StepNumbers& numbers, double border_error) {
  const double wanted = settings_.path.accuracy;
  measure(*objective_, numbers);
  numbers.objective = value_;
  numbers.gradient_max = discrete::largest_block(whole_->gradient);
  numbers.displacement_error += border_error;
  if (numbers.converged && numbers.displacement_error > wanted) {
    numbers.converged = false;
    numbers.reason += ", but the tissue left out would feel more than the accuracy";
  }
  receive_(numbers, whole_->natural.rows(*objective_));
}

double RegionSearch::error_on_the_way() {
  constexpr double alike = 10;  // forces, whose effects are in proportion
  const double force = outside_force();
  if (force <= alike * quiet_) return 0;
  if (measured_.force == 0 || force > alike * measured_.force) measured_ = border();
  return measured_.error * force / measured_.force;
}

/// The estimate on the narrowest band that says enough, beginning with the one that did last; none
/// at a state that is not at rest anyhow.
Border RegionSearch::border() {
  if (pending_ && !std::isfinite(pending_->displacement_error)) return {outside_force(), 0};
  constexpr double most = 0.5;  // of the force may be passed on
  for (;; width_ *= 2) {
    double passed_on = 0;
    Border found = border(width_, passed_on);
    if (passed_on <= most || width_ > plan_.largest) {
      found.error /= 1 - std::min(passed_on, most);
      return found;
    }
  }
}

/// Thicknesses by which the region is to grow where its border may err by no more than `allowed`
/// mm. Tissue whose band had to be some times as wide carries displacements as many times as far.
double RegionSearch::growth(double error, double allowed) const {
  return width_ / narrowest * std::clamp(reach_of(error / allowed), least_growth, most_growth);
}

/// The Newton step of the forces on the held points, on a band of columns: its largest block with
/// the safety factor, and how much of the forces it passes on to free points around the band.
Border RegionSearch::border(double width, double& passed_on) {
  Submodel part;
  std::vector<char> unknown, held;
  base::on_first_rank(comm_, [&] {
    unknown = region_->points(reach_ - width, reach_ + width);
    const std::vector<char> beyond = region_->points(reach_, infinity);
    part = submodel_at(model_, unknown, position_);
    held = pick(beyond, part.point_row);
  });
  Border found;
  found.force = outside_force();
  Shared band(comm_, part.model);
  if (found.force == 0 || band.part.total_unknowns == 0) return found;
  Problem problem(band.positions, settings_.weights, false);
  band.go_to(first() ? pick(position_, part.point_row) : position_, 1);
  problem.function().evaluate(band.displacement, band.gradient);
  check(VecPointwiseMult(band.gradient, band.gradient, band.mask(held)));
  const base::VecHandle step = band.positions.make_vector();
  const bool convex = problem.solver().solve(band.displacement, band.gradient, step, 1e-2);
  found.error = convex ? newton_steps * discrete::largest_block(step) : infinity;
  for (char& flag : unknown) flag = !flag;
  passed_on = correct(band, part, step, whole_->mask(unknown)) / sum_of_blocks(band.gradient);
  return found;
}

/// Takes the step back in the whole model; returns the sum of the changes of force (N) where `mask`
/// is.
double RegionSearch::correct(Shared& band, const Submodel& part, Vec step, Vec mask) {
  check(VecAXPY(band.displacement, -1.0, step));
  band.positions.update(band.displacement);
  const std::span<const Vec3> local = band.positions.local();
  const std::vector<Vec3> places = discrete::gather_points(comm_, band.natural.natural(local));
  std::vector<Vec3> corrected = position_;
  for (size_t k = 0; k < places.size(); ++k) corrected[part.point_row[k]] = places[k];
  base::VecHandle before;
  check(VecDuplicate(whole_->gradient, before.out()));
  check(VecCopy(whole_->gradient, before));
  go_to(corrected, load_);
  check(VecAXPY(before, -1.0, whole_->gradient));
  go_to(position_, load_);
  return sum_of_blocks(masked(before, mask));
}

Summary RegionSearch::run(const Start& start, base::Stages& stages) {
  whole_.emplace(comm_, model_);
  objective_.emplace(whole_->positions, settings_.weights);
  stages.end("distribute");
  summary_.region.emplace();
  summary_.region->columns = plan_.columns;
  go_to(first() ? model_.points.position : std::vector<Vec3>(), 0);
  rest(plan_.reach, start);
  Border held = border();
  for (;;) {
    const double allowed = settings_.path.accuracy - pending_->displacement_error;
    if (!summary_.path.complete() || held.error <= allowed || reach_ >= plan_.largest) break;
    rest(reach_ + growth(held.error, allowed), {});
    held = border();
  }
  emit(*pending_, held.error);
  summary_.last = *pending_;
  summary_.path.last.displacement_error = pending_->displacement_error;
  summary_.path.last.converged = summary_.path.last.converged && pending_->converged;
  base::on_first_rank(comm_, [&] { summary_.region->active = region_->columns(reach_); });
  MPI_Bcast(&summary_.region->active, 1, MPI_INT64_T, 0, comm_);
  summary_.region->force = held.force;
  summary_.region->error = held.error;
  stages.end("solve");
  return summary_;
}

}  // namespace

RegionChoice choose_region(MPI_Comm comm, const model::Model& model, const Settings& settings) {
  if (settings.extent == Extent::whole) return {false, "no part of it is to be left out"};
  const Receiver unheard;
  RegionSearch search(comm, model, settings, unheard);
  const bool part = search.pays();
  return {part, search.why()};
}

std::optional<Summary> find_in_region(MPI_Comm comm, const model::Model& model,
                                      const Settings& settings, const Start& start,
                                      base::Stages& stages, const Receiver& receive) {
  if (settings.extent == Extent::whole) return {};
  RegionSearch search(comm, model, settings, receive);
  if (!search.pays()) return {};
  return search.run(start, stages);
}

}  // namespace repose::solve
