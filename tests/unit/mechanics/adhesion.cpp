#include "mechanics/adhesion.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "states.h"

/// The cohesive law in closed form, and its derivatives on either side of its largest tension.
namespace repose::mechanics {
namespace adhesion_test {

constexpr double offset = 2, force = 3, range = 6;  // mm, N, mm

/// Places of the tissue's point, so far from where the film begins to open, and of a bone in z = 0.
std::vector<Vec3> places(double opened) {
  return {{5, 4, offset + opened}, {1, 2, 0}, {11, 2, 0}, {1, 7, 0}};
}

/// The normal is +z: e1 × e2 = (0, 0, 50).
const std::vector<double> numbers = {0, 0, 1.0 / 50, offset, force, range};

double energy(const std::vector<Vec3>& x, Eigen::VectorXd& gradient) {
  return DifferentiatedTerm<Adhesion>().gradient(x, numbers, gradient);
}

TEST(Adhesion, HasItsLargestTensionAtAThirdOfItsRangeAndNoneBeyond) {
  Eigen::VectorXd gradient;
  EXPECT_EQ(energy(places(-1), gradient), 0);
  EXPECT_EQ(gradient.norm(), 0);
  energy(places(range / 3), gradient);
  EXPECT_NEAR(gradient[2], force, 1e-14);
  EXPECT_NEAR(gradient[5] + gradient[8] + gradient[11], -force, 1e-14) << "on the bone";
  for (const double opened : {0.1, 1.0, 3.0, 5.9}) {
    energy(places(opened), gradient);
    EXPECT_GT(gradient[2], 0) << opened;
    EXPECT_LT(gradient[2], force) << opened;
  }
  EXPECT_NEAR(energy(places(range + 1), gradient), 0.5625 * force * range, 1e-14);
  EXPECT_EQ(gradient.norm(), 0);
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
