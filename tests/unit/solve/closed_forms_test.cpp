#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../discrete/models.h"
#include "repose/mechanics/spring_law.h"
#include "repose/scene/rigid_motion.h"
#include "rest.h"

namespace repose {
namespace closed_forms_test {

using model::PointSet;
using testing::Rest;

constexpr double g = 9.80665;

Rest find_rest(const model::Model& m, double accuracy,
               mechanics::Weights weights = {1, mechanics::VolumeTerm::none, 0}) {
  solve::Settings settings;
  settings.weights = weights;
  settings.path.accuracy = accuracy;
  return testing::find_rest(m, settings);
}

/// The elongation at which a spring of exponent p carries `tension`, by bisection.
double elongation(int p, double k0, double tension) {
  double low = 0, high = 1e3;
  for (int i = 0; i < 200; ++i) {
    const double s = 0.5 * (low + high);
    const double t = mechanics::with_exponent(
        p, [&]<int q>() { return mechanics::spring_tension<q>(s, k0, 1.0); });
    (t < tension ? low : high) = s;
  }
  return low;
}

class Laws : public ::testing::TestWithParam<int> {};

TEST_P(Laws, HangingSpring) {
  model::Model m;
  m.bones = {"bone"};
  m.gravity = {0, 0, -g};
  const auto top = testing::add_point(m, {1, 2, 3}, PointSet::bone, 0);
  const auto bob = testing::add_point(m, {1, 2, -7}, PointSet::soft_tissue, 0, 1);
  testing::add_spring(m, top, bob, 0.7, GetParam());
  m.points.mass[bob] = 0.25;
  const Rest rest = find_rest(m, 1e-10);
  EXPECT_TRUE(rest.summary.path.complete()) << rest.summary.last.reason;
  const double s = elongation(GetParam(), 0.7, 0.25 * g);
  EXPECT_NEAR(rest.rows.position[bob].x(), 1, 1e-9);
  EXPECT_NEAR(rest.rows.position[bob].y(), 2, 1e-9);
  EXPECT_NEAR(rest.rows.position[bob].z(), -7 - s, 1e-9);
}

TEST_P(Laws, HangingChain) {
  constexpr int links = 20;
  model::Model m;
  m.bones = {"bone"};
  m.gravity = {0, 0, -g};
  testing::add_point(m, Vec3::Zero(), PointSet::bone, 0);
  for (int i = 1; i <= links; ++i) {
    testing::add_point(m, {0, 0, -4.0 * i}, PointSet::soft_tissue, i);
    testing::add_spring(m, i - 1, i, 1.5, GetParam());
    m.points.mass[i] = 0.01 * i;
  }
  const Rest rest = find_rest(m, 1e-10);
  EXPECT_TRUE(rest.summary.path.complete()) << rest.summary.last.reason;
  double z = 0;
  for (int i = 1; i <= links; ++i) {
    double below = 0;
    for (int j = i; j <= links; ++j) below += 0.01 * j * g;
    z -= 4.0 + elongation(GetParam(), 1.5, below);
    EXPECT_NEAR(rest.rows.position[i].z(), z, 1e-9) << "point " << i;
  }
}

/// A regular lattice whose border is pushed by an affine map follows it: every inner point is a
/// center of symmetry.
TEST_P(Laws, PushedPatchIsAffine) {
  model::Model m = testing::block(7, 6, 5, GetParam(), [](int i, int j, int a) {
    const bool inner = i > 0 && i < 6 && j > 0 && j < 5 && a > 0 && a < 4;
    return inner ? PointSet::soft_tissue : PointSet::held;
  });
  Mat3 map;
  map << 1.05, 0.02, 0.0, -0.01, 1.03, 0.04, 0.03, 0.0, 0.97;
  const auto push = [&](const Vec3& x) -> Vec3 { return map * x + Vec3(0.5, -0.25, 1.0); };
  testing::aim(m, push);
  const Rest rest = find_rest(m, 1e-10, {1, mechanics::VolumeTerm::penalty, 0.3});
  EXPECT_TRUE(rest.summary.path.complete()) << rest.summary.last.reason;
  for (size_t i = 0; i < rest.rows.position.size(); ++i)
    EXPECT_LT((rest.rows.position[i] - push(m.points.position[i])).norm(), 1e-9) << "point " << i;
}

TEST_P(Laws, RigidMotionCarriesTissueRigidly) {
  model::Model m = testing::block(6, 5, 4, GetParam(), [](int i, int j, int a) {
    const bool rim = i == 0 || i == 5 || j == 0 || j == 4;
    return rim || a == 3 ? PointSet::bone : PointSet::soft_tissue;
  });
  const auto motion = scene::RigidMotion::rotation({1, 2, 3}, {10, -20, 5}, 37);
  const auto move = [&](const Vec3& x) -> Vec3 { return motion.apply(x) + Vec3(3, -4, 12); };
  testing::aim(m, move);
  const Rest rest = find_rest(m, 1e-10, {1, mechanics::VolumeTerm::penalty, 0.3});
  EXPECT_TRUE(rest.summary.path.complete()) << rest.summary.last.reason;
  for (size_t i = 0; i < rest.rows.position.size(); ++i)
    EXPECT_LT((rest.rows.position[i] - move(m.points.position[i])).norm(), 1e-9) << "point " << i;
  EXPECT_LT(rest.summary.last.objective, 1e-18);
}

INSTANTIATE_TEST_SUITE_P(Exponents, Laws, ::testing::Values(0, 1, 2));

/// Springs without rest lengths in a row, `orders` of magnitude apart, the softest of 1e-9 N/mm,
/// each point drawn by such a force.
struct Row {
  explicit Row(double orders) {
    m.bones = {"bone"};
    for (int i = 0; i <= links; ++i) {
      const bool end = i == 0 || i == links;
      testing::add_point(m, {double(i), 0, 0}, end ? PointSet::bone : PointSet::soft_tissue, i);
      if (!end) m.points.external_force[i] = {softest * (i % 3 - 0.8), 0, 0};
      if (i > 0)
        testing::add_spring(m, i - 1, i,
                            softest * std::pow(10, orders * (7 * i % links) / (links - 1)), 0);
    }
    for (double& rest : m.springs.rest_length) rest = 0;
  }
  /// Each spring carries what the first does less the loads before it.
  double first_tension() const {
    double loads = 0, slack = links, softness = 0;
    for (int i = 0; i < links; ++i) {
      loads += m.points.external_force[i].x();
      slack += loads / m.springs.stiffness[i];
      softness += 1 / m.springs.stiffness[i];
    }
    return slack / softness;
  }
  double error(const Rest& rest) const {
    double tension = first_tension(), x = 0, largest = 0;
    for (int i = 1; i < links; ++i) {
      tension -= m.points.external_force[i - 1].x();
      x += tension / m.springs.stiffness[i - 1];
      largest = std::max(largest, (rest.rows.position[i] - Vec3(x, 0, 0)).norm());
    }
    return largest;
  }

  static constexpr int links = 11;
  static constexpr double softest = 1e-9;
  model::Model m;
};

TEST(Estimate, IsNoShorterThanTheWayWhereStiffnessesLieFarApart) {
  for (const double orders : {3, 6, 12, 21}) {
    const Row row(orders);
    const Rest rest = find_rest(row.m, 0.1);
    EXPECT_GE(rest.summary.last.displacement_error, row.error(rest)) << orders;
    EXPECT_TRUE(rest.summary.path.complete() || orders > 6) << rest.summary.last.reason;
  }
}

class ForceLaws : public ::testing::TestWithParam<int> {};

/// A chain that hangs by its end, and carries its weight straight down.
TEST_P(ForceLaws, ChainHangsWhereTheEnergyIsLeast) {
  constexpr int links = 12;
  model::Model m;
  m.bones = {"bone"};
  m.gravity = {0, 0, -9.80665};
  testing::add_point(m, Vec3::Zero(), PointSet::bone, 0);
  for (int i = 1; i <= links; ++i) {
    testing::add_point(m, {0, 0, -4.0 * i}, PointSet::soft_tissue, i);
    testing::add_spring(m, i - 1, i, 1.5, GetParam());
    m.points.mass[i] = 0.01 * i;
  }
  solve::Settings settings;
  settings.path.accuracy = 1e-9;
  const Rest energy = testing::find_rest(m, settings);
  settings.functional = model::Functional::force;
  const Rest force = testing::find_rest(m, settings);
  EXPECT_TRUE(energy.summary.path.complete()) << energy.summary.last.reason;
  EXPECT_TRUE(force.summary.path.complete()) << force.summary.last.reason;
  EXPECT_LT(force.summary.last.f_f, 1e-6);
  for (size_t i = 0; i < energy.rows.position.size(); ++i)
    EXPECT_LT((energy.rows.position[i] - force.rows.position[i]).norm(), 2e-9) << "point " << i;
}

INSTANTIATE_TEST_SUITE_P(Exponents, ForceLaws, ::testing::Values(0, 1, 2));

TEST(FindRepose, RefusesAModelWithNothingFree) {
  const model::Model m = testing::block(2, 2, 2, 2, [](int, int, int) { return PointSet::bone; });
  EXPECT_THROW(find_rest(m, 0.1), base::InputError);
}

}  // namespace closed_forms_test
}  // namespace repose
