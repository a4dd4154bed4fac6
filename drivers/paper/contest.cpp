#include "contest.h"

#include <optional>

#include "polak_ribiere.h"
#include "repose/base/options.h"
#include "repose/solve/force_search.h"
#include "repose/solve/load_path.h"

namespace repose::paper {

using base::check;

namespace {

const MPI_Comm comm = PETSC_COMM_SELF;

/// Returns the number of times that PETSc's log recorded an event.
int64_t logged(const char* name) {
  PetscBool on = PETSC_FALSE;
  check(PetscLogIsActive(&on));
  if (!on) return 0;
  PetscLogEvent event = -1;
  PetscEventPerfInfo info{};
  check(PetscLogEventGetId(name, &event));
  if (event < 0) return 0;  // not registered yet
  check(PetscLogEventGetPerfInfo(PETSC_DETERMINE, event, &info));
  return info.count;
}

/// Finds the rest position of a problem by a function that watches it.
class WatchedSearch {
 public:
  WatchedSearch(solve::Problem& problem, discrete::Function& watched)
      : minimizer_(watched, problem.solver(), error_estimate(problem, watched), nullptr) {
    if (problem.force()) force_search_.emplace(*problem.force(), minimizer_);
  }
  solve::RestSearch& search() {
    if (force_search_) return *force_search_;
    return minimizer_;
  }

 private:
  static solve::ErrorEstimate error_estimate(solve::Problem& problem, discrete::Function& watched) {
    const solve::ErrorEstimate own = problem.error_estimate();
    if (&own.function != &problem.function()) return own;
    return {watched, own.solver};
  }

  solve::Minimizer minimizer_;
  std::optional<solve::ForceSearch> force_search_;
};

}  // namespace

Contest::Contest(const model::Model& model, const Functional& functional, const Rules& rules)
    : Contest(model, settings_of(functional, rules.accuracy).weights, functional.force, rules) {}

Contest::Contest(const model::Model& model, const mechanics::Weights& weights, bool force,
                 const Rules& rules)
    : part_(discrete::build_local_from_root(comm, model).part),
      positions_(comm, part_),
      problem_(positions_, weights, force),
      reference_(positions_.make_vector()),
      rules_(rules) {
  positions_.set_load(1);
}

void Contest::set_reference(Vec displacement) { check(VecCopy(displacement, reference_)); }

base::VecHandle Contest::copy_of_reference() const {
  base::VecHandle copy = positions_.make_vector();
  check(VecCopy(reference_, copy));
  return copy;
}

base::VecHandle Contest::displacement_to(const std::vector<Vec3>& position) const {
  base::VecHandle displacement = positions_.make_vector();
  std::vector<Vec3> moved(part_.point_row.size());
  for (size_t i = 0; i < moved.size(); ++i)
    moved[i] = position[part_.point_row[i]] - part_.model.points.position[i];
  positions_.restrict_to_owned(moved, displacement);
  return displacement;
}

double Contest::distance(Vec displacement) const {
  const base::VecHandle difference = positions_.make_vector();
  check(VecWAXPY(difference, -1, reference_, displacement));
  return discrete::largest_block(difference);
}

Entry Contest::run_to(Vec goal, const Rules& rules, const Search& search, Vec displacement) {
  StoppingTest test(problem_.function(), goal, rules);
  Entry entry;
  const int64_t assembled = problem_.assemblies(), renewed = logged("PCRenew"),
                acted = logged("MatMult"), applied = logged("PCApply");
  try {
    search(test, displacement);
    entry.end = Entry::End::elsewhere;
  } catch (const SearchOver& over) {
    entry.end = over.reached ? Entry::End::reached : Entry::End::limit;
  }
  entry.seconds = test.seconds();
  entry.evaluations = test.evaluations();
  entry.assemblies = problem_.assemblies() - assembled;
  entry.renewals = logged("PCRenew") - renewed;
  entry.actions = logged("MatMult") - acted;
  entry.applications = logged("PCApply") - applied;
  positions_.set_load(1);
  entry.distance = entry.end == Entry::End::elsewhere ? distance(displacement) : test.closest();
  return entry;
}

Contest::Search Contest::path_search(int load_steps, bool& complete) {
  return [this, load_steps, &complete](discrete::Function& watched, Vec displacement) {
    positions_.set_load(0);
    WatchedSearch search(problem_, watched);
    const auto unheard = [](const solve::Outcome&, double, double) {};
    solve::LoadPath path(problem_, search.search(),
                         {.accuracy = rules_.accuracy, .load_steps = load_steps});
    complete = path.run(displacement, nullptr, unheard).complete();
  };
}

Entry Contest::follow_path() {
  bool complete = false;
  const Rules rules{.limit = INT64_MAX, .seconds = rules_.path_seconds};
  check(VecSet(reference_, 0));
  Entry entry = run_to(nullptr, rules, path_search(0, complete), reference_);
  entry.method = "default";
  if (complete) entry.end = Entry::End::reached;
  return entry;
}

Entry Contest::run_path(int load_steps) {
  bool complete = false;
  return run("default", path_search(load_steps, complete));
}

bool Contest::refine(double accuracy, Vec start) {
  positions_.set_load(1);
  if (start) check(VecCopy(start, reference_));
  bool known = false;
  const Search settle = [&](discrete::Function& watched, Vec displacement) {
    WatchedSearch search(problem_, watched);
    known = search.search().run(displacement, accuracy).converged;
  };
  run_to(nullptr, {.limit = INT64_MAX, .seconds = rules_.seconds}, settle, reference_);
  if (problem_.force()) problem_.force()->set_epsilon(epsilon);
  return known;
}

bool Contest::find_own_minimum(Vec displacement) {
  constexpr double nearby = 1, far = 100;  // mm; beyond, a search has diverged
  if (problem_.force() || !(distance(displacement) < far)) return false;
  const base::VecHandle moved = positions_.make_vector();
  check(VecCopy(displacement, moved));
  const base::ScopedOption few("-tao_max_it", "50");
  solve::Minimizer newton(problem_.function(), problem_.solver(), nullptr);
  const solve::Outcome outcome = newton.run(displacement, 0.01 * rules_.accuracy);
  check(VecAXPY(moved, -1, displacement));
  return outcome.converged && discrete::largest_block(moved) < nearby;
}

Entry Contest::run(const std::string& method, const Search& search) {
  const base::VecHandle end = positions_.make_vector(), again = positions_.make_vector();
  Entry entry = run_to(reference_, rules_, search, end);
  entry.method = method;
  if (entry.end == Entry::End::reached || !find_own_minimum(end)) return entry;
  if (distance(end) <= rules_.accuracy)
    return entry;  // of the same minimum, which it did not reach
  Entry own = run_to(end, rules_, search, again);
  if (own.end != Entry::End::reached) return entry;
  own.method = method;
  own.end = Entry::End::own_minimum;
  own.distance = distance(end);
  const double rest = problem_.function().evaluate(reference_, nullptr);
  own.excess = problem_.function().evaluate(end, nullptr) / rest - 1;
  return own;
}

Entry Contest::run_polak_ribiere() {
  return run("Polak–Ribière, Brent", [](discrete::Function& function, Vec displacement) {
    polak_ribiere(function, displacement);
  });
}

Entry Contest::run_tao(const std::string& type) {
  const base::ScopedOption chosen("-tao_type", type);
  return run("TAO " + type, [&](discrete::Function& function, Vec displacement) {
    solve::Minimizer minimizer(function, problem_.solver(), nullptr);
    minimizer.run(displacement, 0);
  });
}

Contest::Curvature Contest::curvature() {
  constexpr int inverse_steps = 10, steps = 60;
  const base::VecHandle v = positions_.make_vector(), w = positions_.make_vector();
  linear::TangentSolver& solver = problem_.solver();
  solver.hessian().assemble(reference_);
  Curvature found{};
  check(VecSet(v, 1));
  for (int k = 0; k < inverse_steps; ++k) {
    check(VecNormalize(v, nullptr));
    check(VecSet(w, 0));
    solver.solve(reference_, v, w, 1e-3);
    found.minimum = 1 / dot(v, w);
    check(VecCopy(w, v));
  }
  for (int k = 0; k < steps; ++k) {
    check(VecNormalize(v, nullptr));
    check(MatMult(solver.hessian().exact(), v, w));
    found.largest = dot(v, w);
    check(VecCopy(w, v));
  }
  return found;
}

}  // namespace repose::paper
