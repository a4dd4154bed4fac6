#include "repose/solve/prestress.h"

#include <gtest/gtest.h>

#include "../discrete/models.h"
#include "repose/base/agreement.h"
#include "repose/base/error.h"
#include "repose/mechanics/spring_law.h"

namespace repose {
namespace prestress_test {

using model::PointSet;

/// A block held at its rim and depth, with weight and a skin set of its own.
model::Model weighty_block(int exponent) {
  model::Model m = testing::block(8, 7, 4, exponent, [](int i, int j, int a) {
    return i == 0 || i == 7 || j == 0 || j == 6 || a == 3 ? PointSet::bone : PointSet::soft_tissue;
  });
  m.spring_sets = {"inner", "layer 0"};
  for (size_t e = 0; e < m.springs.points.size(); ++e) {
    const auto& [p, q] = m.springs.points[e];
    m.springs.set[e] = m.points.layer[p] == 0 && m.points.layer[q] == 0;
  }
  m.gravity = {1, 2, -9.80665};
  std::fill(m.points.mass.begin(), m.points.mass.end(), 0.004);
  return m;
}

/// F_i of Eq. 6 at the initial position by a plain loop, springs and weight.
std::vector<Vec3> initial_forces(const model::Model& m) {
  std::vector<Vec3> force(m.points.position.size());
  for (size_t i = 0; i < force.size(); ++i) force[i] = m.points.mass[i] * m.gravity;
  for (size_t e = 0; e < m.springs.points.size(); ++e) {
    const auto& [p, q] = m.springs.points[e];
    const Vec3 d = m.points.position[q] - m.points.position[p];
    const double tension = mechanics::with_exponent(m.springs.exponent[e], [&]<int k>() {
      return mechanics::spring_tension<k>(d.norm() - m.springs.rest_length[e],
                                          m.springs.stiffness[e], 1 / m.springs.reference[e]);
    });
    force[p] += tension * d.normalized();
    force[q] -= tension * d.normalized();
  }
  return force;
}

class PrestressOf : public ::testing::TestWithParam<int> {};

TEST_P(PrestressOf, BalancesEveryFreePointAndEndsOnTheBone) {
  model::Model m = weighty_block(GetParam());
  const solve::Prestress result = solve::prestress(MPI_COMM_WORLD, m, {0.1, m.gravity});
  if (base::rank(MPI_COMM_WORLD) != 0) return;
  const std::vector<Vec3> force = initial_forces(m);
  Vec3 all = Vec3::Zero(), weight = Vec3::Zero();
  double residual = 0;
  for (size_t i = 0; i < force.size(); ++i) {
    all += force[i];
    weight += m.points.mass[i] * m.gravity;
    if (m.points.set[i] == PointSet::soft_tissue) residual = std::max(residual, force[i].norm());
  }
  EXPECT_GT(result.largest_force, 0.01);
  EXPECT_LE(residual, 1.1e-12 * result.largest_force);
  EXPECT_NEAR(result.residual, residual, 1e-13);
  EXPECT_LT((all - weight).norm(), 1e-10);
  EXPECT_GT(result.min_rest_ratio, 0);
  EXPECT_LT(result.min_rest_ratio, 1);
}

TEST_P(PrestressOf, GivesTheSkinItsTurgor) {
  model::Model m = weighty_block(GetParam());
  const std::vector<double> initial = m.springs.rest_length;
  solve::prestress(MPI_COMM_WORLD, m, {0.1, m.gravity});
  if (base::rank(MPI_COMM_WORLD) != 0) return;
  for (size_t e = 0; e < initial.size(); ++e) {
    if (m.springs.set[e] != 1) continue;
    EXPECT_DOUBLE_EQ(m.springs.rest_length[e], initial[e] / 1.1);
  }
}

TEST_P(PrestressOf, TakesTheGravityOfTheRecording) {
  model::Model lying = weighty_block(GetParam()), upright = lying;
  lying.gravity = {0, 9.80665, 0};
  solve::prestress(MPI_COMM_WORLD, lying, {0.1, lying.gravity});
  solve::prestress(MPI_COMM_WORLD, upright, {0.1, lying.gravity});
  for (size_t e = 0; e < lying.springs.points.size(); ++e)
    EXPECT_NEAR(lying.springs.rest_length[e], upright.springs.rest_length[e], 1e-11);
  EXPECT_NE(lying.gravity, upright.gravity);
}

TEST_P(PrestressOf, DoesNotDependOnTheRanks) {
  model::Model alone = weighty_block(GetParam()), together = alone;
  solve::prestress(MPI_COMM_SELF, alone, {0.1, alone.gravity});
  solve::prestress(MPI_COMM_WORLD, together, {0.1, together.gravity});
  if (base::rank(MPI_COMM_WORLD) != 0) return;
  for (size_t e = 0; e < alone.springs.points.size(); ++e)
    EXPECT_NEAR(together.springs.rest_length[e], alone.springs.rest_length[e], 1e-11);
}

INSTANTIATE_TEST_SUITE_P(Exponents, PrestressOf, ::testing::Values(0, 1, 2));

TEST(Prestress, LeavesAModelWithoutTurgorAndWeightAlone) {
  model::Model m = weighty_block(2);
  m.gravity.setZero();
  const std::vector<double> initial = m.springs.rest_length;
  solve::prestress(MPI_COMM_WORLD, m, {0, m.gravity});
  for (size_t e = 0; e < initial.size(); ++e)
    EXPECT_DOUBLE_EQ(m.springs.rest_length[e], initial[e]);
}

TEST(Prestress, BalancesToTheRoundingOfLengthsWhereTheWeightIsNextToNothing) {
  model::Model m = weighty_block(2);
  std::fill(m.points.mass.begin(), m.points.mass.end(), 1e-9);
  const solve::Prestress result = solve::prestress(MPI_COMM_WORLD, m, {0, m.gravity});
  EXPECT_LT(result.residual, 1e-12);  // N; some springs of 1 N/mm and 10 mm meet in a point
}

TEST(Prestress, RefusesRestLengthsBelowZeroAndNamesTheSpring) {
  model::Model m = weighty_block(0);
  std::fill(m.points.mass.begin(), m.points.mass.end(), 10.0);
  try {
    solve::prestress(MPI_COMM_WORLD, m, {0, m.gravity});
    FAIL() << "not refused";
  } catch (const base::InputError& e) {
    EXPECT_NE(std::string(e.what()).find("is spring "), std::string::npos) << e.what();
  }
}

TEST(Prestress, RefusesAPointThatNothingHolds) {
  model::Model m;
  m.bones = {"bone"};
  m.spring_sets = {"all"};
  m.gravity = {0, 0, -9.80665};
  const auto top = testing::add_point(m, {0, 0, 0}, PointSet::bone, 0);
  const auto side = testing::add_point(m, {5, 0, 0}, PointSet::soft_tissue, 1);
  testing::add_spring(m, top, side, 1, 0);
  m.points.mass[side] = 0.1;
  try {
    solve::prestress(MPI_COMM_WORLD, m, {0, m.gravity});
    FAIL() << "not refused";
  } catch (const base::InputError& e) {
    EXPECT_NE(std::string(e.what()).find("point 1 "), std::string::npos) << e.what();
  }
}

}  // namespace prestress_test
}  // namespace repose
