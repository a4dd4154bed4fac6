#include <gtest/gtest.h>

#include "rest.h"
#include "solid_block.h"

/// The neo-Hookean solid solved: closed forms, and the same answer on any way to it.
namespace repose {
namespace solid_test {

using model::PointSet;
using testing::Rest;
using testing::settings;
using testing::solid_block;

/// Irregular prisms whose border is held.
model::Model irregular_block(double poisson) {
  const auto inner = [](int i, int j, int a) {
    return i > 0 && i < 6 && j > 0 && j < 5 && a > 0 && a < 4;
  };
  return solid_block(7, 6, 5, poisson, 0.6, [&](int i, int j, int a) {
    return inner(i, j, a) ? PointSet::soft_tissue : PointSet::held;
  });
}

/// Expects the rest position to be the linear map in which the border is held.
void expect_patch_test(model::Model m) {
  Mat3 f;
  f << 1.2, 0.1, 0, -0.05, 0.9, 0.15, 0.1, 0, 1.1;
  testing::aim(m, [&](const Vec3& x) -> Vec3 { return f * x; });
  const Rest rest = testing::find_rest(m, settings(1e-10));
  EXPECT_TRUE(rest.summary.path.complete()) << rest.summary.last.reason;
  for (size_t i = 0; i < m.points.position.size(); ++i)
    EXPECT_LE((rest.rows.position[i] - f * m.points.position[i]).norm(), 1e-9);
  for (const double ratio : rest.rows.volume_ratio) EXPECT_NEAR(ratio, f.determinant(), 1e-10);
}

TEST(Solid, PatchTestIsExactOnIrregularPrisms) { expect_patch_test(irregular_block(0.45)); }

model::Model sheared_block(double poisson) {
  model::Model m = solid_block(8, 7, 4, poisson, 0.3, [](int i, int j, int a) {
    return a == 3 && i > 0 && j > 0 ? PointSet::bone : PointSet::soft_tissue;
  });
  testing::aim(m, [](const Vec3& x) -> Vec3 { return x + Vec3(4, -2, 1); });
  return m;
}

TEST(Solid, RigidMotionOfItsBoneCarriesItAlong) {
  const model::Model m = sheared_block(0.45);
  const Rest rest = testing::find_rest(m, settings(1e-8));
  EXPECT_TRUE(rest.summary.path.complete()) << rest.summary.last.reason;
  for (size_t i = 0; i < m.points.position.size(); ++i)
    EXPECT_LE((rest.rows.position[i] - m.points.position[i] - Vec3(4, -2, 1)).norm(), 1e-8);
}

/// One side held, the other pulled and turned by a fifth of a turn.
model::Model twisted_block(double poisson) {
  model::Model m = solid_block(9, 5, 4, poisson, 0.3, [](int i, int, int) {
    return i == 0 ? PointSet::boundary : i == 8 ? PointSet::held : PointSet::soft_tissue;
  });
  testing::aim(m, [](const Vec3& x) -> Vec3 {
    const Vec3 center(40, 10, -4.5), d = x - center;
    const double c = std::cos(0.6), s = std::sin(0.6);
    return center + Vec3(4, c * d.y() - s * d.z(), s * d.y() + c * d.z());
  });
  return m;
}

TEST(Solid, AnyNumberOfLoadStepsLeadsToOneRestPosition) {
  for (const double poisson : {0.3, 0.45, 0.49}) {
    const model::Model m = twisted_block(poisson);
    const Rest one = testing::find_rest(m, settings(1e-6, 1));
    EXPECT_TRUE(one.summary.path.complete()) << one.summary.last.reason;
    EXPECT_EQ(one.summary.last.inverted_prisms, 0);
    for (const int steps : {2, 5, 10}) {
      const Rest more = testing::find_rest(m, settings(1e-6, steps));
      EXPECT_TRUE(more.summary.path.complete()) << more.summary.last.reason;
      for (size_t i = 0; i < m.points.position.size(); ++i)
        EXPECT_LE((one.rows.position[i] - more.rows.position[i]).norm(), 2e-6);
    }
  }
}

model::Model averaged(model::Model m) {
  for (size_t p = 0; p < m.prisms.points.size(); ++p)
    m.prisms.nodal_modulus.push_back(m.prisms.modulus[p] - m.prisms.shear_modulus[p]);
  return m;
}

TEST(Solid, AveragedVolumesLeadToOneRestPositionToo) {
  const model::Model m = averaged(twisted_block(0.49));
  const Rest one = testing::find_rest(m, settings(1e-6, 1));
  EXPECT_TRUE(one.summary.path.complete()) << one.summary.last.reason;
  const Rest five = testing::find_rest(m, settings(1e-6, 5));
  const Rest plain = testing::find_rest(twisted_block(0.49), settings(1e-6));
  double apart = 0;
  for (size_t i = 0; i < m.points.position.size(); ++i) {
    EXPECT_LE((one.rows.position[i] - five.rows.position[i]).norm(), 2e-6);
    apart = std::max(apart, (one.rows.position[i] - plain.rows.position[i]).norm());
  }
  EXPECT_GT(apart, 0.01);
}

TEST(Solid, AveragedVolumesPassThePatchTest) { expect_patch_test(averaged(irregular_block(0.49))); }

TEST(Solid, NoMinimumIsInfinitelyFarAway) {
  model::Model m = twisted_block(0.45);
  for (double& weight : m.edges.weight) weight = -weight;
  const Rest rest = testing::find_rest(m, settings(0.01));
  EXPECT_FALSE(rest.summary.last.converged);
  EXPECT_TRUE(std::isinf(rest.summary.last.displacement_error)) << rest.summary.last.reason;
}

// Straight, it is balanced at any load.
TEST(Solid, ASlenderColumnBetweenHeldEndsBuckles) {
  constexpr int layers = 12;
  const auto aside = [&](double pressed) {
    model::Model m = solid_block(2, 2, layers, 0.45, 0, [&](int, int, int a) {
      return a == 0 || a + 1 == layers ? PointSet::held : PointSet::soft_tissue;
    });
    testing::aim(m,
                 [&](const Vec3& x) -> Vec3 { return x - Vec3(0, 0, x.z() == 0 ? pressed : 0); });
    const Rest rest = testing::find_rest(m, settings(0.001));
    EXPECT_TRUE(rest.summary.path.complete()) << rest.summary.last.reason;
    return testing::farthest_aside(m, rest);
  };
  EXPECT_LT(aside(1), 0.1);
  EXPECT_NEAR(aside(2), 3.442, 0.005);
}

TEST(Solid, TakesFewEvaluations) {
  const Rest rest = testing::find_rest(twisted_block(0.45), settings(0.01));
  EXPECT_TRUE(rest.summary.path.complete()) << rest.summary.last.reason;
  EXPECT_LE(rest.summary.evaluations, 60);
  EXPECT_LE(rest.summary.assemblies, 20);
}

// Limited-memory BFGS alone stalls at one of these loads or the other; at which hangs on rounding.
TEST(Solid, NewtonTakesOverWhereTheSearchStalls) {
  model::Model m = solid_block(7, 6, 5, 0.4999, 0.3, [](int i, int, int) {
    return i == 0 ? PointSet::boundary : PointSet::soft_tissue;
  });
  for (const double force : {0.02, 0.04}) {
    for (size_t i = 0; i < m.points.position.size(); ++i)
      if (m.points.position[i].x() > 29) m.points.external_force[i] = {force, 0, 0};
    const Rest rest = testing::find_rest(m, settings(1e-3));
    EXPECT_TRUE(rest.summary.path.complete()) << rest.summary.last.reason;
  }
}

TEST(Solid, ReportsWhatItsForcesAre) {
  model::Model m = twisted_block(0.45);
  for (size_t i = 0; i < m.points.mass.size(); ++i) m.points.mass[i] = 1e-6;
  m.gravity = {0, 0, -9.81};
  const Rest rest = testing::find_rest(m, settings(1e-8));
  for (size_t i = 0; i < m.points.position.size(); ++i)
    EXPECT_LE(rest.rows.residual_force[i].norm(), 1e-8);
  EXPECT_GT(rest.summary.last.f_e, 0);
  EXPECT_NEAR(rest.summary.last.objective, rest.summary.last.f_e + rest.summary.last.potential,
              1e-9 * rest.summary.last.f_e);
}

}  // namespace solid_test
}  // namespace repose
