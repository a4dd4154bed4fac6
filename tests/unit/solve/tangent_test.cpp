#include "repose/solve/tangent.h"

#include <gtest/gtest.h>

#include <random>

#include "models.h"
#include "repose/base/agreement.h"

namespace repose {
namespace {

using base::check;
using model::PointSet;

/// A block on any number of ranks, its unknowns moved from the initial position at random but the
/// same for every distribution: each displacement depends on the row of the point in the model.
struct Moved {
  model::Model whole = testing::block(9, 8, 4, 2, [](int i, int j, int a) {
    return i == 0 || j == 7 || a == 3 ? PointSet::bone : PointSet::soft_tissue;
  });
  solve::Part part = solve::distribute(MPI_COMM_WORLD, whole);
  solve::Positions positions{MPI_COMM_WORLD, part};
  solve::Objective objective;

  explicit Moved(mechanics::VolumeTerm term) : objective(positions, {0.7, term, 0.4}) {}

  base::VecHandle vector(unsigned seed, double size) {
    base::VecHandle v = positions.make_vector();
    std::vector<Vec3> values(part.point_row.size());
    for (size_t i = 0; i < values.size(); ++i) {
      std::mt19937 random(seed + 1000003u * static_cast<unsigned>(part.point_row[i]));
      for (double& x : values[i]) x = size * (random() / 2147483648.0 - 1.0);
    }
    positions.keep_owned(values, v);
    return v;
  }
};

class Terms : public ::testing::TestWithParam<mechanics::VolumeTerm> {};

TEST_P(Terms, TheMatrixActsAsTheHessian) {
  Moved m(GetParam());
  base::VecHandle at = m.vector(1, 0.4), direction = m.vector(2, 1.0);
  solve::Tangent tangent(m.objective);
  tangent.assemble(at);
  base::VecHandle product = m.positions.make_vector(), action = m.positions.make_vector();
  check(MatMult(tangent.exact(), direction, product));
  std::vector<Vec3> local(m.part.point_row.size(), Vec3::Zero());
  m.positions.spread(direction, local);
  m.objective.hessian_action(local, action);
  check(VecAXPY(action, -1, product));
  EXPECT_LT(solve::largest_block(action), 1e-12 * solve::largest_block(product));
}

TEST_P(Terms, TheGradientChangesByTheMatrix) {
  Moved m(GetParam());
  base::VecHandle at = m.vector(1, 0.4), direction = m.vector(2, 1.0);
  solve::Tangent tangent(m.objective);
  tangent.assemble(at);
  base::VecHandle product = m.positions.make_vector(), forward = m.positions.make_vector(),
                  backward = m.positions.make_vector();
  check(MatMult(tangent.exact(), direction, product));
  constexpr double h = 1e-5;
  check(VecAXPY(at, h, direction));
  m.objective.evaluate(at, forward);
  check(VecAXPY(at, -2 * h, direction));
  m.objective.evaluate(at, backward);
  check(VecAXPY(forward, -1, backward));
  check(VecAXPY(forward, -2 * h, product));
  EXPECT_LT(solve::largest_block(forward) / (2 * h), 1e-7 * solve::largest_block(product));
}

TEST_P(Terms, ValueAndGradientDoNotDependOnTheRanks) {
  Moved m(GetParam());
  base::VecHandle at = m.vector(1, 0.4), gradient = m.positions.make_vector();
  const double value = m.objective.evaluate(at, gradient);
  PetscReal norm = 0;
  check(VecNorm(gradient, NORM_2, &norm));
  solve::Part serial_part = solve::distribute(MPI_COMM_SELF, m.whole);
  double expected[2] = {0, 0};
  if (base::rank(MPI_COMM_WORLD) == 0) {
    solve::Positions positions(MPI_COMM_SELF, serial_part);
    solve::Objective objective(positions, m.objective.weights());
    std::vector<Vec3> values(serial_part.point_row.size());
    for (size_t i = 0; i < values.size(); ++i) {
      std::mt19937 random(1 + 1000003u * static_cast<unsigned>(serial_part.point_row[i]));
      for (double& x : values[i]) x = 0.4 * (random() / 2147483648.0 - 1.0);
    }
    base::VecHandle same = positions.make_vector(), slope = positions.make_vector();
    positions.keep_owned(values, same);
    expected[0] = objective.evaluate(same, slope);
    check(VecNorm(slope, NORM_2, &expected[1]));
  }
  MPI_Bcast(expected, 2, MPI_DOUBLE, 0, MPI_COMM_WORLD);
  EXPECT_NEAR(value, expected[0], 1e-12 * expected[0]);
  EXPECT_NEAR(norm, expected[1], 1e-12 * expected[1]);
}

INSTANTIATE_TEST_SUITE_P(Volume, Terms,
                         ::testing::Values(mechanics::VolumeTerm::none,
                                           mechanics::VolumeTerm::paper,
                                           mechanics::VolumeTerm::penalty));

TEST(Part, EveryRowHasOneOwner) {
  Moved m(mechanics::VolumeTerm::none);
  int64_t owned[4] = {m.part.owned_points, m.part.owned_springs, m.part.owned_prisms,
                      m.part.owned_unknowns};
  MPI_Allreduce(MPI_IN_PLACE, owned, 4, MPI_INT64_T, MPI_SUM, MPI_COMM_WORLD);
  EXPECT_EQ(owned[0], m.part.total_points);
  EXPECT_EQ(owned[1], m.part.total_springs);
  EXPECT_EQ(owned[2], m.part.total_prisms);
  EXPECT_EQ(owned[3], m.part.total_unknowns);
  for (int64_t i = 0; i + 1 < m.part.owned_points; ++i) {
    if (m.part.model.points.column[i] != m.part.model.points.column[i + 1]) continue;
    EXPECT_EQ(m.part.point_row[i] + 1, m.part.point_row[i + 1]) << "columns stay in one piece";
  }
}

}  // namespace
}  // namespace repose
