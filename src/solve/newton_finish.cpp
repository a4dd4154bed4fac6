#include "newton_finish.h"

#include "stopping_test.h"

namespace repose::solve {

using base::check;

NewtonFinish::End NewtonFinish::run(Vec displacement, double accuracy, double taken, bool sure) {
  constexpr int maximum = 8;
  End end;
  const auto measure = [&](bool last, double step) {
    end.objective = function_.evaluate(displacement, gradient_);
    return distance_.estimate({displacement, gradient_, last, step}, accuracy);
  };
  end.error = measure(sure, taken);
  while (end.corrections < maximum && end.error > accuracy &&
         end.error <= farthest_correction(accuracy)) {
    const double before = end.error;
    check(VecCopy(displacement, saved_));
    check(VecAXPY(displacement, -1.0, distance_.step()));
    end.error = measure(true, discrete::largest_block(distance_.step()));
    if (end.error > 0.5 * before) {
      check(VecCopy(saved_, displacement));
      end.error = measure(true, 0);
      break;
    }
    ++end.corrections;
  }
  end.largest_force = discrete::largest_block(gradient_);
  return end;
}

}  // namespace repose::solve
