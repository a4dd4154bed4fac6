#include "repose/surface/distance.h"

#include <Eigen/Geometry>
#include <random>

#include "shapes.h"

namespace repose::surface {
namespace distance_test {

/// A closed bumpy ball of radius about 50 around `center`; longitude × latitude.
Surface ball(const Vec3& center, int n = 24) {
  Surface s{"ball", {center + Vec3(0, 0, 50), center - Vec3(0, 0, 50)}, {}};
  for (int j = 1; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const double a = 2 * M_PI * i / n, b = M_PI * j / n;
      const double r = 50 + 6 * std::sin(3 * a) * std::sin(b) * std::sin(2 * b);
      s.points.push_back(
          center + r * Vec3(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b)));
    }
  s.triangles = longitude_latitude(n);
  return s;
}

Vec3 closest_on_segment(const Vec3& a, const Vec3& b, const Vec3& q) {
  const double t = std::clamp((q - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return a + t * (b - a);
}

/// By projection onto the plane and onto the three sides.
double distance_to_triangle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& q) {
  const Vec3 normal = (b - a).cross(c - a).normalized();
  const Vec3 foot = q - (q - a).dot(normal) * normal;
  const bool inside = (b - a).cross(foot - a).dot(normal) >= 0 &&
                      (c - b).cross(foot - b).dot(normal) >= 0 &&
                      (a - c).cross(foot - c).dot(normal) >= 0;
  if (inside) return (q - foot).norm();
  return std::min({(q - closest_on_segment(a, b, q)).norm(),
                   (q - closest_on_segment(b, c, q)).norm(),
                   (q - closest_on_segment(c, a, q)).norm()});
}

double brute_distance(const Surface& s, const Vec3& q) {
  double minimum = std::numeric_limits<double>::infinity();
  for (const auto& t : s.triangles)
    minimum =
        std::min(minimum, distance_to_triangle(s.points[t[0]], s.points[t[1]], s.points[t[2]], q));
  return minimum;
}

/// Möller and Trumbore, 1997; infinity for none.
double brute_hit(const Surface& s, const Vec3& origin, const Vec3& direction) {
  double minimum = std::numeric_limits<double>::infinity();
  for (const auto& t : s.triangles) {
    const Vec3 e1 = s.points[t[1]] - s.points[t[0]], e2 = s.points[t[2]] - s.points[t[0]];
    const Vec3 from = origin - s.points[t[0]], p = direction.cross(e2), q = from.cross(e1);
    const double det = e1.dot(p);
    const double u = from.dot(p) / det, v = direction.dot(q) / det, r = e2.dot(q) / det;
    if (det != 0 && u >= 0 && v >= 0 && u + v <= 1 && r >= 0) minimum = std::min(minimum, r);
  }
  return minimum;
}

/// The solid angle under which the surface is seen, in turns (van Oosterom and Strackee, 1983).
double winding_number(const Surface& s, const Vec3& q) {
  double angle = 0;
  for (const auto& t : s.triangles) {
    const Vec3 a = s.points[t[0]] - q, b = s.points[t[1]] - q, c = s.points[t[2]] - q;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    angle += 2 * std::atan2(a.dot(b.cross(c)),
                            la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return angle / (4 * M_PI);
}

class Random {
 public:
  Vec3 point(double half) {
    return {half * uniform_(engine_), half * uniform_(engine_), half * uniform_(engine_)};
  }
  Vec3 direction() {
    return Vec3(normal_(engine_), normal_(engine_), normal_(engine_)).normalized();
  }

 private:
  std::mt19937 engine_{7};
  std::uniform_real_distribution<double> uniform_{-1, 1};
  std::normal_distribution<double> normal_;
};

TEST(Distance, nearest_equals_brute_force) {
  for (const double offset : {0.0, 1e6}) {
    const Vec3 center = Vec3::Constant(offset);
    const Surface s = ball(center);
    const DistanceTree tree(s);
    const double tolerance = offset == 0 ? 1e-10 : 1e-6;
    Random random;
    for (int i = 0; i < 400; ++i) {
      const Vec3 q = center + random.point(i % 2 ? 60 : 300);
      const auto found = tree.nearest(q);
      ASSERT_NEAR(found.distance, brute_distance(s, q), tolerance);
      ASSERT_NEAR((found.point - q).norm(), found.distance, tolerance);
      const auto& t = s.triangles[found.triangle];
      ASSERT_NEAR(distance_to_triangle(s.points[t[0]], s.points[t[1]], s.points[t[2]], found.point),
                  0, tolerance);
    }
  }
}

TEST(Distance, first_hit_equals_brute_force) {
  const Surface s = ball(Vec3::Zero());
  const DistanceTree tree(s);
  Random random;
  int hits = 0;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 origin = random.point(60), direction = random.direction();
    const double requested = brute_hit(s, origin, direction);
    const auto found = tree.first_hit(origin, direction, 1000);
    ASSERT_EQ(found.has_value(), requested < 1000);
    if (!found) continue;
    ++hits;
    ASSERT_NEAR(found->distance, requested, 1e-9);
    ASSERT_NEAR((origin + requested * direction - found->point).norm(), 0, 1e-9);
    EXPECT_TRUE(tree.first_hit(origin, direction, requested + 1e-9));
    EXPECT_FALSE(tree.first_hit(origin, direction, requested - 1e-9));
  }
  EXPECT_GT(hits, 300);
  EXPECT_LT(hits, 900);
}

TEST(Distance, rays_along_axes_through_vertices_edges_and_planes) {
  const Surface s = cube();
  const DistanceTree tree(s);
  for (const Vec3& to : s.points) {
    const Vec3 origin(50, 50, 50), direction = (to - origin).normalized();
    const auto hit = tree.first_hit(origin, direction, 1000);
    ASSERT_TRUE(hit);
    EXPECT_NEAR((hit->point - to).norm(), 0, 1e-12);
  }
  const auto middle = tree.first_hit({50, 50, -20}, {0, 0, 1}, 1000);
  ASSERT_TRUE(middle);
  EXPECT_NEAR(middle->distance, 20, 1e-12);
  const auto edge = tree.first_hit({50, 0, -20}, {0, 0, 1}, 1000);
  ASSERT_TRUE(edge);
  EXPECT_NEAR(edge->distance, 20, 1e-12);
  const auto coplanar = tree.first_hit({-30, 40, 100}, {1, 0, 0}, 1000);
  ASSERT_TRUE(coplanar);
  EXPECT_NEAR(coplanar->distance, 30, 1e-12);
}

TEST(Distance, hits_at_distance_zero_count_and_reach_bounds) {
  const DistanceTree tree(cube());
  const auto zero = tree.first_hit({30, 40, 0}, {0, 0, 1}, 1000);
  ASSERT_TRUE(zero);
  EXPECT_EQ(zero->distance, 0);
  EXPECT_EQ(tree.first_hit({30, 40, 0}, {0, 0, -1}, 5)->distance, 0);
  EXPECT_TRUE(tree.first_hit({30, 40, -10}, {0, 0, 1}, 10));
  EXPECT_FALSE(tree.first_hit({30, 40, -10}, {0, 0, 1}, 9.999));
  EXPECT_FALSE(tree.first_hit({30, 40, -10}, {0, 0, -1}, 1e9));
  EXPECT_TRUE(tree.first_hit({30, 40, -10}, {0, 0, 1}, std::numeric_limits<double>::infinity()));
}

TEST(Distance, contains_equals_the_winding_number) {
  const Surface s = both(ball(Vec3::Zero()), ball(Vec3(120, 0, 0)));
  const DistanceTree tree(s);
  Random random;
  int inside = 0;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 q = random.point(70);
    ASSERT_EQ(tree.contains(q), winding_number(s, q) > 0.5);
    inside += tree.contains(q);
  }
  EXPECT_GT(inside, 100);
}

TEST(Distance, contains_on_the_surface_and_in_line_with_its_features) {
  Surface s = cube();
  for (size_t t = 0; t < 5; ++t) turn(s.triangles[t]);
  const DistanceTree tree(s);
  for (const Vec3& p : s.points) EXPECT_TRUE(tree.contains(p));
  EXPECT_TRUE(tree.contains({50, 0, 0}));
  EXPECT_TRUE(tree.contains({50, 50, 100}));
  for (const double x : {-30, 10, 50, 90, 130})
    for (const double y : {-50, 0, 20, 50, 100, 150})
      for (const double z : {0, 20, 50, 80, 100})
        EXPECT_EQ(tree.contains({x, y, z}), x > 0 && x < 100 && y >= 0 && y <= 100)
            << x << " " << y << " " << z;
  EXPECT_TRUE(tree.contains({1e-12, 1e-12, 1e-12}));
  EXPECT_FALSE(tree.contains({50, 50, -1e-12}));
  EXPECT_FALSE(tree.contains({150, 0, 0}));
}

TEST(Distance, triangles_without_area_keep_the_numbering) {
  Surface s = patch(1);
  s.triangles.insert(s.triangles.begin(), {0, 0, 1});
  EXPECT_EQ(DistanceTree(s).nearest({9, 1, 5}).triangle, 1);
  s.triangles.resize(1);
  EXPECT_NE(refusal([&] { DistanceTree tree(s); }).find("patch: no triangle"), std::string::npos);
}

TEST(Distance, a_query_that_is_not_finite_is_an_internal_error) {
  const DistanceTree tree(cube());
  const Vec3 nan = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_THROW(tree.nearest(nan), base::InternalError);
  EXPECT_THROW(tree.first_hit(nan, {0, 0, 1}, 1), base::InternalError);
  EXPECT_THROW(tree.contains(nan), base::InternalError);
}

TEST(Distance, a_moved_tree_answers) {
  DistanceTree first(cube()), second(tetrahedron());
  second = std::move(first);
  EXPECT_EQ(second.nearest({50, 50, 130}).distance, 30);
  EXPECT_EQ(DistanceTree(std::move(second)).nearest({50, 50, 130}).distance, 30);
}

}  // namespace distance_test
}  // namespace repose::surface
