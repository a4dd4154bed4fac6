#include "tools/check/obstacle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace repose::tools::check {
namespace obstacle_test {

/// An axis-parallel box of n × n squares a side, outward.
surface::Surface box(const Vec3& size, int n) {
  surface::Surface s{"box", {}, {}};
  for (int axis = 0; axis < 3; ++axis)
    for (const int side : {0, 1}) {
      const auto first = static_cast<int64_t>(s.points.size());
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      for (int j = 0; j <= n; ++j)
        for (int i = 0; i <= n; ++i) {
          Vec3 p;
          p[axis] = side * size[axis];
          p[u] = size[u] * i / n;
          p[v] = size[v] * j / n;
          s.points.push_back(p);
        }
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
          const int64_t a = first + j * (n + 1) + i, b = a + n + 1;
          for (Triangle t : {Triangle{a, a + 1, b + 1}, Triangle{a, b + 1, b}}) {
            if (side == 0) std::swap(t[1], t[2]);
            s.triangles.push_back(t);
          }
        }
    }
  return s;
}

model::Model with_body(model::Body::Shape shape) {
  model::Model model;
  model.contact.bodies.push_back({"body", -1, std::move(shape)});
  return model;
}

double distance_to_box(const Vec3& size, const Vec3& p) {
  const Vec3 beyond = (p - size / 2).cwiseAbs() - size / 2;
  return std::min(beyond.maxCoeff(), 0.0) + beyond.cwiseMax(0.0).norm();
}

TEST(Obstacle, TheClosestPointOfABoxOfTrianglesIsThatOfItsClosedForm) {
  const Vec3 size(20, 10, 3);
  const TriangleGrid grid(box(size, 4));
  for (int i = -4; i <= 24; ++i)
    for (int j = -4; j <= 14; ++j)
      for (int k = -8; k <= 14; ++k) {
        const Vec3 p(i, j, 0.5 * k);
        const double apart = distance_to_box(size, p);
        if (apart <= 0 || std::abs(apart - 4) < 1e-9) continue;
        const auto closest = grid.closest_point(p, 4);
        ASSERT_EQ(closest.has_value(), apart < 4) << p.transpose();
        if (!closest) continue;
        const Vec3 expected = p.cwiseMax(0.0).cwiseMin(size);
        ASSERT_LE((*closest - expected).norm(), 1e-12) << p.transpose();
      }
}

/// At points in line with its edges and faces, too.
TEST(Obstacle, TheDistanceToABoxOfTrianglesIsThatOfItsClosedForm) {
  const Vec3 size(20, 10, 3);
  const model::Model model = with_body(box(size, 4));
  const Obstacle obstacle(model, model.contact.bodies[0]);
  for (int i = -4; i <= 24; ++i)
    for (int j = -4; j <= 14; ++j)
      for (int k = -8; k <= 14; ++k) {
        const Vec3 p(i, j, 0.5 * k);
        const double expected = distance_to_box(size, p);
        if (expected == 0) continue;
        ASSERT_NEAR(obstacle.distance(p, 7), std::min(expected, 7.0), 1e-12) << p.transpose();
      }
}

TEST(Obstacle, CrossingsAgreeWithSolidAnglesWhereASurfaceIsFoldedAndFacesInward) {
  surface::Surface s = box({20, 10, 3}, 3);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> off(-0.2, 0.2), at(-3, 23);
  for (Vec3& p : s.points) p += 0.3 * Vec3(std::sin(p.y()), std::sin(p.z()), std::sin(p.x()));
  for (const bool inward : {false, true}) {
    if (inward)
      for (Triangle& t : s.triangles) std::swap(t[1], t[2]);
    const TriangleGrid grid(s);
    int inside = 0;
    for (int n = 0; n < 3000; ++n) {
      const Vec3 p(at(random), at(random) / 2, at(random) / 6 + off(random));
      ASSERT_EQ(grid.contains(p), std::abs(grid.winding_number(p)) > 0.5) << p.transpose();
      inside += grid.contains(p);
    }
    EXPECT_GT(inside, 100);
  }
}

TEST(Obstacle, ASurfaceWithAHoleIsStillInsideAwayFromIt) {
  surface::Surface s = box({20, 20, 20}, 4);
  s.triangles.pop_back();
  const TriangleGrid grid(s);
  EXPECT_TRUE(grid.contains({10, 10, 10}));
  EXPECT_FALSE(grid.contains({10, 10, -1}));
}

TEST(Obstacle, ClosedFormsHaveTheirDistancesAndNormals) {
  const auto look = [](model::Body::Shape shape, const Vec3& p, double distance, const Vec3& n) {
    const model::Model model = with_body(std::move(shape));
    const Obstacle obstacle(model, model.contact.bodies[0]);
    EXPECT_NEAR(obstacle.distance(p, 0.5), distance, 1e-12) << "a bound of meshes alone";
    EXPECT_LE((obstacle.normal(p) - n).norm(), 1e-12);
  };
  const Vec3 x = Vec3::UnitX(), z = Vec3::UnitZ(), o = Vec3::Zero();
  look(scene::Sphere{o, 2}, {3, 0, 0}, 1, x);
  look(scene::Capsule{o, {0, 0, 5}, 2}, {1, 0, 3}, -1, x);
  look(scene::Capsule{o, {0, 0, 5}, 2}, {0, 0, 8}, 1, z);
  look(scene::Box{o, {4, 4, 4}}, {1.5, 0, 1}, -0.5, x);
  look(scene::Box{o, {4, 4, 4}}, {5, 0, 6}, 5, Vec3(0.6, 0, 0.8));
  look(scene::HalfSpace{o, {0, 0, 2}}, {1, 2, -3}, -3, z);
}

}  // namespace obstacle_test
}  // namespace repose::tools::check
