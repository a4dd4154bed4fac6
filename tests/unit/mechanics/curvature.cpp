#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "assembled.h"
#include "states.h"

/// Which Hessians are positive semidefinite, and what happens where springs have no length.
namespace repose::mechanics {
namespace curvature_test {

using test::State;

Loops all_loops(const model::Model& model) {
  return make_loops(model, static_cast<int64_t>(model.springs.points.size()),
                    static_cast<int64_t>(model.prisms.points.size()));
}

template <class Matrix>
void expect_semidefinite(const Matrix& matrix) {
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(matrix, Eigen::EigenvaluesOnly);
  const auto values = solver.eigenvalues();
  EXPECT_GE(values.minCoeff(), -1e-12 * values.cwiseAbs().maxCoeff());
}

TEST(ConvexCurvature, BlocksArePositiveSemidefiniteInEveryState) {
  const model::Model model = test::uneven_patch();
  const Loops loops = all_loops(model);
  for (const auto& info : test::all_states)
    for (VolumeTerm volume : {VolumeTerm::paper, VolumeTerm::penalty}) {
      SCOPED_TRACE(info.name);
      const auto x = test::positions(model, info.state);
      for (const SpringLoop& loop : loops.springs)
        for_each_spring_block(loop, x, 0.7, Curvature::semidefinite,
                              [](int64_t, const Mat3& block) { expect_semidefinite(block); });
      for_each_prism_block(loops, x, {0.7, volume, 1.3},
                           std::vector<double>(loops.prisms.size(), 0.0),
                           [](int64_t, const PrismBlocks& blocks) {
                             Eigen::Matrix<double, 18, 18> matrix;
                             for (int i = 0; i < 6; ++i)
                               for (int j = 0; j < 6; ++j)
                                 matrix.block<3, 3>(3 * i, 3 * j) = blocks[i][j];
                             expect_semidefinite(matrix);
                           });
    }
}

TEST(ConvexCurvature, BlocksArePositiveSemidefiniteForExtremeSprings) {
  test::Random random(3);
  for (double length : {0.0, 1e-12, 1e-3, 1.0, 1e6})
    for (double rest : {0.0, 1e-6, 1.0, 1e3})
      for (double stiffness : {1e-9, 1.0, 1e12})
        for (double inverse : {1e-3, 1.0, 1e3}) {
          const Vec3 d = length * random.vector();
          expect_semidefinite(
              spring_block<0>(d, stiffness, rest, inverse, Curvature::semidefinite));
          expect_semidefinite(
              spring_block<1>(d, stiffness, rest, inverse, Curvature::semidefinite));
          expect_semidefinite(
              spring_block<2>(d, stiffness, rest, inverse, Curvature::semidefinite));
        }
}

TEST(ConvexCurvature, IsTheExactOneWhereAllSpringsAreStretched) {
  const model::Model model = test::uneven_patch();
  const Loops loops = all_loops(model);
  const Weights springs_only{0.7, VolumeTerm::none, 0};
  const auto difference = [&](State state) {
    const auto x = test::positions(model, state);
    const Eigen::MatrixXd exact = test::assemble(loops, springs_only, x, Curvature::exact);
    return (exact - test::assemble(loops, springs_only, x, Curvature::semidefinite)).norm() /
           exact.norm();
  };
  EXPECT_EQ(difference(State::stretched), 0.0);
  EXPECT_GT(difference(State::compressed), 0.1);
}

TEST(ExactCurvature, SeesThatCompressedSpringsBuckle) {
  const Mat3 block = spring_block<2>(Vec3(0.5, 0, 0), 1.0, 1.0, 1.0, Curvature::exact);
  EXPECT_LT(block(1, 1), 0);
  EXPECT_EQ(spring_block<2>(Vec3(0.5, 0, 0), 1.0, 1.0, 1.0, Curvature::semidefinite)(1, 1), 0);
}

/// Energy, gradient, Hessian blocks and action of one spring along a slanted line.
void expect_finite(int exponent, double length, double rest) {
  SCOPED_TRACE(testing::Message() << "p " << exponent << " r " << length << " l " << rest);
  const SpringLoop loop{exponent, {{0, 1}}, {2.0}, {rest}, {1.0}, 1};
  const std::vector<Vec3> x = {Vec3(1e-170, 0, 0), Vec3(1e-170, 0, 0) + length * Vec3(0.6, 0, 0.8)};
  std::vector<Vec3> gradient(2, Vec3::Zero());
  EXPECT_TRUE(std::isfinite(add_spring_gradient(loop, x, 1.0, gradient)));
  const double tension = with_exponent(
      exponent, [&]<int p>() { return std::abs(spring_tension<p>(length - rest, 2.0, 1.0)); });
  for (const Vec3& g : gradient) EXPECT_LE(g.norm(), 1.5 * tension);
  EXPECT_EQ(gradient[0], -gradient[1]);
  for (Curvature curvature : {Curvature::exact, Curvature::semidefinite})
    for_each_spring_block(loop, x, 1.0, curvature,
                          [](int64_t, const Mat3& block) { EXPECT_TRUE(block.allFinite()); });
  std::vector<Vec3> product(2, Vec3::Zero());
  Loops alone;
  alone.springs = {loop};
  add_hessian_action(alone, x, {}, std::vector<Vec3>{Vec3(1, 2, 3), Vec3::Zero()}, product, {});
  EXPECT_TRUE(product[0].allFinite() && product[1].allFinite());
}

TEST(SpringsWithoutLength, StayFinite) {
  for (int exponent = 0; exponent <= 2; ++exponent)
    for (double length : {0.0, 1e-300, 1e-170, 1e-161, 1e-154, 1e-100, 1e-9, 1.0})
      for (double rest : {0.0, 1e-170, 1e-9, 1.0, 30.0}) expect_finite(exponent, length, rest);
}

TEST(SpringsWithoutLength, PushNowhere) {
  const SpringLoop loop{2, {{0, 1}}, {2.0}, {1.0}, {1.0}, 1};
  const std::vector<Vec3> x(2, Vec3(1, 2, 3));
  std::vector<Vec3> gradient(2, Vec3::Zero());
  EXPECT_DOUBLE_EQ(add_spring_gradient(loop, x, 1.0, gradient), 0.5 * 2.0 * (1 + 1 + 1.0 / 3));
  EXPECT_EQ(gradient[0], Vec3::Zero());
  const Mat3 block = spring_block<2>(Vec3::Zero(), 2.0, 1.0, 1.0, Curvature::exact);
  EXPECT_EQ(block, Mat3(spring_tangent<2>(-1.0, 2.0, 1.0) * Mat3::Identity()));
}

}  // namespace curvature_test
TEST(NodalGradients, ARankWithoutPrismsHasNoneAtItsPoints) {
  const std::vector<Vec3> points(3, Vec3::Zero());
  const auto gradients = mechanics::nodal_gradients(mechanics::NodalVolumes{}, 3, points);
  ASSERT_EQ(gradients.size(), points.size());
  for (const auto& gradient : gradients) EXPECT_TRUE(gradient.points.empty());
}

}  // namespace repose::mechanics
