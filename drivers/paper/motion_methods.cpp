#include "motion_methods.h"

#include <cmath>
#include <optional>

#include "dynamics.h"

namespace repose::paper {

namespace {

constexpr double damping_factors[] = {1, 2, 4};
constexpr int max_halvings = 4;

/// The better one of two: the one that arrives, with the fewer evaluations, or comes closer.
void keep_better(std::optional<Entry>& best, const Entry& tried) {
  const bool better =
      !best || (tried.arrived() && !best->arrived()) ||
      (tried.arrived() == best->arrived() &&
       (tried.arrived() ? tried.evaluations < best->evaluations : tried.distance < best->distance));
  if (better) best = tried;
}

/// The largest step that arrives, with one damping.
void scan_steps(Contest& contest, double damping, double longest, std::optional<Entry>& best) {
  constexpr int64_t unlimited = INT64_MAX;
  double step = longest;
  for (int k = 0; k <= max_halvings; ++k, step /= 2) {
    if (damping * step >= 2) continue;  // the damping alone is unstable
    const Entry tried =
        contest.run(fmt::format("semi-implicit Euler, c = {:.2g}, h = {:.2g}", damping, step),
                    [&](discrete::Function& function, Vec displacement) {
                      move_by_euler(function, displacement, {damping}, step, unlimited);
                    });
    keep_better(best, tried);
    if (tried.end != Entry::End::elsewhere) return;
  }
}

}  // namespace

std::vector<Entry> run_motion(Contest& contest, double accuracy) {
  const Contest::Curvature curvature = contest.curvature();
  const double critical = 2 * std::sqrt(curvature.minimum);
  const double longest = 2 / std::sqrt(curvature.largest);
  std::optional<Entry> euler, runge_kutta;
  for (const double factor : damping_factors) {
    const double damping = factor * critical;
    scan_steps(contest, damping, longest, euler);
    const Entry tried =
        contest.run(fmt::format("Runge–Kutta 3(2), c = {:.2g}", damping),
                    [&](discrete::Function& function, Vec displacement) {
                      move_by_runge_kutta(function, displacement, {damping},
                                          {.tolerance = accuracy, .first_step = longest});
                    });
    keep_better(runge_kutta, tried);
  }
  return {*euler, *runge_kutta};
}

}  // namespace repose::paper
