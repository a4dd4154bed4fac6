#include "repose/solve/stability.h"

#include <gtest/gtest.h>

#include "../discrete/moved_block.h"
#include "repose/base/agreement.h"
#include "repose/discrete/tangent.h"
#include "repose/linear/newton_estimate.h"

namespace repose {
namespace stability_test {

using base::check;
using model::PointSet;

constexpr int64_t always_direct = 1000000, never_direct = 0;

/// The Hessian of a model's energy on the ranks of `comm`.
struct Energy {
  discrete::Part part;
  discrete::Positions positions;
  discrete::Objective objective;
  discrete::Tangent tangent;
  linear::TangentSolver solver;
  base::VecHandle mode;  // of the last call of `smallest`

  Energy(MPI_Comm comm, const model::Model& model, const mechanics::Weights& weights = {})
      : part(discrete::build_local_from_root(comm, model).part),
        positions(comm, part),
        objective(positions, weights),
        tangent(objective),
        solver(positions, tangent) {}

  double smallest(Vec displacement, int64_t direct_limit) {
    mode = positions.make_vector();
    return solve::smallest_eigenvalue(solver, displacement, mode, direct_limit);
  }
  double smallest_at_start(int64_t direct_limit) {
    const base::VecHandle start = positions.make_vector();
    return smallest(start, direct_limit);
  }
  double largest_at_start() {
    tangent.assemble(positions.make_vector());
    return solve::largest_eigenvalue(tangent.exact());
  }
};

class Solver : public ::testing::TestWithParam<int64_t> {};

/// A chain of equal springs between two bones, stretched to the tension T: the Hessian is k along
/// it and T/r across it times the second difference, whose eigenvalues are 2 − 2 cos(j π / (n+1)).
model::Model chain(int links, double length, double stretch, double k) {
  model::Model m;
  m.bones = {"bone"};
  for (int i = 0; i <= links; ++i) {
    const bool end = i == 0 || i == links;
    testing::add_point(m, {0, 0, -length * i}, end ? PointSet::bone : PointSet::soft_tissue, i);
    if (i > 0) testing::add_spring(m, i - 1, i, k, 0);
  }
  for (double& rest : m.springs.rest_length) rest = length - stretch;
  return m;
}

TEST_P(Solver, StretchedChainHasTheEigenvaluesOfAString) {
  constexpr int links = 24;
  constexpr double length = 4, stretch = 0.5, k = 1.5;
  Energy energy(MPI_COMM_WORLD, chain(links, length, stretch, k));
  const double across = k * stretch / length;
  const double expected = across * (2 - 2 * std::cos(M_PI / links));
  EXPECT_NEAR(energy.smallest_at_start(GetParam()), expected, 1e-6 * expected);
  std::vector<Vec3> mode(energy.positions.local().size(), Vec3::Zero());
  energy.positions.scatter_to_local(energy.mode, mode);
  for (size_t i = 0; i < mode.size(); ++i)
    EXPECT_NEAR(mode[i].norm(), std::sin(M_PI * energy.part.point_row[i] / links), 1e-5);
  const double along = k * (2 + 2 * std::cos(M_PI / links));
  EXPECT_NEAR(energy.largest_at_start(), along, 0.01 * along);
}

TEST_P(Solver, CompressedChainBucklesByItsStiffestWave) {
  constexpr int links = 8;
  constexpr double length = 4, stretch = -0.5, k = 1.5;
  Energy energy(MPI_COMM_WORLD, chain(links, length, stretch, k));
  const double across = k * stretch / length;
  const double expected = across * (2 + 2 * std::cos(M_PI / links));
  EXPECT_NEAR(energy.smallest_at_start(GetParam()), expected, 1e-6 * std::abs(expected));
}

TEST(RoughEigenvalue, IsThatOfAStringAndLeavesTheSolverUsable) {
  constexpr int links = 24;
  constexpr double length = 4, k = 1.5;
  for (const double stretch : {0.5, -0.5}) {
    Energy energy(MPI_COMM_WORLD, chain(links, length, stretch, k));
    const base::VecHandle start = energy.positions.make_vector();
    energy.mode = energy.positions.make_vector();
    const double wave = std::cos(M_PI / links);
    const double expected = k * stretch / length * (stretch > 0 ? 2 - 2 * wave : 2 + 2 * wave);
    const double found = solve::rough_smallest_eigenvalue(energy.solver, start, energy.mode);
    EXPECT_NEAR(found, expected, 0.1 * std::abs(expected));
    EXPECT_NEAR(discrete::largest_block(energy.mode), 1, 1e-12);
    EXPECT_GT(linear::NewtonEstimate(energy.solver).preconditioned_distance(energy.mode), 0);
  }
}

/// Of a block out of equilibrium, whose Hessian is indefinite: the value is the Rayleigh quotient
/// of the mode, and near the smallest eigenvalue.
TEST(RoughEigenvalue, IsThatOfItsMode) {
  const mechanics::Weights weights{1, mechanics::VolumeTerm::penalty, 0.4};
  Energy energy(MPI_COMM_WORLD, testing::held_block(), weights);
  const base::VecHandle moved = testing::random_vector(energy.positions, 1, 0.8);
  const double smallest = energy.smallest(moved, linear::HessianPreconditioner::factors_limit);
  const double found = solve::rough_smallest_eigenvalue(energy.solver, moved, energy.mode);
  EXPECT_LT(found, 0);
  EXPECT_NEAR(found, smallest, 0.1 * std::abs(smallest));
  const base::VecHandle product = energy.positions.make_vector();
  check(MatMult(energy.tangent.action(), energy.mode, product));
  double along = 0, square = 0;
  check(VecDot(energy.mode, product, &along));
  check(VecDot(energy.mode, energy.mode, &square));
  EXPECT_NEAR(found, along / square, 1e-9 * std::abs(found));
}

/// A weight on a spring, at rest below its support or on top of it: m g / r across, of either sign.
class Pendulum : public ::testing::TestWithParam<std::tuple<bool, int64_t>> {};

TEST_P(Pendulum, StandsOnlyWhereItHangs) {
  const auto [hangs, direct_limit] = GetParam();
  constexpr double k = 0.7, mass = 0.02, g = 9.80665, length = 10;
  model::Model m;
  m.bones = {"bone"};
  m.gravity = {0, 0, -g};
  const auto support = testing::add_point(m, {1, 2, 3}, PointSet::bone, 0);
  const double z = hangs ? 3 - length : 3 + length;
  const auto bob = testing::add_point(m, {1, 2, z}, PointSet::soft_tissue, 0, 1);
  testing::add_spring(m, support, bob, k, 0);
  m.points.mass[bob] = mass;
  m.springs.rest_length[0] = hangs ? length - mass * g / k : length + mass * g / k;
  Energy energy(MPI_COMM_WORLD, m);
  const double expected = (hangs ? 1 : -1) * mass * g / length;
  EXPECT_NEAR(energy.smallest_at_start(direct_limit), expected, 1e-7 * std::abs(expected));
}

INSTANTIATE_TEST_SUITE_P(HangsAndStands, Pendulum,
                         ::testing::Combine(::testing::Bool(), ::testing::Values(always_direct)));

/// A block out of equilibrium, where the Hessian is indefinite, has the same on any ranks.
TEST_P(Solver, DoesNotDependOnTheRanks) {
  const model::Model block = testing::held_block();
  const mechanics::Weights weights{1, mechanics::VolumeTerm::penalty, 0.4};
  for (const double size : {0.05, 0.8}) {
    Energy energy(MPI_COMM_WORLD, block, weights);
    const base::VecHandle moved = testing::random_vector(energy.positions, 1, size);
    const double value = energy.smallest(moved, GetParam());
    EXPECT_NEAR(discrete::largest_block(energy.mode), 1, 1e-12);
    const base::VecHandle stretched = energy.positions.make_vector();
    check(MatMult(energy.tangent.exact(), energy.mode, stretched));
    check(VecAXPY(stretched, -value, energy.mode));
    EXPECT_LT(discrete::largest_block(stretched), 1e-3 * std::abs(value));
    double expected = 0;
    if (base::rank(MPI_COMM_WORLD) == 0) {
      Energy serial(MPI_COMM_SELF, block, weights);
      const base::VecHandle same = testing::random_vector(serial.positions, 1, size);
      expected = serial.smallest(same, always_direct);
    }
    MPI_Bcast(&expected, 1, MPI_DOUBLE, 0, MPI_COMM_WORLD);
    EXPECT_EQ(expected<0, size> 0.5) << expected;
    EXPECT_NEAR(value, expected, 1e-6 * std::abs(expected));
  }
}

INSTANTIATE_TEST_SUITE_P(DirectAndPreconditioned, Solver,
                         ::testing::Values(always_direct, never_direct));

}  // namespace stability_test
}  // namespace repose
