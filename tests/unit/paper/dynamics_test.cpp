#include "paper/dynamics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "quadratic.h"

namespace repose::paper {
namespace dynamics_test {

/// x(t) of x'' = −k (x − 1) − c x' from rest at 0, c² < 4 k.
double oscillation(double k, double c, double t) {
  const double omega = std::sqrt(k - 0.25 * c * c);
  return 1 - std::exp(-0.5 * c * t) * (std::cos(omega * t) + 0.5 * c / omega * std::sin(omega * t));
}

class Oscillator : public ::testing::Test {
 protected:
  static constexpr double damping = 0.7, end = 3.0;

  const discrete::Part part =
      discrete::build_local_from_root(MPI_COMM_WORLD, testing::resting_block()).part;
  discrete::Positions positions{MPI_COMM_WORLD, part};
  testing::Quadratic function{positions, 3};
  const base::VecHandle x = positions.make_vector();

  void expect_at_end(double tolerance) {
    PetscInt begin = 0, size = 0;
    const PetscScalar* values = nullptr;
    base::check(VecGetOwnershipRange(x, &begin, nullptr));
    base::check(VecGetLocalSize(x, &size));
    base::check(VecGetArrayRead(x, &values));
    for (PetscInt i = 0; i < size; ++i)
      EXPECT_NEAR(values[i], oscillation(function.stiffness(begin + i), damping, end), tolerance);
    base::check(VecRestoreArrayRead(x, &values));
  }
};

TEST_F(Oscillator, EulerFollowsTheClosedForm) {
  EXPECT_TRUE(move_by_euler(function, x, {damping}, 1e-3, 3000));
  EXPECT_EQ(function.evaluations(), 3000);
  expect_at_end(2e-3);
}

TEST_F(Oscillator, RungeKuttaFollowsTheClosedForm) {
  EXPECT_TRUE(move_by_runge_kutta(function, x, {damping}, {1e-7, 0.1, end}));
  expect_at_end(1e-5);
}

TEST_F(Oscillator, RungeKuttaIsOfThirdOrder) {
  move_by_runge_kutta(function, x, {damping}, {1e-5, 0.1, end});
  const auto rough = function.evaluations();
  base::check(VecSet(x, 0));
  move_by_runge_kutta(function, x, {damping}, {1e-8, 0.1, end});
  const double more = static_cast<double>(function.evaluations() - rough) / rough;
  EXPECT_NEAR(std::log10(more), 1, 0.25);  // error per step ~ h³
}

TEST_F(Oscillator, EulerSaysThatItDiverged) {
  EXPECT_FALSE(move_by_euler(function, x, {0}, 10, 1000));
}

}  // namespace dynamics_test
}  // namespace repose::paper
