#include "mechanics/adhesion.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "states.h"

/// The law in closed form, and its derivatives.
namespace repose::mechanics {
namespace adhesion_test {

constexpr double offset = 2, force = 3, range = 2;  // mm, N, mm

/// The place of the tissue's point, so far from where the tension begins, over a bone in z = 0.
std::vector<Vec3> places(double opened) { return {{5, 4, offset + opened}}; }

const std::vector<double> numbers = {0, 0, 1, offset, force, range, 0};

double energy(const std::vector<Vec3>& x, Eigen::VectorXd& gradient) {
  return DifferentiatedTerm<Adhesion>().gradient(x, numbers, gradient);
}

TEST(Adhesion, GrowsToItsLargestTensionAndNeverFalls) {
  Eigen::VectorXd gradient;
  EXPECT_EQ(energy(places(-1), gradient), 0);
  EXPECT_EQ(gradient.norm(), 0);
  EXPECT_NEAR(energy(places(range), gradient), force * range * (std::sqrt(2.0) - 1), 1e-14);
  EXPECT_NEAR(gradient[2], force / std::sqrt(2.0), 1e-14);
  double before = 0;
  for (const double opened : {1e-6, 0.1, 1.0, 6.0, 40.0}) {
    energy(places(opened), gradient);
    EXPECT_GT(gradient[2], before) << opened;
    EXPECT_LT(gradient[2], force) << opened;
    before = gradient[2];
  }
  EXPECT_GT(before, 0.99 * force);
}

TEST(Adhesion, IsConvexInTheTissuesPosition) {
  for (const double opened : {-1.0, 0.5, 1.5, 12.0}) {
    const Mat3 own =
        DifferentiatedTerm<Adhesion>().hessian(places(opened), numbers).topLeftCorner<3, 3>();
    EXPECT_GE(own(2, 2), 0) << opened;
    EXPECT_EQ(own.norm(), own(2, 2)) << opened;
  }
}

TEST(Adhesion, GoesWithTheBone) {
  const model::TermElements elements{"adhesion", 1, 7, {0}, numbers, 6};
  model::Points points;
  points.position = places(1.5);
  points.set = {model::PointSet::soft_tissue};
  const TermLoop loop(elements, points, 1);
  Mat4 pose = Mat4::Identity();
  pose.topLeftCorner<3, 3>() =
      Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  pose.topRightCorner<3, 1>() = Vec3(3, -8, 2);
  const Mat3 turn = pose.topLeftCorner<3, 3>();
  const std::vector<Mat4> poses = {pose};
  const std::vector<Vec3> moved = {turn * points.position[0] + pose.topRightCorner<3, 1>()};
  std::vector<Vec3> before(1, Vec3::Zero()), after = before;
  const double value = loop.add_gradient(points.position, {}, 1, before);
  EXPECT_GT(before[0].norm(), 0.5);
  EXPECT_NEAR(loop.add_gradient(moved, poses, 1, after), value, 1e-13);
  EXPECT_DOUBLE_EQ(loop.value(moved, poses), loop.add_gradient(moved, poses, 0, before));
  EXPECT_LE((after[0] - turn * before[0]).norm(), 1e-13);
  Mat3 own, turned;
  const auto into = [](Mat3& block) {
    return [&block](int32_t, int32_t, const Mat3& of) { block = of; };
  };
  loop.for_each_block(points.position, {}, true, into(own));
  loop.for_each_block(moved, poses, true, into(turned));
  EXPECT_LE((turned - turn * own * turn.transpose()).norm(), 1e-13);
}

TEST(Adhesion, TaylorRemaindersFallAsTheyShould) {
  test::Random random(7);
  Eigen::VectorXd d(3), gradient, unused;
  for (double& x : d) x = random();
  for (const double opened : {0.8, 2.0, 4.0}) {
    const std::vector<Vec3> at = places(opened);
    const double here = energy(at, gradient);
    const Eigen::MatrixXd hessian = DifferentiatedTerm<Adhesion>().hessian(at, numbers);
    const auto second = [&](double h) {
      std::vector<Vec3> x = at;
      x[0] += h * d;
      return energy(x, unused) - here - h * gradient.dot(d) - h * h / 2 * d.dot(hessian * d);
    };
    EXPECT_LE(std::abs(second(1.0 / 128)), 0.15 * std::abs(second(1.0 / 64)) + 1e-13) << opened;
  }
}

}  // namespace adhesion_test
}  // namespace repose::mechanics
