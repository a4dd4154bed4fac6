#include "repose/solve/predictor.h"

namespace repose::solve {

using base::check;

Predictor::Predictor(discrete::Objective& objective, linear::TangentSolver& solver)
    : objective_(objective), solver_(solver), force_(objective.positions().make_vector()) {}

bool Predictor::predict(Vec displacement, double load, Vec increment) {
  discrete::Positions& positions = objective_.positions();
  positions.update(displacement);
  const discrete::Part& part = positions.part();
  std::vector<Vec3> direction(positions.local().size(), Vec3::Zero());
  for (size_t i = 0; i < direction.size(); ++i)
    if (part.unknown[i] < 0)
      direction[i] = positions.prescribed(static_cast<int64_t>(i), load) - positions.local()[i];
  objective_.hessian_action(direction, force_);
  check(VecScale(force_, -1));
  check(VecSet(increment, 0));
  // A weak preconditioner's norm does not see smooth errors: after 1e-2 of it an increment can miss
  // by more than the path trusts, and steps are halved for nothing.
  const double close = part.solid ? 1e-2 : 1e-5;
  bool convex = solver_.solve(displacement, force_, increment, close);
  // Where iterations ran out, the preconditioner is worn out and the next solve renews it.
  if (convex && !solver_.finished()) convex = solver_.solve(displacement, force_, increment, close);
  return convex && solver_.finished();
}

}  // namespace repose::solve
