#include "repose/mechanics/contact.h"

#include <gtest/gtest.h>

#include <random>

/// Contact's derivatives by Taylor expansions, before, at and after touch; what is left out of
/// looking.
namespace repose::mechanics {
namespace {

std::vector<Vec3> random_points(int count, double size, int seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> within(-size, size);
  std::vector<Vec3> points(count);
  for (Vec3& p : points)
    for (double& x : p) x = within(random);
  return points;
}

/// Points at `distance` mm from a capsule and a ball, on all sides.
struct Touching {
  TouchLoop loop;
  std::vector<Vec3> position;
};
Touching touching(double distance, model::Binding binding) {
  const std::vector<RigidBody> bodies = {
      RigidBody(scene::Capsule{{0, 0, 0}, {4, 1, 0}, 3}, -1, Vec3::Zero()),
      RigidBody(scene::Sphere{{30, 0, 0}, 2.5}, -1, Vec3::Zero())};
  model::Touches touches;
  Touching made;
  for (const Vec3& way : random_points(20, 1, 7))
    for (int32_t b = 0; b < 2; ++b) {
      Vec3 at = (b == 0 ? Vec3(2, 0.5, 0) : Vec3(30, 0, 0)) + 9 * way.normalized();
      for (int n = 0; n < 50; ++n) {
        const surface::Distance d = bodies[b].distance(at);
        at -= (d.value - distance) * d.gradient;
      }
      touches.point.push_back(static_cast<int64_t>(made.position.size()));
      touches.body.push_back(b);
      touches.binding.push_back(binding);
      touches.area.push_back(1.5 + way.x());
      touches.offset.push_back(0);
      made.position.push_back(at);
    }
  made.loop = TouchLoop(touches, 0.7, bodies);
  return made;
}

template <class Value, class Blocks>
void expect_taylor(const std::vector<Vec3>& position, Value&& value, Blocks&& blocks) {
  const std::vector<Vec3> way = random_points(static_cast<int>(position.size()), 1, 9);
  const auto at = [&](double step) {
    std::vector<Vec3> moved = position;
    for (size_t i = 0; i < moved.size(); ++i) moved[i] += step * way[i];
    return moved;
  };
  std::vector<Vec3> gradient(position.size(), Vec3::Zero());
  const double start = value(position, gradient);
  double slope = 0;
  for (size_t i = 0; i < way.size(); ++i) slope += gradient[i].dot(way[i]);
  const double bend = blocks(way);
  double first = 0, last = 0;
  for (const double step : {1e-3, 1e-4}) {
    std::vector<Vec3> unused(position.size(), Vec3::Zero());
    const double left = value(at(step), unused) - start - step * slope - step * step / 2 * bend;
    (step == 1e-3 ? first : last) = std::abs(left);
  }
  const double rounding = 1e-13 * (1 + std::abs(start));
  EXPECT_LE(last, 5e-3 * first + rounding) << first << " " << last;
}

TEST(TouchDerivatives, AreThoseOfTheValueBeforeAtAndAfterTouch) {
  for (const auto binding : {model::Binding::touches, model::Binding::slides})
    for (const double distance : {0.5, -0.05, -1.0}) {
      SCOPED_TRACE(distance);
      Touching made = touching(distance, binding);
      const std::vector<double> p(made.position.size(), 0.02);
      made.loop.set_multipliers(p);
      expect_taylor(
          made.position,
          [&](std::span<const Vec3> x, std::span<Vec3> g) {
            return made.loop.add_gradient(x, 1, g);
          },
          [&](const std::vector<Vec3>& way) {
            made.loop.look(made.position);
            double sum = 0;
            made.loop.for_each_block(
                true, [&](int64_t i, const Mat3& block) { sum += way[i].dot(block * way[i]); });
            return sum;
          });
    }
}

TEST(TouchLoop, PressesWithoutAJumpOfEnergy) {
  constexpr double multiplier = 0.02, stiffness = 0.7, step = 1e-6;
  double value[2];
  for (const int after : {0, 1}) {
    Touching made =
        touching(multiplier / stiffness + (after ? -step : step), model::Binding::touches);
    made.loop.set_multipliers(std::vector<double>(made.position.size(), multiplier));
    std::vector<Vec3> gradient(made.position.size(), Vec3::Zero());
    value[after] = made.loop.add_gradient(made.position, 1, gradient);
    EXPECT_EQ(gradient[0].norm() > 0, after == 1);
  }
  EXPECT_NEAR(value[0], value[1], 1e-9);
}

TEST(WallDerivatives, AreThoseOfTheValue) {
  model::Walls walls;
  walls.point = {0, 1};
  walls.area = {2, 3};
  walls.cut = {0, 0};
  walls.triangles = {{2, 3, 4}, {3, 5, 4}};
  walls.triangle_cut = {0, 0};
  const std::vector<Vec3> position = {{1, 1, -0.3}, {3, 3, -0.2}, {0, 0, 0},
                                      {5, 0, 0.1},  {0, 5, 0},    {5, 5, 0.2}};
  WallLoop loop(walls, 0.7);
  loop.pair(position);
  for (WallPair& pair : loop.pairs()) {
    EXPECT_GT(pair.area, 0);
    EXPECT_LT(pair.gap(position), 0);
    pair.multiplier = 0.05;
  }
  expect_taylor(
      position,
      [&](std::span<const Vec3> x, std::span<Vec3> g) { return loop.add_gradient(x, 1, g); },
      [&](const std::vector<Vec3>& way) {
        double sum = 0;
        loop.for_each_block(position, [&](int32_t p, int32_t q, const Mat3& block) {
          sum += (p == q ? 1 : 2) * way[p].dot(block * way[q]);
        });
        return sum;
      });
}

TEST(TouchLoop, LooksAgainAsSoonAsAPointMayHaveComeNear) {
  Touching made = touching(4.0, model::Binding::touches);
  std::vector<Vec3> gradient(made.position.size(), Vec3::Zero());
  EXPECT_EQ(made.loop.add_gradient(made.position, 1, gradient), 0);
  for (Vec3& x : made.position) x = x.x() < 15 ? Vec3(2, 0.5, 2.9) : Vec3(30, 0, 2.4);
  EXPECT_GT(made.loop.add_gradient(made.position, 1, gradient), 0);
  Touching fresh = touching(4.0, model::Binding::touches);
  EXPECT_DOUBLE_EQ(made.loop.add_gradient(made.position, 1, gradient),
                   fresh.loop.add_gradient(made.position, 1, gradient));
}

}  // namespace
}  // namespace repose::mechanics
