#include "mechanics/adhesion.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "states.h"

/// The law in closed form, and its derivatives.
namespace repose::mechanics {
namespace adhesion_test {

constexpr double offset = 2, force = 3, range = 2;  // mm, N, mm

/// Places of the tissue's point, so far from where the tension begins, and of a bone in z = 0.
std::vector<Vec3> places(double opened) {
  return {{5, 4, offset + opened}, {1, 2, 0}, {11, 2, 0}, {1, 7, 0}};
}

/// The normal is +z: e1 × e2 = (0, 0, 50).
const std::vector<double> numbers = {0, 0, 1.0 / 50, offset, force, range};

double energy(const std::vector<Vec3>& x, Eigen::VectorXd& gradient) {
  return DifferentiatedTerm<Adhesion>().gradient(x, numbers, gradient);
}

TEST(Adhesion, GrowsToItsLargestTensionAndNeverFalls) {
  Eigen::VectorXd gradient;
  EXPECT_EQ(energy(places(-1), gradient), 0);
  EXPECT_EQ(gradient.norm(), 0);
  EXPECT_NEAR(energy(places(range), gradient), force * range * (std::sqrt(2.0) - 1), 1e-14);
  EXPECT_NEAR(gradient[2], force / std::sqrt(2.0), 1e-14);
  EXPECT_NEAR(gradient[5] + gradient[8] + gradient[11], -gradient[2], 1e-14) << "on the bone";
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
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  Eigen::VectorXd before, after;
  std::vector<Vec3> x = places(1.5);
  const double value = energy(x, before);
  for (Vec3& at : x) at = turn * at + Vec3(3, -8, 2);
  EXPECT_NEAR(energy(x, after), value, 1e-13);
  for (int p = 0; p < 4; ++p)
    EXPECT_LE((after.segment<3>(3 * p) - turn * before.segment<3>(3 * p)).norm(), 1e-13);
}

TEST(Adhesion, TaylorRemaindersFallAsTheyShould) {
  test::Random random(7);
  Eigen::VectorXd d(12), gradient, unused;
  for (double& x : d) x = random();
  for (const double opened : {0.8, 2.0, 4.0}) {
    const std::vector<Vec3> at = places(opened);
    const double here = energy(at, gradient);
    const Eigen::MatrixXd hessian = DifferentiatedTerm<Adhesion>().hessian(at, numbers);
    const auto second = [&](double h) {
      std::vector<Vec3> x = at;
      for (int p = 0; p < 4; ++p) x[p] += h * d.segment<3>(3 * p);
      return energy(x, unused) - here - h * gradient.dot(d) - h * h / 2 * d.dot(hessian * d);
    };
    EXPECT_LE(std::abs(second(1.0 / 128)), 0.15 * std::abs(second(1.0 / 64)) + 1e-13) << opened;
  }
}

}  // namespace adhesion_test
}  // namespace repose::mechanics
