#include "progress_test.h"

#include <algorithm>
#include <cmath>

#include "repose/base/agreement.h"
#include "repose/base/petsc.h"

namespace repose::solve {

using base::check;

bool ProgressTest::ends(const State& now) {
  if (!begun_) {
    first_objective_ = lowest_ = now.objective;
    lowered_at_ = now.iteration;
  }
  begun_ = true;
  at_rounding_ = is_at_rounding(now);
  stalled_ = may_stall_ && stalls(now);
  return at_rounding_ || stalled_;
}

bool ProgressTest::is_at_rounding(const State& now) {
  constexpr int64_t many = 20;        // iterations
  constexpr double rounding = 1e-14;  // of the value
  if (now.objective < lowest_ - rounding * std::abs(lowest_)) {
    lowest_ = now.objective;
    lowered_at_ = now.iteration;
  }
  return now.iteration - lowered_at_ >= many;
}

bool ProgressTest::stalls(const State& now) {
  constexpr double tenth = 0.1, negligible = 1e-9;  // the latter of the objective
  const double decrease = first_objective_ - best_.objective;
  const double step = std::max({tenth * decrease, negligible * std::abs(now.objective), 0.0});
  const bool lower = now.objective < best_.objective - step;
  const bool weaker = now.largest_force < (1 - tenth) * best_.largest_force;
  const bool nearer = now.distance < (1 - tenth) * best_.distance;
  if (lower || weaker || nearer) best_.evaluations = now.evaluations;
  if (lower) best_.objective = now.objective;
  if (weaker) best_.largest_force = now.largest_force;
  if (nearer) best_.distance = now.distance;
  return now.evaluations - best_.evaluations >= patience;
}

Vec3 place_of_largest(const discrete::Positions& positions, Vec vector) {
  const discrete::Part& part = positions.part();
  double largest = -1;
  Vec3 place = Vec3::Zero();
  const PetscScalar* values = nullptr;
  check(VecGetArrayRead(vector, &values));
  for (int64_t i = 0; i < part.owned_points; ++i) {
    if (part.unknown[i] < 0) continue;
    const PetscScalar* block = values + 3 * (part.unknown[i] - part.unknowns.first);
    const double length = Eigen::Map<const Vec3>(block).norm();
    if (length <= largest) continue;
    largest = length;
    place = positions.local()[i];
  }
  check(VecRestoreArrayRead(vector, &values));
  base::max_over_ranks_with(positions.comm(), largest, place);
  return place;
}

}  // namespace repose::solve
