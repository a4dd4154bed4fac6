#include "solve/exact_volume.h"

#include <gtest/gtest.h>

#include "models.h"
#include "rest.h"

namespace repose {
namespace {

using model::PointSet;

solve::Settings exact(double bulk_modulus, double accuracy) {
  solve::Settings settings;
  settings.weights = {1, mechanics::VolumeTerm::exact, bulk_modulus};
  settings.path.accuracy = accuracy;
  return settings;
}

/// A block on bone whose middle is held by an instrument that goes `down`, mm.
model::Model pressed_block(double down) {
  model::Model m = testing::block(7, 7, 4, 2, [](int i, int j, int a) {
    if (a == 3) return PointSet::bone;
    return a == 0 && std::abs(i - 3) <= 1 && std::abs(j - 3) <= 1 ? PointSet::held
                                                                  : PointSet::soft_tissue;
  });
  for (size_t i = 0; i < m.points.set.size(); ++i)
    if (m.points.set[i] == PointSet::held) m.points.target[i].z() -= down;
  return m;
}

/// ∂v/∂x of each corner: v is affine in each, so difference quotients are exact.
std::array<Vec3, 6> volume_slopes(std::array<Vec3, 6> corners) {
  std::array<Vec3, 6> slopes;
  for (int c = 0; c < 6; ++c)
    for (int axis = 0; axis < 3; ++axis) {
      double v[2];
      for (int side : {0, 1}) {
        corners[c][axis] += side == 0 ? -1.0 : 2.0;
        v[side] = model::prism_volume(corners.data());
      }
      corners[c][axis] -= 1.0;
      slopes[c][axis] = (v[1] - v[0]) / 2;
    }
  return slopes;
}

/// Largest |F_i + Σ p ∂v/∂x_i| over soft tissue, N.
double imbalance(const model::Model& m, const model::StepRows& rows) {
  std::vector<Vec3> force = rows.residual_force;
  for (size_t e = 0; e < m.prisms.points.size(); ++e) {
    std::array<Vec3, 6> corners;
    for (int c = 0; c < 6; ++c) corners[c] = rows.position[m.prisms.points[e][c]];
    const std::array<Vec3, 6> slopes = volume_slopes(corners);
    for (int c = 0; c < 6; ++c) force[m.prisms.points[e][c]] += rows.pressure[e] * slopes[c];
  }
  double largest = 0;
  for (size_t i = 0; i < force.size(); ++i)
    if (m.points.set[i] == PointSet::soft_tissue) largest = std::max(largest, force[i].norm());
  return largest;
}

/// Mean pressure of the prisms under held points only, N/mm².
double pressure_beneath(const model::Model& m, const model::StepRows& rows) {
  double sum = 0;
  int count = 0;
  for (size_t e = 0; e < m.prisms.points.size(); ++e) {
    const auto& corners = m.prisms.points[e];
    if (!std::all_of(corners.begin(), corners.begin() + 3,
                     [&](int64_t i) { return m.points.set[i] == PointSet::held; }))
      continue;
    sum += rows.pressure[e];
    ++count;
  }
  return sum / count;
}

class Pressed : public ::testing::TestWithParam<double> {};

TEST_P(Pressed, BlockKeepsEveryVolumeInBalance) {
  const double down = GetParam();
  const model::Model m = pressed_block(down);
  const testing::Rest rest = testing::find_rest(m, exact(0.5, 1e-6));
  ASSERT_TRUE(rest.summary.path.complete()) << rest.summary.last.reason;
  for (size_t e = 0; e < rest.rows.volume_ratio.size(); ++e)
    EXPECT_LE(std::abs(rest.rows.volume_ratio[e] - 1), 1e-6) << "prism " << e;
  EXPECT_LE(rest.summary.last.volume_error_max, 1e-6);
  EXPECT_GT(down * pressure_beneath(m, rest.rows), 0) << "compression is positive";
  double largest = 0;
  for (const Vec3& f : rest.rows.residual_force) largest = std::max(largest, f.norm());
  EXPECT_GT(largest, 0.1);
  EXPECT_LT(imbalance(m, rest.rows), 1e-5 * largest);
  EXPECT_NEAR(imbalance(m, rest.rows), rest.summary.last.gradient_max, 1e-9 * largest);
}

INSTANTIATE_TEST_SUITE_P(DownAndUp, Pressed, ::testing::Values(1.0, -1.0));

/// An upright equilateral prism on bone, its three upper points pressed down by a force each: they
/// stay an equilateral triangle, s times as large, at the height h that keeps the volume.
struct OnePrism {
  static constexpr double side = 6, height = 4, k = 0.8, force = 0.3;
  static double radius() { return side / std::sqrt(3.0); }
  static double area() { return std::sqrt(3.0) / 4 * side * side; }
  static double height_at(double s) { return 3 * height / (1 + s + s * s); }
  static double strut(double s) { return std::hypot(height_at(s), radius() * (s - 1)); }
  static double diagonal(double s) {
    return std::hypot(height_at(s), radius() * std::sqrt(1 + s + s * s));
  }

  static double energy(double s) {
    const double along = strut(s) - strut(1), across = diagonal(s) - diagonal(1);
    const double around = side * (s - 1);
    return k * (1.5 * along * along + 1.5 * around * around + 3 * across * across) +
           3 * force * (height_at(s) - height);
  }
  /// The s of least energy, by golden section.
  static double rest() {
    const double golden = (std::sqrt(5.0) - 1) / 2;
    double low = 0.8, high = 1.6;
    while (high - low > 1e-10) {
      const double a = high - golden * (high - low), b = low + golden * (high - low);
      (energy(a) < energy(b) ? high : low) = energy(a) < energy(b) ? b : a;
    }
    return 0.5 * (low + high);
  }
  /// What the force and the springs' thrust ask of the volume: (∂E/∂h) / (∂v/∂h) at constant s.
  static double pressure(double s) {
    const double h = height_at(s);
    const double thrust =
        k * h * (3 * (1 - strut(1) / strut(s)) + 6 * (1 - diagonal(1) / diagonal(s)));
    return (3 * force + thrust) / (area() * (1 + s + s * s) / 3);
  }
  static model::Model model() {
    model::Model m;
    m.bones = {"bone"};
    for (int corner = 0; corner < 6; ++corner) {
      const double angle = 2 * M_PI * (corner % 3) / 3;
      const bool upper = corner < 3;
      testing::add_point(
          m, {radius() * std::cos(angle), radius() * std::sin(angle), upper ? height : 0.0},
          upper ? PointSet::soft_tissue : PointSet::bone, corner % 3, !upper);
      if (upper) m.points.external_force[corner] = {0, 0, -force};
    }
    for (int c = 0; c < 3; ++c) {
      testing::add_spring(m, c, c + 3, k, 0);
      testing::add_spring(m, c, (c + 1) % 3, k, 0);
      testing::add_spring(m, c, (c + 1) % 3 + 3, k, 0);
      testing::add_spring(m, c, (c + 2) % 3 + 3, k, 0);
    }
    testing::add_prism(m, {0, 2, 1, 3, 5, 4});
    return m;
  }
};

TEST(ExactVolume, OnePrismUnderAForceMeetsItsClosedForm) {
  const testing::Rest rest = testing::find_rest(OnePrism::model(), exact(0.05, 1e-8));
  ASSERT_TRUE(rest.summary.path.complete()) << rest.summary.last.reason;
  const double s = OnePrism::rest();
  EXPECT_GT(s, 1.01);
  for (int corner = 0; corner < 3; ++corner) {
    const Vec3& x = rest.rows.position[corner];
    EXPECT_NEAR(std::hypot(x.x(), x.y()), s * OnePrism::radius(), 3e-6);
    EXPECT_NEAR(x.z(), OnePrism::height_at(s), 3e-6);
  }
  EXPECT_NEAR(rest.rows.pressure[0], OnePrism::pressure(s), 1e-5 * OnePrism::pressure(s));
}

/// One free point in a closed box of held points whose lid comes down: the volume has nowhere to
/// go.
TEST(ExactVolume, SaysWhereVolumeCannotBeKept) {
  model::Model m = testing::block(3, 3, 3, 2, [](int i, int j, int a) {
    return i == 1 && j == 1 && a == 1 ? PointSet::soft_tissue : PointSet::held;
  });
  testing::aim(m, [](const Vec3& x) -> Vec3 { return {x.x(), x.y(), 0.9 * x.z()}; });
  const testing::Rest rest = testing::find_rest(m, exact(0.5, 1e-3));
  EXPECT_FALSE(rest.summary.path.complete());
  EXPECT_FALSE(rest.summary.last.converged);
  EXPECT_NE(rest.summary.last.reason.find("volume cannot be kept"), std::string::npos)
      << rest.summary.last.reason;
}

}  // namespace
}  // namespace repose
