#include "repose/solve/repose.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>

#include "contact_search.h"
#include "exact_penetration.h"
#include "pierced_columns.h"
#include "repose/base/agreement.h"
#include "repose/base/collective.h"
#include "repose/base/log.h"
#include "repose/discrete/natural_rows.h"
#include "repose/solve/force_search.h"
#include "repose/solve/problem.h"
#include "repose/solve/stability.h"
#include "rest_derivatives.h"

namespace repose::solve {

using base::check;
using model::VolumeTerm;

namespace {

/// Computes the energies and errors of a state.
void measure(discrete::Objective& objective, model::StepNumbers& numbers) {
  const mechanics::Totals totals = objective.totals();
  const mechanics::Weights& weights = objective.weights();
  const bool solid = objective.positions().part().solid;
  if (weights.volume == VolumeTerm::penalty) numbers.bulk_modulus = weights.volume_weight;
  numbers.f_e = totals.term_energy +
                (solid ? totals.solid_energy + totals.fixed_energy : totals.spring_energy);
  numbers.potential = objective.potential();
  double force = 0;
  for (const Vec3& f : objective.residual_force()) force += f.norm();
  numbers.f_f = base::sum_over_ranks(objective.positions().comm(), force);
  numbers.f_v = totals.volume_squares;
  numbers.penalty = numbers.bulk_modulus * totals.penalty_unit;
  numbers.volume_error_max = totals.volume_error_max;
  numbers.inverted_prisms = totals.inverted;
  if (objective.positions().part().contact) {
    numbers.penetration = objective.contact().penetration();
    numbers.contact_energy = objective.contact_value();
  }
}

model::StepNumbers numbers_of(discrete::Objective& objective, const Settings& settings,
                              const Outcome& outcome, double load) {
  model::StepNumbers n;
  n.load = load;
  n.functional = settings.functional;
  n.volume = settings.weights.volume;
  n.lambda = settings.weights.elastic;
  measure(objective, n);
  // What is fixed stores energy, too, that no search includes.
  const bool whole = objective.positions().part().solid;
  const double contact = std::isfinite(n.contact_energy) ? n.contact_energy : 0;
  n.objective = whole ? n.f_e + n.potential + contact : outcome.objective;
  n.gradient_max = outcome.gradient_max;
  n.displacement_error = outcome.displacement_error;
  n.iterations = outcome.iterations;
  n.reason = outcome.reason;
  n.converged = outcome.converged && !(outcome.stopped && load < 1);
  return n;
}

/// Shows each iteration on a terminal, prints it where that is requested, and ends the search where
/// a signal or the time limit wants it.
class Watcher {
 public:
  Watcher(MPI_Comm comm, const Settings& settings)
      : progress_(comm),
        interrupt_(settings.interrupt),
        abandoned_(settings.abandoned),
        accuracy_(settings.path.accuracy),
        activity_(settings.activity),
        prints_(settings.monitor && base::rank(comm) == 0) {}
  bool operator()(const Iteration& i) {
    const std::string to_go = std::isfinite(i.millimeters_to_go) && i.millimeters_to_go > 0
                                  ? fmt::format("{:.3g} mm to go", i.millimeters_to_go)
                                  : std::string("far from rest");
    if (prints_) print(i, to_go);
    progress_.show(fmt::format("{}load {:.3f}  iteration {}  objective {:.6g} N mm  largest force "
                               "{:.3g} N  {}",
                               activity_, i.load, i.number, i.objective, i.largest_force, to_go),
                   done(i));
    if (on_iteration_) on_iteration_(i);
    if (abandoned_ && abandoned_()) return false;
    return !(interrupt_ && interrupt_->requested());
  }
  void on_iteration(std::function<void(const Iteration&)> work) { on_iteration_ = std::move(work); }

 private:
  /// Share of the way: the loads reached, and of the next one the orders of magnitude that its
  /// search has taken off the distance.
  double done(const Iteration& i) {
    if (i.load != load_ || i.number == 0) {
      if (i.load > load_) reached_ = load_;  // else a step was refused
      load_ = i.load;
      farthest_ = nearest_ = i.millimeters_to_go;
    }
    if (!std::isfinite(farthest_)) farthest_ = i.millimeters_to_go;
    nearest_ = std::min(nearest_, i.millimeters_to_go);
    const bool known = std::isfinite(farthest_) && farthest_ > accuracy_ && nearest_ > 0;
    const double searched =
        known ? std::log(farthest_ / nearest_) / std::log(farthest_ / accuracy_) : 0;
    return reached_ + (load_ - reached_) * std::clamp(searched, 0.0, 0.99);
  }
  void print(const Iteration& i, const std::string& to_go) {
    progress_.clear();
    fmt::print("  {:8.2f} s  load {:.4f}  iteration {:4d}  {:6d} evaluations  {}\n",
               MPI_Wtime() - begin_, i.load, i.number, i.evaluations, to_go);
    std::fflush(stdout);
  }

  base::Progress progress_;
  base::Interrupt* interrupt_;
  std::function<bool()> abandoned_;
  std::function<void(const Iteration&)> on_iteration_;
  double accuracy_, load_ = 0, reached_ = 0;
  double farthest_ = 0, nearest_ = 0;  // mm, in this search
  std::string activity_;
  bool prints_;
  double begin_ = MPI_Wtime();  // s
};

/// Search for the rest position of a model under the settings. One object so that its parts live
/// and end together.
class Searcher {
 public:
  Searcher(Problem& problem, const Settings& settings)
      : problem_(problem),
        watcher_(problem.objective().positions().comm(), settings),
        evaluated_(problem.function().evaluations()),
        assembled_(problem.assemblies()),
        minimizer_(problem_.function(), problem_.solver(), problem_.error_estimate(),
                   std::ref(watcher_)) {
    if (problem_.force()) force_search_.emplace(*problem_.force(), minimizer_);
    if (problem_.objective().positions().part().contact)
      contact_.emplace(problem_.objective(), problem_.tangent(), problem_.elastic_solver(),
                       minimizer_, std::ref(watcher_));
    if (contact_) contact_->enable_other_rest(settings.finds_other_rest);
  }

  RestSearch& search() {
    if (force_search_) return *force_search_;
    if (contact_) return *contact_;
    return minimizer_;
  }
  discrete::Objective& objective() { return problem_.objective(); }
  linear::TangentSolver& elastic_solver() { return problem_.elastic_solver(); }
  Problem& problem() { return problem_; }
  Watcher& watcher() { return watcher_; }
  double epsilon() { return problem_.force() ? problem_.force()->epsilon() : 0; }
  /// Returns the evaluations of the searches alone.
  int64_t evaluations() { return problem_.function().evaluations() - evaluated_ - inspections_; }
  int64_t evaluations_for_other() const { return contact_ ? contact_->evaluations_for_other() : 0; }
  void count_inspection() { ++inspections_; }
  int64_t assemblies() const { return problem_.assemblies() - assembled_; }

 private:
  Problem& problem_;
  Watcher watcher_;
  int64_t evaluated_, assembled_;  // before this search
  Minimizer minimizer_;
  std::optional<ForceSearch> force_search_;
  std::optional<ContactSearch> contact_;
  int64_t inspections_ = 0;  // evaluations for those who inspect a state
};

/// Lets the caller inspect the state of each iteration.
void report_iterates(Searcher& searcher, const Settings& settings,
                     const discrete::NaturalRows& natural) {
  searcher.watcher().on_iteration([&](const Iteration& i) {
    settings.on_iterate(i.load, [&](const Receiver& receive) {
      discrete::Objective& objective = searcher.objective();
      const base::VecHandle gradient = objective.positions().make_vector();
      Outcome outcome;
      outcome.objective = searcher.problem().function().evaluate(i.displacement, gradient);
      searcher.count_inspection();
      outcome.gradient_max = discrete::largest_block(gradient);
      outcome.displacement_error = std::numeric_limits<double>::infinity();
      outcome.iterations = i.number;
      outcome.reason = "the search is under way";
      model::StepNumbers numbers = numbers_of(objective, settings, outcome, i.load);
      numbers.epsilon = searcher.epsilon();
      receive(numbers, natural.rows(objective));
    });
  });
}

/// Points of this rank that were inside bodies at the start.
void add_inside(const discrete::Part& part, const model::ContactPairs& body_contact,
                std::vector<ContactSummary>& contacts) {
  constexpr double reported_depth = 0.1;  // mm
  for (size_t c = 0; c < body_contact.point.size(); ++c) {
    const double depth = -body_contact.offset[c];
    if (body_contact.binding[c] == model::Binding::slides || depth < reported_depth) continue;
    ContactSummary& on = contacts[body_contact.body[c]];
    ++on.inside;
    if (depth <= on.deepest) continue;
    on.deepest = depth;
    on.where = part.model.points.position[body_contact.point[c]];
  }
}

void combine_ranks(MPI_Comm comm, ContactSummary& on) {
  on.points = base::sum_over_ranks(comm, on.points);
  for (double& component : on.force) component = base::sum_over_ranks(comm, component);
  on.skin.points = base::sum_over_ranks(comm, on.skin.points);
  on.skin.pressure = base::max_over_ranks_with(comm, on.skin.pressure, on.skin.where);
  on.inside = base::sum_over_ranks(comm, on.inside);
  on.deepest = base::max_over_ranks_with(comm, on.deepest, on.where);
}

void add_point(double pressure, const Vec3& where, SkinOnBone& skin) {
  ++skin.points;
  if (pressure <= skin.pressure) return;
  skin.pressure = pressure;
  skin.where = where;
}

/// At the objective's last update. Collective.
std::vector<ContactSummary> contacts_of(discrete::Objective& objective) {
  const discrete::Part& part = objective.positions().part();
  if (!part.contact) return {};
  std::vector<ContactSummary> contacts(part.bodies.size() + 1);
  mechanics::BodyContact& body_contact = objective.contact().bodies();
  body_contact.update_gaps(objective.positions().local());
  for (size_t c = 0; c < body_contact.gaps().size(); ++c) {
    const double pressure = body_contact.pressure(c);
    if (pressure == 0) continue;
    const int32_t body = body_contact.pairs().body[c];
    const int64_t point = body_contact.pairs().point[c];
    ContactSummary& on = contacts[body];
    ++on.points;
    if (part.model.points.layer[point] == 0 && body_contact.bodies()[body].bone() >= 0)
      add_point(pressure, objective.positions().local()[point], on.skin);
    on.force -= pressure * body_contact.pairs().area[c] * body_contact.normal(c);
  }
  mechanics::CutFaceContact& cut_faces = objective.contact().cut_faces();
  cut_faces.update_gaps(objective.positions().local());
  for (size_t w = 0; w < cut_faces.size(); ++w) {
    if (cut_faces.pressure(w) == 0) continue;
    ++contacts.back().points;
    contacts.back().force -= cut_faces.pressure(w) * cut_faces.area(w) * cut_faces.normal(w);
  }
  add_inside(part, body_contact.pairs(), contacts);
  for (ContactSummary& on : contacts) combine_ranks(objective.positions().comm(), on);
  return contacts;
}

struct Stability {
  Spectrum spectrum;
  std::vector<Vec3> mode;  // [local points], 0 where nothing is unknown
};

/// At the unknowns' displacement and the positions' load. Collective.
Stability stability_of(linear::TangentSolver& solver, const discrete::Positions& positions,
                       Vec displacement) {
  Stability found;
  const base::VecHandle mode = positions.make_vector();
  found.spectrum.smallest = smallest_eigenvalue(solver, displacement, mode);
  found.spectrum.largest = largest_eigenvalue(solver.hessian().exact());
  found.mode.assign(positions.local().size(), Vec3::Zero());
  positions.scatter_to_local(mode, found.mode);
  return found;
}

/// Hands on each step that the load path comes to, and sums up.
class Steps {
 public:
  Steps(Searcher& searcher, const Settings& settings, const discrete::NaturalRows& natural,
        ExactPenetration& penetration, const Receiver& receive, Summary& summary)
      : searcher_(searcher),
        settings_(settings),
        natural_(natural),
        receive_(receive),
        summary_(summary),
        penetration_(penetration) {}

  void add(const Outcome& outcome, double load, double seconds, Vec displacement) {
    discrete::Objective& objective = searcher_.objective();
    model::StepNumbers& last = summary_.last;
    last = numbers_of(objective, settings_, outcome, load);
    depths_ = penetration_.measure(objective);
    for (const PenetrationDepth& depth : depths_)
      last.penetration_exact = std::fmax(last.penetration_exact, depth.deepest);
    last.epsilon = searcher_.epsilon();
    const bool start = load == 0 && settings_.initial_equilibrium;
    const bool end = load == 1 || !outcome.converged;
    std::optional<Stability> stability;
    if (settings_.stability && (start || end)) {
      stability = stability_of(searcher_.elastic_solver(), objective.positions(), displacement);
      if (start) summary_.initial_spectrum = stability->spectrum;
      if (end) summary_.final_spectrum = stability->spectrum;
      last.smallest_eigenvalue = stability->spectrum.smallest;
      last.largest_eigenvalue = stability->spectrum.largest;
    }
    last.seconds = seconds;
    last.evaluations = searcher_.evaluations() - evaluations_;
    evaluations_ = searcher_.evaluations();
    model::StepRows rows = natural_.rows(objective);
    if (stability && !std::isnan(stability->spectrum.smallest))
      rows.point_fields.push_back(natural_.field("stability_mode", stability->mode));
    if (outcome.other)
      rows.point_fields.push_back(
          natural_.field("other_rest_displacement", outcome.other->displacement));
    if (settings_.derivatives.requested() && load == 1 && outcome.converged)
      differentiate(displacement, rows.point_fields);
    receive_(last, rows);
  }

  /// [bodies] at the last step.
  const std::vector<PenetrationDepth>& depths() const { return depths_; }

 private:
  void differentiate(Vec displacement, std::vector<model::PointField>& fields) {
    auto gradient =
        solve::differentiate(searcher_.problem(), natural_, displacement, settings_, fields);
    summary_.abandoned = !gradient;
    if (!settings_.derivatives.functional.empty()) summary_.gradient = std::move(gradient);
  }

  Searcher& searcher_;
  const Settings& settings_;
  const discrete::NaturalRows& natural_;
  const Receiver& receive_;
  Summary& summary_;
  ExactPenetration& penetration_;
  std::vector<PenetrationDepth> depths_;
  int64_t evaluations_ = 0;  // up to the step before
};

/// Sets contact to the pressures at a displacement that a search continues from. Collective.
void continue_contact(const Start& start, const discrete::NaturalRows& natural, Vec displacement,
                      double load, discrete::Objective& objective) {
  discrete::Positions& positions = objective.positions();
  if (!positions.part().contact || !base::on_any_rank(positions.comm(), !start.pressure.empty()))
    return;
  positions.set_load(load);
  positions.update(displacement);
  objective.contact().place_bodies();
  objective.contact().set_pressures(natural.owned(start.pressure));
}

void end_stage(const Settings& settings, const char* name) {
  if (settings.stages) settings.stages->end(name);
}

}  // namespace

struct RestSolver::State {
  State(MPI_Comm comm, const discrete::Part& part, const Settings& settings)
      : positions(comm, part),
        natural(comm, part),
        problem(positions, settings.weights, settings.functional == model::Functional::force),
        penetration(part) {}

  discrete::Positions positions;
  discrete::NaturalRows natural;
  Problem problem;
  ExactPenetration penetration;
};

RestSolver::RestSolver(MPI_Comm comm, const discrete::Part& part, const Settings& settings) {
  if (part.unknowns.total == 0)
    base::refuse("the model has no soft-tissue point: nothing is free to move");
  const base::LogStage stage("Search");  // what makes the solvers counts with what uses them
  state_ = std::make_unique<State>(comm, part, settings);
  end_stage(settings, "distribute");
}

RestSolver::~RestSolver() = default;

void RestSolver::set_motion(int32_t bone, const scene::RigidMotion& motion) {
  state_->positions.set_motion(bone, motion);
}

std::shared_ptr<const linear::KeptPreconditioner> RestSolver::make_preconditioner(
    const Start& rest) {
  State& s = *state_;
  const base::VecHandle displacement = s.positions.make_vector();
  s.natural.set_unknowns(rest.position, s.positions, displacement);
  s.problem.reset();
  s.positions.set_load(1);
  s.positions.update(displacement);
  continue_contact(rest, s.natural, displacement, 1, s.problem.objective());
  return s.problem.elastic_solver().make_kept(displacement);
}

Summary RestSolver::find(const Settings& settings, const Start& start, const Receiver& receive) {
  discrete::Positions& positions = state_->positions;
  const discrete::NaturalRows& natural = state_->natural;
  const base::LogStage stage("Search");
  base::VecHandle displacement = positions.make_vector();
  positions.set_load(0);
  positions.update(displacement);
  state_->problem.reset();
  if (start.preconditioner) state_->problem.elastic_solver().restore(*start.preconditioner);
  const base::VecHandle guess = start.guess ? positions.make_vector() : base::VecHandle();
  if (start.guess || settings.path.start_load > 0)
    natural.set_unknowns(start.position, positions, start.guess ? guess : displacement);
  Searcher searcher(state_->problem, settings);
  if (settings.on_iterate) report_iterates(searcher, settings, natural);
  Summary summary;
  Steps steps(searcher, settings, natural, state_->penetration, receive, summary);
  PathSettings along = settings.path;
  along.near_guess = start.near && positions.largest_travel() > 0;
  if (along.near_guess)
    continue_contact(start, natural, guess, 1, searcher.objective());
  else if (!start.guess && along.start_load > 0)
    continue_contact(start, natural, displacement, along.start_load, searcher.objective());
  LoadPath path(searcher.problem(), searcher.search(), along);
  summary.path =
      path.run(displacement, guess, [&](const Outcome& outcome, double load, double seconds) {
        steps.add(outcome, load, seconds, displacement);
      });
  summary.contacts = contacts_of(searcher.objective());
  summary.pierced = find_pierced_columns(searcher.objective());
  summary.pierced_by_instrument = find_columns_in_instruments(searcher.objective());
  for (size_t k = 0; k < steps.depths().size(); ++k) summary.contacts[k].exact = steps.depths()[k];
  summary.unknowns = 3 * positions.part().unknowns.total;
  summary.evaluations = searcher.evaluations();
  summary.evaluations_for_other = searcher.evaluations_for_other();
  summary.assemblies = searcher.assemblies();
  end_stage(settings, "solve");
  return summary;
}

Summary find_repose(MPI_Comm comm, const model::Model& model, const Settings& settings,
                    const Start& start, const Receiver& receive) {
  const discrete::Part part = discrete::build_local_from_root(comm, model).part;
  return RestSolver(comm, part, settings).find(settings, start, receive);
}

}  // namespace repose::solve
