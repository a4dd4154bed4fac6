#include "dynamics.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <utility>

namespace repose::paper {

using base::check;

namespace {

constexpr double huge = 1e99;  // a value beyond is one that overflowed

/// Positions and velocities, or their rates of change.
struct State {
  base::VecHandle x, v;
  explicit State(const discrete::Positions& positions)
      : x(positions.make_vector()), v(positions.make_vector()) {}
};

void copy(const State& from, State& to) {
  check(VecCopy(from.x, to.x));
  check(VecCopy(from.v, to.v));
}

void add(State& state, double weight, const State& rate) {
  check(VecAXPY(state.x, weight, rate.x));
  check(VecAXPY(state.v, weight, rate.v));
}

/// rate.x = v, rate.v = F − c v. Returns whether the function's value is finite.
bool find_rate(discrete::Function& function, const State& state, Damping damping, State& rate) {
  const double value = function.evaluate(state.x, rate.v);
  check(VecScale(rate.v, -1));
  check(VecAXPY(rate.v, -damping.coefficient, state.v));
  check(VecCopy(state.v, rate.x));
  return std::isfinite(value) && value < huge;
}

/// One step of the 3(2) pair after another: rates k1 … k4, of which k4 is the next step's k1.
class BogackiShampine {
 public:
  BogackiShampine(discrete::Function& function, Damping damping)
      : function_(function),
        damping_(damping),
        trial_(function.positions()),
        error_(function.positions()),
        k_{State(function.positions()), State(function.positions()), State(function.positions()),
           State(function.positions())} {}

  void start(const State& state) { find_rate(function_, state, damping_, k_[0]); }

  /// Tries a step; returns its error in mm, infinite where a value is not finite.
  double attempt(const State& state, double h) {
    const bool finite = stage(state, h, {1.0 / 2}, 1) && stage(state, h, {0, 3.0 / 4}, 2) &&
                        stage(state, h, {2.0 / 9, 1.0 / 3, 4.0 / 9}, 3);
    if (!finite) return std::numeric_limits<double>::infinity();
    constexpr double difference[] = {-5.0 / 72, 1.0 / 12, 1.0 / 9, -1.0 / 8};
    check(VecSet(error_.x, 0));
    check(VecSet(error_.v, 0));
    for (int s = 0; s < 4; ++s) add(error_, h * difference[s], k_[s]);
    return discrete::largest_block(error_.x) + h * discrete::largest_block(error_.v);
  }

  void accept(State& state) {
    copy(trial_, state);
    std::swap(k_[0], k_[3]);
  }

 private:
  /// k_[number] at state + h Σ weights k.
  bool stage(const State& state, double h, std::initializer_list<double> weights, int number) {
    copy(state, trial_);
    int s = 0;
    for (const double weight : weights) add(trial_, h * weight, k_[s++]);
    return find_rate(function_, trial_, damping_, k_[number]);
  }

  discrete::Function& function_;
  Damping damping_;
  State trial_, error_;
  State k_[4];
};

}  // namespace

bool move_by_euler(discrete::Function& function, Vec displacement, Damping damping, double step,
                   int64_t steps) {
  const base::VecHandle velocity = function.positions().make_vector(),
                        gradient = function.positions().make_vector();
  for (int64_t k = 0; k < steps; ++k) {
    const double value = function.evaluate(displacement, gradient);
    if (!std::isfinite(value) || value > huge) return false;
    check(VecAXPBY(velocity, -step, 1 - step * damping.coefficient, gradient));
    check(VecAXPY(displacement, step, velocity));
  }
  return true;
}

bool move_by_runge_kutta(discrete::Function& function, Vec displacement, Damping damping,
                         const RungeKuttaSettings& settings) {
  constexpr double safety = 0.9, min_factor = 0.2, max_factor = 5, min_step = 1e-12;
  BogackiShampine pair(function, damping);
  State state(function.positions());
  check(VecCopy(displacement, state.x));
  pair.start(state);
  double time = 0, h = settings.first_step;
  while (time < settings.duration && h > min_step) {
    h = std::min(h, settings.duration - time);
    const double error = pair.attempt(state, h);
    if (error <= settings.tolerance) {
      time += h;
      pair.accept(state);
    }
    const double factor = safety * std::cbrt(settings.tolerance / std::max(error, 1e-300));
    h *= std::clamp(factor, min_factor, max_factor);
  }
  check(VecCopy(state.x, displacement));
  return time >= settings.duration;
}

}  // namespace repose::paper
