/// Compares contact by a logarithmic barrier with the search of repose-solve, on a solid, serially:
///     benchmark_barrier SCENE.yaml [-result RESULT.h5] [-accuracy 0.01]
/// Incremental potential contact (Li et al. 2020, ACM Transactions on Graphics 39:49) minimizes
///     energy + Σ a κ b(g + s, D),    b(d, D) = −(d − D)² ln(d/D) for 0 < d < D, 0 beyond,
/// where g is the gap that repose-solve keeps ≥ 0, a the area that the point stands for and
/// κ = p / D with a pressure p. The standoff s makes points feasible whose initial gap is 0. At
/// rest, points in contact have gaps between −s and s.
///   Newton's method uses the exact Hessian of the tissue and the barrier's without the curvature
/// of the gaps. Each system is solved by conjugate gradients with multigrid, which stop at negative
/// curvature; such a step does not end the search. Additive continuous collision detection (Li et
/// al. 2021, ACM Transactions on Graphics 40:170) limits each step, so that no distance to a body
/// falls below a tenth of its value; then the step is halved until the sum decreases. The sides of
/// cuts are checked only at the end of a step.
///   The load increases by Newton steps in which unknowns, bones and bodies move together, each
/// limited to its feasible share. Newton steps at the new load follow. At load 1, D decreases
/// to 2 s.
///   Prints a row for each method: evaluations, linear systems, multigrid cycles, load steps, CPU
/// seconds of the search and their ratio, the penetration into the bodies' triangles, mm, and the
/// largest distance of the skin from RESULT.h5 (default: from the present search), mm.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "app/job.h"
#include "repose/app/settings.h"
#include "repose/base/options.h"
#include "repose/base/program.h"
#include "repose/discrete/natural_rows.h"
#include "repose/results/model_file.h"
#include "solve/contact_search.h"
#include "solve/exact_penetration.h"

namespace {

using namespace repose;
using base::check, base::OptionKind;
using discrete::Objective;
using mechanics::LinearGap, mechanics::RigidBody;

const MPI_Comm comm = PETSC_COMM_SELF;

/// Barrier at a distance 0 < d < range, with its derivatives.
struct Barrier {
  Barrier(double d, double range) {
    const double from = d - range, logarithm = std::log(d / range);
    value = -from * from * logarithm;
    slope = -2 * from * logarithm - from * from / d;
    curvature = -2 * logarithm - 4 * from / d + from * from / (d * d);
  }
  double value, slope, curvature;  // mm², mm, 1
};

/// Search for the rest position at load 1 with the barrier in place of the model's contact.
class BarrierSearch {
 public:
  struct Parameters {
    double accuracy, standoff, range, pressure;
  };

  BarrierSearch(solve::Problem& problem, const Parameters& parameters)
      : parameters_(parameters), problem_(problem) {
    constexpr double negligible = 1e-12;  // N/mm³, so that the barrier alone acts
    objective_.contact().bodies().set_stiffness(negligible);
    objective_.contact().cut_faces().set_stiffness(negligible);
  }

  /// Finds the rest position. Returns how the search ended and its load steps.
  std::pair<std::string, int> run() {
    constexpr double tolerance = 0.1, reduction = 5;  // mm, of a step below load 1; of the range
    constexpr int max_sub_steps = 300;
    const double final_range = 2 * parameters_.standoff;
    int sub_steps = 0;
    bool converged = minimize(parameters_.range, tolerance);
    while (converged && positions_.load() < 1)
      converged = ++sub_steps <= max_sub_steps && advance() && minimize(range_, tolerance);
    while (converged && range_ > final_range)
      converged = minimize(std::max(final_range, range_ / reduction), tolerance);
    converged = converged && minimize(range_, parameters_.accuracy / 2);
    const std::string where = fmt::format("at load {:.4f}, D = {} mm", positions_.load(), range_);
    return {converged ? "rest" : "failed " + where, sub_steps};
  }

 private:
  double stiffness() const { return parameters_.pressure / range_; }  // κ, N/mm³
  Barrier barrier(const LinearGap& gap) const { return {gap.gap + parameters_.standoff, range_}; }

  /// Evaluates value, gradient_ and gaps_ at displacement_; infinite if a distance is not positive.
  double evaluate() {
    double value = objective_.evaluate(displacement_, gradient_);
    const double reach = range_ - parameters_.standoff;
    gaps_ = objective_.contact().bodies().linear_gaps(positions_.local(), reach);
    touching_ = gaps_.size();
    std::ranges::move(objective_.contact().cut_faces().linear_gaps(reach),
                      std::back_inserter(gaps_));
    std::vector<Vec3> push(moved_.size(), Vec3::Zero());
    for (const LinearGap& gap : gaps_) {
      if (!(gap.gap + parameters_.standoff > 0)) return std::numeric_limits<double>::infinity();
      value += stiffness() * gap.area * barrier(gap).value;
      for (const auto& [p, normal] : gap.gradient)
        push[p] += stiffness() * gap.area * barrier(gap).slope * normal;
    }
    positions_.restrict_to_owned(push, push_);
    check(VecAXPY(gradient_, 1.0, push_));
    return value;
  }

  /// Sets the barrier's part of the Hessian, κ a b″ ∇g ∇gᵀ at gaps_.
  void set_blocks() {
    std::vector<Objective::Block> convex;
    blocks_.clear();
    const auto add_to = [](std::vector<Objective::Block>& blocks) {
      return [&](int32_t p, int32_t q, const Mat3& block) { blocks.push_back({p, q, block}); };
    };
    for (const LinearGap& gap : gaps_) {
      const double weight = stiffness() * gap.area * barrier(gap).curvature;
      mechanics::visit_products(gap.gradient, weight, add_to(blocks_));
      mechanics::visit_products(gap.lumped.empty() ? gap.gradient : gap.lumped, weight,
                                add_to(convex));
    }
    problem_.tangent().assemble(displacement_);
    problem_.tangent().set_contact(blocks_, std::move(convex));
    problem_.elastic_solver().preconditioner().update_contact();
  }

  /// Solves H step_ = −slope to the relative residual `forcing`; sets moved_, too. Returns false
  /// where negative curvature stopped it.
  bool solve(Vec slope, double forcing) {
    check(VecScale(slope, -1.0));
    check(VecSet(step_, 0));
    const bool convex = problem_.elastic_solver().solve(displacement_, slope, step_, forcing);
    PetscReal along = 0;
    check(VecDot(slope, step_, &along));
    if (!(along > 0)) check(PCApply(problem_.elastic_solver().preconditioner(), slope, step_));
    positions_.scatter_to_local(step_, moved_);
    return convex;
  }

  /// Returns the feasible share, at most 1, of moved_ and of the motion of the bodies to `next`.
  double feasible_share(const std::vector<RigidBody>& next) const {
    constexpr double steepest = 1.1, kept_share = 0.1,
                     tolerance_share = 0.05;  // a slope; of the distance
    constexpr int max_advances = 400;
    const mechanics::BodyContact& loop = objective_.contact().bodies();
    const model::ContactPairs& pairs = loop.pairs();
    double share = 1;
    for (size_t c = 0; c < pairs.point.size(); ++c) {
      const RigidBody& body = objective_.contact().bodies().bodies()[pairs.body[c]];
      const Vec3 now = positions_.local()[pairs.point[c]], from = body.beside(now),
                 path = next[pairs.body[c]].beside(now + moved_[pairs.point[c]]) - from;
      const double speed = steepest * path.norm(), standoff = parameters_.standoff;
      if (share * speed < (1 - kept_share) * (loop.gaps()[c] + standoff)) continue;
      const auto distance = [&](double at) {
        return body.distance(from + at * path).value - pairs.offset[c] + standoff;
      };
      const double first = distance(0), lowest = kept_share * first;
      double at = 0, left = first - lowest;
      for (int n = 0; n < max_advances && at < share && left > tolerance_share * first; ++n) {
        at += left / speed;
        left = distance(std::min(at, share)) - lowest;
      }
      share = std::min(share, at);
    }
    return share;
  }

  /// Takes Newton steps at the load until one is below `tolerance`, mm. Returns whether one was.
  bool minimize(double range, double tolerance) {
    constexpr int max_steps = 100, max_halvings = 25;
    constexpr double sufficient = 1e-4, rounding = 1e-13, forcing = 0.1;
    range_ = range;
    double value = evaluate();
    for (int n = 0; n < max_steps; ++n) {
      set_blocks();
      PetscReal slope = 0;
      check(VecCopy(gradient_, before_));
      const bool convex = solve(before_, forcing);
      check(VecDot(gradient_, step_, &slope));
      double share = feasible_share(objective_.contact().bodies().bodies()), trial = 0;
      check(VecCopy(displacement_, before_));
      for (int halvings = 0; halvings <= max_halvings; ++halvings, share /= 2) {
        check(VecWAXPY(displacement_, share, step_, before_));
        trial = evaluate();
        if (trial <= value + sufficient * share * slope + rounding * std::abs(value)) break;
        if (halvings == max_halvings) return false;
      }
      value = trial;
      if (convex && discrete::largest_block(step_) <= tolerance) return true;
    }
    return false;
  }

  /// Moves unknowns, bones and bodies by the feasible share of the Newton step to load 1. Returns
  /// false where there is none.
  bool advance() {
    constexpr double forcing = 0.01, min_share = 1e-5;  // of the load
    constexpr double longest = 20;                      // mm, as repose-solve
    const double load = positions_.load(),
                 whole = std::min(1 - load, longest / positions_.largest_travel());
    const std::vector<RigidBody>& bodies = objective_.contact().bodies().bodies();
    const auto place_at = [&](double to) {
      positions_.set_load(to);
      positions_.update(displacement_);
      objective_.contact().place_bodies();
    };
    place_at(load + whole);
    const std::vector<RigidBody> next = bodies;
    std::vector<Vec3> path(positions_.local().begin(), positions_.local().end());
    place_at(load);
    for (size_t i = 0; i < path.size(); ++i) path[i] -= positions_.local()[i];
    std::vector<Vec3> push(path.size(), Vec3::Zero());
    set_blocks();
    Objective::add_blocks(blocks_, path, push);
    for (const LinearGap& gap : std::span(gaps_).first(touching_)) {
      const auto& [p, normal] = gap.gradient.front();
      const int32_t b = objective_.contact().bodies().pairs().body[gap.constraint];
      const Vec3 now = positions_.local()[p], carried = next[b].in_space(bodies[b].beside(now));
      push[p] -=
          stiffness() * gap.area * barrier(gap).curvature * normal.dot(carried - now) * normal;
    }
    positions_.restrict_to_owned(push, push_);
    objective_.hessian_action(path, before_, false);
    check(VecAXPY(before_, 1.0, push_));
    check(VecAXPY(before_, 1.0, gradient_));
    solve(before_, forcing);
    check(VecCopy(displacement_, before_));
    for (double share = feasible_share(next); share * whole > min_share; share /= 2) {
      positions_.set_load(share == 1 && whole == 1 - load ? 1 : load + share * whole);
      check(VecWAXPY(displacement_, share, step_, before_));
      if (evaluate() < discrete::overflown) return true;
    }
    return false;
  }

  Parameters parameters_;
  solve::Problem& problem_;
  Objective& objective_ = problem_.objective();
  discrete::Positions& positions_ = objective_.positions();
  base::VecHandle displacement_ = positions_.make_vector(), gradient_ = positions_.make_vector(),
                  push_ = positions_.make_vector(), step_ = positions_.make_vector(),
                  before_ = positions_.make_vector();
  std::vector<Vec3> moved_ =
      std::vector<Vec3>(positions_.local().size(), Vec3::Zero());  // [local points] of step_
  double range_ = 0;                                               // D, mm
  std::vector<LinearGap> gaps_;           // below the range: at bodies, then at the sides of cuts
  size_t touching_ = 0;                   // of them, at bodies
  std::vector<Objective::Block> blocks_;  // of the barrier, in the Hessian
};

/// Returns the number of events with this name in PETSc's log.
int64_t logged(const char* name) {
  PetscLogEvent event = -1;
  PetscEventPerfInfo info{};
  check(PetscLogEventGetId(name, &event));
  if (event >= 0) check(PetscLogEventGetPerfInfo(PETSC_DETERMINE, event, &info));
  return info.count;
}

/// Runs searches on one model and prints a row for each.
class Comparison {
 public:
  Comparison(const model::Model& model, std::vector<Vec3> reference)
      : model_(model), reference_(std::move(reference)) {}

  /// Runs `search`, which takes a problem and returns its end and its load steps.
  template <class Search>
  void run(const char* method, const solve::Settings& settings, Search&& search) {
    const discrete::Part part =
        discrete::build_local_from_root(comm, model_).part;  // with empty grids of distances
    discrete::Positions positions(comm, part);
    solve::Problem problem(positions, settings.weights, false);
    const int64_t systems = logged("KSPSolve"), cycles = logged("PCApply");
    const double begin = base::cpu_seconds();
    const std::pair<std::string, int> end = search(problem);
    const double seconds = base::cpu_seconds() - begin;
    if (first_seconds_ == 0) first_seconds_ = seconds;
    double penetration = 0, distance = 0;
    for (const auto& depth : solve::ExactPenetration(part).measure(problem.objective()))
      penetration = std::max(penetration, depth.deepest);
    std::vector<Vec3> now(part.point_row.size());
    for (size_t i = 0; i < now.size(); ++i) now[part.point_row[i]] = positions.local()[i];
    if (reference_.empty()) reference_ = now;
    for (size_t i = 0; i < now.size(); ++i)
      if (model_.points.layer[i] == 0)
        distance = std::max(distance, (now[i] - reference_[i]).norm());
    fmt::print("| {} | {} | {} | {} | {} | {:.2f} ({:.1f}) | {:.2f} | {:.3f} | {} |\n", method,
               problem.objective().evaluations(), logged("KSPSolve") - systems,
               logged("PCApply") - cycles, end.second, seconds, seconds / first_seconds_,
               penetration, distance, end.first);
  }

 private:
  const model::Model& model_;
  std::vector<Vec3> reference_;  // [points of the model] mm
  double first_seconds_ = 0;     // s, of the first search
};

/// Returns the points of the last step; none without a file.
std::vector<Vec3> read_positions(const std::string& result, const model::Model& model) {
  if (result.empty()) return {};
  const auto last = results::step_count(result) - 1;
  const auto step = results::read_step(result, last, results::read_model(result));
  if (step.rows.position.size() != model.points.position.size())
    base::refuse("{}: other points than the scene's", result);
  return step.rows.position;
}

base::Exit run(const base::Options& options) {
  check(PetscLogDefaultBegin());
  const app::Job job = app::read_job(comm, options.arguments()[0]);
  if (!job.local_model.part.solid) base::refuse("tissue.springs: the barrier is for solids");
  solve::Settings settings = app::settings_of(job.requested, true);
  settings.path.accuracy = options.number("accuracy");
  const model::Model model = discrete::gather_model(comm, job.local_model);
  Comparison comparison(model, read_positions(options.text("result"), model));
  comparison.run("present", settings, [&](solve::Problem& problem) {
    solve::Minimizer minimizer(problem.function(), problem.solver(), nullptr);
    solve::ContactSearch contact(problem.objective(), problem.tangent(), problem.elastic_solver(),
                                 minimizer, nullptr);
    contact.enable_other_rest(false);
    const base::VecHandle displacement = problem.objective().positions().make_vector();
    const auto found = solve::LoadPath(problem, contact, settings.path)
                           .run(displacement, nullptr, [](const auto&, double, double) {});
    return std::pair(found.last.reason, static_cast<int>(found.steps));
  });
  comparison.run("barrier", settings, [&](solve::Problem& problem) {
    return BarrierSearch(problem, {settings.path.accuracy, options.number("standoff"),
                                   options.number("range"), options.number("pressure")})
        .run();
  });
  return base::Exit::done;
}

}  // namespace

int main(int argc, char** argv) {
  base::Options options(
      argc, argv, "Compares a barrier method with the search of repose-solve.",
      {{"SCENE", "a scene of a solid with contact"}},
      {{"result", OptionKind::path, "", "A result of the scene, for the distance of the skin."},
       {"accuracy", OptionKind::number, "0.01", "Distance from rest.", {1e-6, 10}, "mm"},
       {"standoff", OptionKind::number, "0.01", "Distance s of a gap of 0.", {1e-6, 10}, "mm"},
       {"range", OptionKind::number, "0.5", "D up to load 1.", {1e-6, 10}, "mm"},
       {"pressure", OptionKind::number, "0.001", "Pressure p.", {1e-9, 1e3}, "N/mm²"}});
  return base::run_program(options, [&] { return run(options); });
}
