#include "repose/mechanics/prism_volume.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "repose/mechanics/term.h"
#include "states.h"

namespace repose::mechanics {
namespace prism_volume_test {

using Prism = std::array<Vec3, 6>;

double volume(const Prism& p) { return prism_volume(p.data()); }
PrismEdges<double> edges(const Prism& p) {
  PrismTriples<double> corners;
  for (int c = 0; c < 6; ++c) corners[c] = triple(p[c]);
  return PrismEdges<double>(corners);
}
Prism gradient(const Prism& p) {
  const PrismSlope<double> slope(edges(p));
  Prism g;
  for (int c = 0; c < 6; ++c) g[c] = vec3(slope.gradient[c]);
  return g;
}
/// The matrix of y ↦ w × y.
Mat3 cross_matrix(const Triple<double>& w) {
  return Mat3{{0, -w.z, w.y}, {w.z, 0, -w.x}, {-w.y, w.x, 0}};
}

const Prism unit = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0),
                    Vec3(0, 0, 1), Vec3(1, 0, 1), Vec3(0, 1, 1)};

Prism random_prism(uint32_t seed) {
  test::Random random(seed);
  Prism p = unit;
  for (Vec3& x : p) x = 3.0 * x + 1.2 * random.vector();
  return p;
}

template <class Map>
Prism mapped(const Prism& p, Map&& map) {
  Prism q;
  for (int c = 0; c < 6; ++c) q[c] = map(p[c]);
  return q;
}

Prism relabeled(const Prism& p, const std::array<int, 6>& order) {
  Prism q;
  for (int c = 0; c < 6; ++c) q[c] = p[order[c]];
  return q;
}

/// The six shape functions of the wedge by natural coordinates (ξ, η, ζ), and their derivatives.
Eigen::Matrix<double, 6, 3> shape_derivatives(double xi, double eta, double zeta) {
  const std::array<double, 3> in_triangle = {1 - xi - eta, xi, eta};
  constexpr double by_xi[] = {-1, 1, 0}, by_eta[] = {-1, 0, 1};
  Eigen::Matrix<double, 6, 3> d;
  for (int c = 0; c < 3; ++c) {
    d.row(c) << (1 - zeta) * by_xi[c], (1 - zeta) * by_eta[c], -in_triangle[c];
    d.row(c + 3) << zeta * by_xi[c], zeta * by_eta[c], in_triangle[c];
  }
  return d;
}

/// ∫ det ∂x/∂(ξ, η, ζ) by Gauss's rule of three points in ζ and the rule of the edges' midpoints in
/// the triangle: exact for degree 5 in ζ and 2 in (ξ, η).
double integrated_volume(const Prism& p) {
  Eigen::Matrix<double, 3, 6> x;
  for (int c = 0; c < 6; ++c) x.col(c) = p[c];
  const double node = 0.5 * std::sqrt(0.6);
  constexpr double midpoints[][2] = {{0.5, 0.0}, {0.5, 0.5}, {0.0, 0.5}};
  const double zetas[][2] = {{0.5 - node, 5.0 / 18}, {0.5, 8.0 / 18}, {0.5 + node, 5.0 / 18}};
  double sum = 0;
  for (const auto& [xi, eta] : midpoints)
    for (const auto& [zeta, weight] : zetas)
      sum += weight / 6 * (x * shape_derivatives(xi, eta, zeta)).determinant();
  return sum;
}

TEST(PrismVolume, UnitPrismIsHalf) { EXPECT_DOUBLE_EQ(volume(unit), 0.5); }

TEST(PrismVolume, IsTheVolumeUnderTheWedgeMap) {
  for (uint32_t seed = 0; seed < 50; ++seed)
    EXPECT_NEAR(volume(random_prism(seed)), integrated_volume(random_prism(seed)), 1e-12);
}

TEST(PrismVolume, IsTheSumOfThreeTetrahedraWhereFacesArePlane) {
  const Prism p = {Vec3(0, 0, 0), Vec3(2, 0, 0), Vec3(0, 3, 0),
                   Vec3(0, 0, 1), Vec3(2, 0, 5), Vec3(0, 3, 2)};
  EXPECT_NEAR(volume(p), 3.0 * (1 + 5 + 2) / 3, 1e-14);
}

TEST(PrismVolume, SignFollowsTheOrder) {
  EXPECT_DOUBLE_EQ(volume(relabeled(unit, {3, 4, 5, 0, 1, 2})), -0.5);
  EXPECT_DOUBLE_EQ(volume(relabeled(unit, {0, 2, 1, 3, 5, 4})), -0.5);
  EXPECT_DOUBLE_EQ(volume(relabeled(unit, {3, 5, 4, 0, 2, 1})), 0.5);
  EXPECT_DOUBLE_EQ(volume(mapped(unit, [](const Vec3& x) { return Vec3(-x.x(), x.y(), x.z()); })),
                   -0.5);
  EXPECT_EQ(volume(mapped(unit, [](const Vec3& x) { return Vec3(x.x(), x.y(), 0); })), 0.0);
}

TEST(PrismVolume, RigidMotionAndTurningTheLabelsChangeNothing) {
  const Mat3 turn = Eigen::AngleAxisd(1.1, Vec3(1, -2, 3).normalized()).toRotationMatrix();
  for (uint32_t seed = 0; seed < 20; ++seed) {
    const Prism p = random_prism(seed);
    const Vec3 shift(3, -5, 7);
    EXPECT_NEAR(volume(mapped(p, [&](const Vec3& x) { return Vec3(turn * x + shift); })), volume(p),
                1e-12);
    EXPECT_NEAR(volume(relabeled(p, {1, 2, 0, 4, 5, 3})), volume(p), 1e-12);
    EXPECT_NEAR(volume(relabeled(p, {2, 0, 1, 5, 3, 4})), volume(p), 1e-12);
  }
}

TEST(PrismVolume, IsAccurateFarFromTheOrigin) {
  const Vec3 far(1e6, -1e6, 1e6);
  for (uint32_t seed = 0; seed < 20; ++seed) {
    const Prism p = random_prism(seed);
    const Prism moved = mapped(p, [&](const Vec3& x) { return Vec3(x + far); });
    EXPECT_NEAR(volume(moved), volume(p), 1e-9 * std::abs(volume(p)));
    // What rounding left of the coordinates, brought back exactly: nothing more may be lost.
    const Prism back = mapped(moved, [&](const Vec3& x) { return Vec3(x - far); });
    EXPECT_NEAR(volume(moved), volume(back), 1e-14 * std::abs(volume(p)));
    const auto there = gradient(moved), here = gradient(back);
    for (int c = 0; c < 6; ++c) EXPECT_LT((there[c] - here[c]).norm(), 1e-14 * here[c].norm());
  }
}

TEST(PrismVolume, DerivativesAgreeWithAutomaticDifferentiation) {
  for (uint32_t seed = 0; seed < 20; ++seed) {
    const Prism p = random_prism(seed);
    const auto oracle =
        differentiate<6>(p, [](const auto& x) { return model::prism_volume(x.data()); });
    const auto skew = prism_volume_hessian(edges(p));
    EXPECT_NEAR(PrismSlope<double>(edges(p)).volume, oracle.value, 1e-13 * 27);
    for (int i = 0; i < 6; ++i) {
      EXPECT_LT((gradient(p)[i] - oracle.gradient.segment<3>(3 * i)).norm(), 1e-13 * 9);
      for (int j = i; j < 6; ++j) {
        const Mat3 block = oracle.hessian.block<3, 3>(3 * i, 3 * j);
        EXPECT_LT((cross_matrix(skew[i][j]) - block).norm(), 1e-13 * 3) << i << " " << j;
      }
    }
  }
}

}  // namespace prism_volume_test
}  // namespace repose::mechanics
