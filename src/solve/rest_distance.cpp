#include "rest_distance.h"

#include <algorithm>
#include <limits>

namespace repose::solve {

using base::check;

namespace {

constexpr double linear = 1e-6;      // mm, below which a Newton step need not be confirmed
constexpr double sure_share = 0.05;  // of the accuracy, what a linear system may leave unknown
// A step by which the next is not shorter than this is no measure: the search goes on.
constexpr double trusted_contraction = 0.7, max_contraction = 0.99;

}  // namespace

RestDistance::RestDistance(const discrete::Function& minimized, const ErrorEstimate& estimate)
    : of_(estimate),
      of_minimized_(&estimate.function == &minimized),
      newton_(estimate.solver),
      trial_(minimized.positions().make_vector()),
      gradient_(minimized.positions().make_vector()) {}

double RestDistance::estimate(const State& at, double accuracy) {
  if (discrete::largest_block(at.gradient) == 0)
    return newton_.is_minimum(at.displacement) ? 0 : std::numeric_limits<double>::infinity();
  if (!of_minimized_) of_.function.evaluate(at.displacement, gradient_);
  const Vec gradient = of_minimized_ ? at.gradient : static_cast<Vec>(gradient_);
  double step = newton_.distance(at.displacement, gradient);
  double unsure = 0;
  if (at.last || safety * step <= accuracy) {
    step = newton_.bound(at.displacement, gradient, sure_share * accuracy);
    unsure = newton_.error_slack();
  }
  const double estimate = safety * step + unsure;
  const bool curved = estimate > linear && estimate <= accuracy;
  if (!curved) return estimate;
  // A step just taken says as much of the quadratic model as one on trial.
  const bool contracted = at.taken > 0 && step <= trusted_contraction * at.taken;
  const double left = contracted ? step / at.taken : contraction(at.displacement);
  return std::max(estimate, step / (1 - left));
}

/// Returns θ (NewtonEstimate) of the latest Newton step δ, from `displacement`, and the next, where
/// the rest is |δ| / (1 − θ) away at most where Newton's method converges (Deuflhard 2004, Newton
/// Methods for Nonlinear Problems, 2.1); as good as 1 where θ is large or the quadratic model
/// misleads.
double RestDistance::contraction(Vec displacement) {
  const discrete::Hessian& hessian = of_.solver.hessian();
  if (contracted_at_ == hessian.assemblies()) return contraction_;
  check(VecWAXPY(trial_, -1.0, newton_.step(), displacement));
  of_.function.evaluate(trial_, gradient_);
  const double found = newton_.contraction(displacement, trial_, gradient_);
  contraction_ = found <= trusted_contraction ? found : max_contraction;
  contracted_at_ = hessian.assemblies();
  return contraction_;
}

std::optional<double> RestDistance::preconditioned_step(Vec gradient) {
  if (!of_minimized_) return {};
  return newton_.preconditioned_distance(gradient);
}

}  // namespace repose::solve
