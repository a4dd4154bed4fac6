#include "stopping_test.h"

#include <algorithm>
#include <cmath>

namespace repose::solve {

namespace {

// Of the accuracy: where a preconditioned gradient this long is worth a Newton step, which also
// says how far the rest position is; and one so short that it is rest, whatever the preconditioner.
constexpr double closing = 5, negligible = 1e-6;
constexpr double farthest_closing = 0.2;  // mm, whatever the accuracy

}  // namespace

double farthest_correction(double accuracy) {
  constexpr double finest = 1e-3;  // mm
  return std::max(finest, 10 * accuracy);
}

void StoppingTest::begin(double accuracy, Criterion criterion, bool may_finish) {
  accuracy_ = accuracy;
  criterion_ = criterion;
  may_finish_ = finishes_ && may_finish;
  finishing_ = false;
}

/// Steps of a Newton method go further, but one that the trust region or negative curvature cut off
/// rarely ends where the function is convex.
bool StoppingTest::worth_estimating(const Iterate& at) const {
  if (softest_ == 0 || criterion_ == Criterion::gradient) return true;
  const double hopeful = method_ == Method::newton ? 20 : 2;
  constexpr int64_t seldom = 20;  // evaluations: it costs other methods as much as many of them
  const bool far = at.largest_force > hopeful * softest_ * accuracy_;
  const bool soon = method_ == Method::gradient && function_.evaluations() - estimated_at_ < seldom;
  return !far && !soon && !at.cut;
}

/// By the preconditioned gradient alone; nothing where the estimate has to tell.
std::optional<bool> StoppingTest::ends_at_preconditioned_step(Vec gradient) {
  if (method_ == Method::gradient) return {};
  const std::optional<double> step = distance_.preconditioned_step(gradient);
  if (!step) return {};
  const double near = std::max(accuracy_, std::min(closing * accuracy_, farthest_closing));
  std::optional<bool> answer;
  if (criterion_ == Criterion::gradient)
    answer = *step <= accuracy_;
  else if (*step > (may_finish_ ? near : accuracy_))
    answer = false;
  else if (finishes_ && *step < negligible * accuracy_)
    answer = true;
  if (answer) error_ = RestDistance::safety * *step;
  return answer;
}

bool StoppingTest::ends(const Iterate& at) {
  if (at.largest_force == 0) {
    error_ = distance_.estimate({at.displacement, at.gradient}, accuracy_);
    return error_ == 0;
  }
  if (accuracy_ == 0) return false;
  if (!worth_estimating(at)) {
    error_ = at.largest_force / softest_;
    return false;
  }
  if (const auto answer = ends_at_preconditioned_step(at.gradient)) return *answer;
  estimated_at_ = function_.evaluations();
  error_ = distance_.estimate({at.displacement, at.gradient}, accuracy_);
  if (std::isfinite(error_))
    softest_ = at.largest_force / error_;
  else
    softest_ = 2 * std::max(softest_, at.largest_force / accuracy_);
  finishing_ = may_finish_ && error_ > accuracy_ && error_ <= farthest_correction(accuracy_);
  return error_ <= accuracy_ || finishing_;
}

}  // namespace repose::solve
