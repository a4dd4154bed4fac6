#include "repose/scene/rigid_motion.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "folder.h"

namespace repose::scene {
namespace rigid_motion_test {

constexpr double degree = std::numbers::pi / 180;

double difference(const Mat4& a, const Mat4& b) { return (a - b).cwiseAbs().maxCoeff(); }

double orthonormality(const Mat4& m) {
  const Mat3 r = m.topLeftCorner<3, 3>();
  return (r.transpose() * r - Mat3::Identity()).cwiseAbs().maxCoeff();
}

/// A turn about an axis off the origin and a slide along and across it.
RigidMotion example(double degrees) {
  const RigidMotion turn = RigidMotion::rotation({1, -2, 0.5}, {10, 20, -30}, degrees);
  return RigidMotion::translation({0.5, 6, -2}).after(turn);
}

std::vector<Vec3> cloud(int n, unsigned seed = 3) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-50, 50);
  std::vector<Vec3> points(n);
  for (Vec3& p : points) p = Vec3(uniform(random), uniform(random), uniform(random));
  return points;
}

std::vector<Vec3> moved(const std::vector<Vec3>& points, const RigidMotion& motion) {
  std::vector<Vec3> result;
  for (const Vec3& p : points) result.push_back(motion.apply(p));
  return result;
}

TEST(RigidMotion, RotationTurnsByTheRightHandRule) {
  const RigidMotion quarter = RigidMotion::rotation({0, 0, 7}, {1, 1, 5}, 90);
  EXPECT_LT((quarter.apply({2, 1, 0}) - Vec3(1, 2, 0)).norm(), 1e-15);
  EXPECT_LT((quarter.apply({1, 1, 9}) - Vec3(1, 1, 9)).norm(), 1e-15) << "the axis stays";
}

TEST(RigidMotion, AfterIsTheMatrixProduct) {
  const RigidMotion a = example(25), b = RigidMotion::rotation({0, 1, 0}, {3, 0, 0}, -70);
  EXPECT_LT(difference(b.after(a).matrix(), b.matrix() * a.matrix()), 1e-13);
  EXPECT_GT(difference(b.after(a).matrix(), a.after(b).matrix()), 1) << "order matters";
}

TEST(RigidMotion, InverseUndoes) {
  EXPECT_TRUE(example(33).after(example(33).inverse()).is_identity());
  EXPECT_FALSE(example(33).is_identity());
  EXPECT_FALSE(RigidMotion::rotation({1, 0, 0}, {0, 0, 0}, 1e-9).is_identity());
  EXPECT_TRUE(RigidMotion{}.is_identity());
}

TEST(RigidMotion, EndsAreExact) {
  for (double degrees : {0.0, 1e-9, 8.0, 180.0}) {
    const RigidMotion motion = example(degrees);
    EXPECT_EQ(motion.matrix(0), Mat4::Identity());
    EXPECT_EQ(RigidMotion::from_matrix(motion.matrix(1)).matrix(), motion.matrix(1));
  }
}

// The tenth root of M with the shortest turn; its powers are M at the other loads.
TEST(RigidMotion, PartIsTheMatrixPower) {
  constexpr int parts = 10;
  for (double degrees : {0.5, 8.0, 45.0, 120.0, 175.0}) {
    const RigidMotion motion = example(degrees);
    const Mat4 root = motion.matrix(1.0 / parts);
    EXPECT_NEAR((root.topLeftCorner<3, 3>().trace()), 1 + 2 * std::cos(degrees * degree / parts),
                1e-13);
    Mat4 power = Mat4::Identity();
    for (int k = 1; k <= parts; ++k) {
      power *= root;
      EXPECT_LT(difference(motion.matrix(1.0 * k / parts), power), 1e-12)
          << degrees << "°, " << k << " parts";
    }
  }
}

TEST(RigidMotion, HalfTwiceIsTheWhole) {
  for (double degrees : {0.0, 1e-12, 1e-9, 1e-6, 1e-3, 1.0, 90.0, 179.999999, 180.0, -180.0}) {
    const RigidMotion motion = example(degrees);
    const Mat4 half = motion.matrix(0.5);
    EXPECT_LT(difference(half * half, motion.matrix()), 1e-13) << degrees;
    EXPECT_LT(difference(motion.matrix(0.3) * motion.matrix(0.7), motion.matrix()), 1e-13)
        << degrees;
  }
}

TEST(RigidMotion, PartsAreRigidToRounding) {
  for (double degrees : {1e-9, 1.0, 90.0, 180.0})
    for (double load : {0.0, 1e-9, 0.25, 0.75, 1.0})
      EXPECT_LT(orthonormality(example(degrees).matrix(load)), 2e-15) << degrees << " " << load;
}

TEST(RigidMotion, AxisOfARotationStaysAtEveryLoad) {
  for (double degrees : {1e-9, 30.0, 180.0}) {
    const Vec3 center(1e3, -2e3, 5e2), axis(1, 2, 3);
    const RigidMotion motion = RigidMotion::rotation(axis, center, degrees);
    for (double load : {0.25, 0.5, 1.0})
      EXPECT_LT((motion.apply(center + 3 * axis, load) - center - 3 * axis).norm(), 2e-12);
  }
}

TEST(RigidMotion, TinyTurnKeepsItsDigits) {
  const double degrees = 1e-9;
  const Mat4 half = RigidMotion::rotation({0, 0, 1}, {0, 0, 0}, degrees).matrix(0.5);
  EXPECT_NEAR(half(1, 0) / (0.5 * degrees * degree), 1, 1e-12);
  const Vec3 arm(1, 0, 0), center(0, 0, 0);
  const double height = RigidMotion::rotation({0, 0, 1}, center, degrees).apply(arm, 0.5).y();
  EXPECT_NEAR(height / (0.5 * degrees * degree), 1, 1e-12);
}

TEST(RigidMotion, PartOfATranslationIsStraight) {
  const RigidMotion motion = RigidMotion::translation({4, -8, 2});
  EXPECT_EQ(motion.apply({1, 1, 1}, 0.25), Vec3(2, -1, 1.5));
}

TEST(RigidMotion, HalfTurnGoesAKnownWay) {
  const RigidMotion motion = RigidMotion::rotation({0, 0, -1}, {0, 0, 0}, 180);
  EXPECT_LT((motion.apply({1, 0, 0}, 0.5) - Vec3(0, 1, 0)).norm(), 1e-15)
      << "about +z, the largest component of the axis";
}

TEST(RigidMotion, MatrixWithRoundedDigitsBecomesRigid) {
  Mat4 matrix = example(37).matrix();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) matrix(i, j) = std::round(matrix(i, j) * 1e7) / 1e7;
  ASSERT_GT(orthonormality(matrix), 1e-9);
  const RigidMotion motion = RigidMotion::from_matrix(matrix);
  EXPECT_LT(orthonormality(motion.matrix()), 2e-15);
  EXPECT_LT(difference(motion.matrix(), matrix), 1e-6);
}

TEST(RigidMotion, RefusesWhatIsNotRigid) {
  Mat4 matrix = example(10).matrix();
  const auto refused = [](const Mat4& m) { return refusal([&] { RigidMotion::from_matrix(m); }); };
  EXPECT_EQ(refused(matrix), "accepted");
  Mat4 bad = matrix;
  bad.topLeftCorner<3, 3>() *= 1.00001;
  EXPECT_NE(refused(bad).find("not rigid: RᵀR differs from the identity by 2e-05"),
            std::string::npos)
      << refused(bad);
  bad = matrix;
  bad.col(0) *= -1;
  EXPECT_NE(refused(bad).find("reflection"), std::string::npos);
  bad = matrix;
  bad(3, 1) = 0.5;
  EXPECT_NE(refused(bad).find("last row"), std::string::npos);
  bad = matrix;
  bad(0, 3) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refused(bad).find("finite"), std::string::npos);
  EXPECT_NE(refused(Mat4::Zero()).find("last row"), std::string::npos);
  EXPECT_NE(refusal([] {
              RigidMotion::rotation({0, 0, 0}, {1, 2, 3}, 5);
            }).find("axis"),
            std::string::npos);
}

TEST(RigidFit, RecoversAMotion) {
  for (double degrees : {0.0, 1e-7, 45.0, 180.0}) {
    const RigidMotion motion = example(degrees);
    const std::vector<Vec3> from = cloud(20);
    const RigidFit fit = fit_rigid_motion(from, moved(from, motion));
    EXPECT_LT(difference(fit.motion.matrix(), motion.matrix()), 1e-12) << degrees;
    EXPECT_LT(fit.residual, 1e-12);
  }
}

TEST(RigidFit, ThreePointsAndFarFromTheOrigin) {
  std::vector<Vec3> from = cloud(3);
  for (Vec3& p : from) p += Vec3(1e6, 1e6, 1e6);
  EXPECT_LT(fit_rigid_motion(from, moved(from, example(12))).residual, 1e-8);
}

TEST(RigidFit, MirroredPointsGiveARotation) {
  const std::vector<Vec3> from = cloud(12);
  std::vector<Vec3> to = from;
  for (Vec3& p : to) p.x() *= -1;
  const RigidFit fit = fit_rigid_motion(from, to);
  EXPECT_NEAR(fit.motion.matrix().topLeftCorner(3, 3).determinant(), 1, 1e-12);
  EXPECT_GT(fit.residual, 1);
}

// Kabsch is the least-squares optimum: no small turn of it does better.
TEST(RigidFit, IsTheBestOfItsNeighbors) {
  const std::vector<Vec3> from = cloud(15), noise = cloud(15, 8);
  std::vector<Vec3> to = moved(from, example(50));
  for (std::size_t i = 0; i < to.size(); ++i) to[i] += 0.1 * noise[i];
  const RigidMotion best = fit_rigid_motion(from, to).motion;
  const auto error = [&](const RigidMotion& motion) {
    double sum = 0;
    for (std::size_t i = 0; i < to.size(); ++i)
      sum += (motion.apply(from[i]) - to[i]).squaredNorm();
    return sum;
  };
  for (const Vec3& direction : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)})
    for (double amount : {-0.01, 0.01}) {
      const RigidMotion turn = RigidMotion::rotation(direction, {0, 0, 0}, amount);
      EXPECT_LT(error(best), error(turn.after(best)));
      EXPECT_LT(error(best), error(RigidMotion::translation(amount * direction).after(best)));
    }
}

TEST(RigidFit, RefusesTooFewAndCollinear) {
  const auto refused = [](const std::vector<Vec3>& from) {
    return refusal([&] { fit_rigid_motion(from, from); });
  };
  EXPECT_NE(refused(cloud(2)).find("three points"), std::string::npos);
  EXPECT_NE(refused({{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {5, 5, 5}}).find("on a line"),
            std::string::npos);
  EXPECT_NE(refused({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}).find("on a line"), std::string::npos);
  EXPECT_EQ(refused({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), "accepted");
  EXPECT_NE(refusal([] { fit_rigid_motion(cloud(4), cloud(5)); }).find("4 and 5"),
            std::string::npos);
}

}  // namespace rigid_motion_test
}  // namespace repose::scene
