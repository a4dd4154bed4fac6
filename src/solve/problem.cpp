#include "repose/solve/problem.h"

#include "repose/base/error.h"

namespace repose::solve {

Problem::Problem(discrete::Positions& positions, const mechanics::Weights& weights, bool force)
    : objective_(positions, force ? mechanics::Weights{} : weights),
      tangent_(objective_),
      elastic_solver_(positions, tangent_) {
  if (!force) return;
  if (!positions.part().model.elements.empty())
    base::refuse("the functional force is of springs; the model has elements of a further term");
  force_.emplace(objective_, weights);
  force_hessian_.emplace(*force_, tangent_);
  force_solver_.emplace(positions, *force_hessian_);
}

void Problem::reset() {
  objective_.contact().reset();
  tangent_.invalidate();
  elastic_solver_.reset();
  if (force_solver_) force_solver_->reset();
}

discrete::Function& Problem::function() {
  if (force_) return *force_;
  return objective_;
}

linear::TangentSolver& Problem::solver() {
  return force_solver_ ? *force_solver_ : elastic_solver_;
}

ErrorEstimate Problem::error_estimate() {
  // Without volume term rest is F = 0, for which the energy's Newton step is the better estimate.
  if (force_ && !force_->volume()) return {objective_, elastic_solver_};
  return {function(), solver()};
}

int64_t Problem::assemblies() const {
  return tangent_.assemblies() + (force_hessian_ ? force_hessian_->assemblies() : 0);
}

}  // namespace repose::solve
