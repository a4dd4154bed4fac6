#include "stopping_test.h"

#include <algorithm>
#include <limits>

#include "repose/base/program.h"

namespace repose::paper {

using base::check, base::cpu_seconds;

StoppingTest::StoppingTest(discrete::Function& inner, Vec goal, const Rules& rules)
    : Function(inner.positions()),
      inner_(inner),
      goal_(goal),
      rules_(rules),
      difference_(inner.positions().make_vector()),
      closest_(std::numeric_limits<double>::infinity()),
      begin_(cpu_seconds()) {}

double StoppingTest::seconds() const { return cpu_seconds() - begin_ - looking_; }

double StoppingTest::value_and_gradient(Vec displacement, Vec gradient) {
  const double value = inner_.evaluate(displacement, gradient);
  if (goal_) {
    const double look = cpu_seconds();
    check(VecWAXPY(difference_, -1, goal_, displacement));
    closest_ = std::min(closest_, discrete::largest_block(difference_));
    looking_ += cpu_seconds() - look;
    if (closest_ <= rules_.accuracy) throw SearchOver{true};
  }
  if (evaluations() >= rules_.limit || seconds() > rules_.seconds) throw SearchOver{false};
  return value;
}

}  // namespace repose::paper
