#include "repose/discrete/tangent.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "moved_block.h"
#include "repose/base/agreement.h"

namespace repose {
namespace tangent_test {

using base::check;

/// Springs with a volume term, or a solid whose volumes are averaged.
struct Case {
  mechanics::VolumeTerm term;
  bool averaged = false;
};

struct Moved : testing::MovedBlock {
  discrete::Objective objective;
  explicit Moved(Case c)
      : MovedBlock(c.averaged ? testing::averaged_block() : testing::held_block()),
        objective(positions, {0.7, c.term, 0.4}) {}
};

class Terms : public ::testing::TestWithParam<Case> {};

TEST_P(Terms, TheMatrixActsAsTheHessian) {
  Moved m(GetParam());
  base::VecHandle at = m.vector(1, 0.4), direction = m.vector(2, 1.0);
  discrete::Tangent tangent(m.objective);
  tangent.assemble(at);
  base::VecHandle product = m.positions.make_vector(), action = m.positions.make_vector();
  check(MatMult(tangent.exact(), direction, product));
  std::vector<Vec3> local(m.part.point_row.size(), Vec3::Zero());
  m.positions.scatter_to_local(direction, local);
  m.objective.hessian_action(local, action);
  check(VecAXPY(action, -1, product));
  EXPECT_LT(discrete::largest_block(action), 1e-12 * discrete::largest_block(product));
}

TEST_P(Terms, WhatALineSearchAddsIsTakenBack) {
  Moved m(GetParam());
  base::VecHandle at = m.vector(1, 0.4), direction = m.vector(2, 1.0);
  discrete::Tangent tangent(m.objective);
  tangent.assemble(at);
  base::VecHandle before = m.positions.make_vector(), after = m.positions.make_vector();
  check(MatMult(tangent.action(), direction, before));
  check(MatShift(tangent.action(), 3.0));
  tangent.assemble(at);
  check(MatMult(tangent.action(), direction, after));
  check(VecAXPY(after, -1, before));
  EXPECT_LT(discrete::largest_block(after), 1e-12 * discrete::largest_block(before));
}

TEST_P(Terms, TheGradientChangesByTheMatrix) {
  Moved m(GetParam());
  base::VecHandle at = m.vector(1, 0.4), direction = m.vector(2, 1.0);
  discrete::Tangent tangent(m.objective);
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
  EXPECT_LT(discrete::largest_block(forward) / (2 * h), 1e-7 * discrete::largest_block(product));
}

TEST_P(Terms, ValueAndGradientDoNotDependOnTheRanks) {
  Moved m(GetParam());
  base::VecHandle at = m.vector(1, 0.4), gradient = m.positions.make_vector();
  const double value = m.objective.evaluate(at, gradient);
  PetscReal norm = 0;
  check(VecNorm(gradient, NORM_2, &norm));
  discrete::Part serial_part = discrete::build_local_from_root(MPI_COMM_SELF, m.whole).part;
  double expected[2] = {0, 0};
  if (base::rank(MPI_COMM_WORLD) == 0) {
    discrete::Positions positions(MPI_COMM_SELF, serial_part);
    discrete::Objective objective(positions, m.objective.weights());
    base::VecHandle same = testing::random_vector(positions, 1, 0.4);
    base::VecHandle slope = positions.make_vector();
    expected[0] = objective.evaluate(same, slope);
    check(VecNorm(slope, NORM_2, &expected[1]));
  }
  MPI_Bcast(expected, 2, MPI_DOUBLE, 0, MPI_COMM_WORLD);
  EXPECT_NEAR(value, expected[0], 1e-12 * std::abs(expected[0]));
  EXPECT_NEAR(norm, expected[1], 1e-12 * expected[1]);
}

INSTANTIATE_TEST_SUITE_P(Volume, Terms,
                         ::testing::Values(Case{mechanics::VolumeTerm::none},
                                           Case{mechanics::VolumeTerm::paper},
                                           Case{mechanics::VolumeTerm::penalty},
                                           Case{mechanics::VolumeTerm::penalty, true}));

/// Eigenvalues of the action at random displacements of 0.6 mm, in ascending order.
Eigen::VectorXd eigenvalues(const model::Model& block, bool limited) {
  const discrete::Part part = discrete::build_local_from_root(MPI_COMM_SELF, block).part;
  discrete::Positions positions(MPI_COMM_SELF, part);
  discrete::Objective objective(positions, {1, mechanics::VolumeTerm::penalty, 1});
  discrete::Tangent tangent(objective);
  EXPECT_TRUE(tangent.limit_slopes(limited));
  tangent.assemble(testing::random_vector(positions, 1, 0.6));
  base::MatHandle dense;
  check(MatComputeOperator(tangent.action(), MATSEQDENSE, dense.out()));
  const double* entries = nullptr;
  PetscInt size = 0;
  check(MatGetSize(dense, &size, nullptr));
  check(MatDenseGetArrayRead(dense, &entries));
  const Eigen::MatrixXd matrix = Eigen::Map<const Eigen::MatrixXd>(entries, size, size);
  check(MatDenseRestoreArrayRead(dense, &entries));
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix, Eigen::EigenvaluesOnly)
      .eigenvalues();
}

TEST(Tangent, LimitedSlopesLeaveNoNegativeCurvature) {
  if (base::rank(MPI_COMM_WORLD) != 0) return;
  const model::Model averaged = testing::averaged_block();
  model::Model by_prism = averaged;
  by_prism.prisms.nodal_modulus.clear();
  for (const model::Model& block : {averaged, by_prism}) {
    EXPECT_LT(eigenvalues(block, false).minCoeff(), 0);
    EXPECT_GT(eigenvalues(block, true).minCoeff(), 0);
  }
}

TEST(Tangent, LimitsAreTakenBack) {
  const testing::MovedBlock m(testing::averaged_block());
  discrete::Positions positions(MPI_COMM_WORLD, m.part);
  discrete::Objective objective(positions, {1, mechanics::VolumeTerm::penalty, 1});
  discrete::Tangent tangent(objective);
  base::VecHandle direction = m.vector(2, 1.0), product[3];
  tangent.assemble(m.vector(1, 0.6));
  for (int n = 0; n < 3; ++n) {
    tangent.limit_slopes(n == 1);
    product[n] = positions.make_vector();
    check(MatMult(tangent.action(), direction, product[n]));
  }
  PetscBool same = PETSC_FALSE, limited = PETSC_FALSE;
  check(VecEqual(product[0], product[2], &same));
  check(VecEqual(product[0], product[1], &limited));
  EXPECT_TRUE(same);
  EXPECT_FALSE(limited);
}

TEST(Part, EveryRowHasOneOwner) {
  Moved m({mechanics::VolumeTerm::none});
  int64_t owned[4] = {m.part.owned_points, m.part.owned_springs, m.part.owned_prisms,
                      m.part.unknowns.owned};
  MPI_Allreduce(MPI_IN_PLACE, owned, 4, MPI_INT64_T, MPI_SUM, MPI_COMM_WORLD);
  EXPECT_EQ(owned[0], m.part.total_points);
  EXPECT_EQ(owned[1], m.part.total_springs);
  EXPECT_EQ(owned[2], m.part.total_prisms);
  EXPECT_EQ(owned[3], m.part.unknowns.total);
  for (int64_t i = 0; i + 1 < m.part.owned_points; ++i) {
    if (m.part.model.points.column[i] != m.part.model.points.column[i + 1]) continue;
    EXPECT_EQ(m.part.point_row[i] + 1, m.part.point_row[i + 1]) << "columns stay in one piece";
  }
}

}  // namespace tangent_test
}  // namespace repose
