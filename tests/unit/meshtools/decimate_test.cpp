#include "repose/tools/decimation/decimate.h"

#include <algorithm>
#include <random>
#include <set>

#include "../surface/shapes.h"
#include "repose/surface/defects.h"
#include "repose/surface/distance.h"
#include "repose/surface/read.h"

namespace repose::tools::decimation {
using namespace surface;
namespace decimate_test {

/// A closed ball with bumps of the given height, radius 50; longitude × latitude.
Surface bumpy_ball(int n, double bump, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> noise(-1, 1);
  Surface s{"ball", {{0, 0, 50}, {0, 0, -50}}, {}};
  for (int j = 1; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const double a = 2 * M_PI * i / n, b = M_PI * j / n;
      const double r = 50 + bump * std::sin(5 * a) * std::sin(4 * b) + 0.05 * bump * noise(random);
      s.points.push_back(r *
                         Vec3(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b)));
    }
  s.triangles = longitude_latitude(n);
  return s;
}

/// A sheet of n × n squares, waved, open.
Surface waved_sheet(int n) {
  Surface s = patch(n);
  for (Vec3& p : s.points) p.z() = 8 * std::sin(0.05 * p.x()) * std::cos(0.04 * p.y());
  return s;
}

Decimated decimated(const Surface& surface, double distance) {
  return decimate(surface, {.distance = distance}, [](int64_t) {});
}

/// Largest distance of many points of the first surface to the second.
double sampled_distance(const Surface& from, const Surface& to, int per_edge) {
  const DistanceTree tree(to);
  double largest = 0;
  for (const auto& t : from.triangles)
    for (int i = 0; i <= per_edge; ++i)
      for (int j = 0; i + j <= per_edge; ++j) {
        const double u = double(i) / per_edge, v = double(j) / per_edge;
        const Vec3 p =
            (1 - u - v) * from.points[t[0]] + u * from.points[t[1]] + v * from.points[t[2]];
        largest = std::max(largest, tree.nearest(p).distance);
      }
  return largest;
}

std::set<std::array<double, 3>> places(const Surface& surface,
                                       const std::function<bool(const Vec3&)>& choose) {
  std::set<std::array<double, 3>> found;
  for (const Vec3& p : surface.points)
    if (choose(p)) found.insert({p.x(), p.y(), p.z()});
  return found;
}

TEST(Decimate, distance_holds_topology_stays_and_nothing_intersects) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    const Surface input = bumpy_ball(26, 4, seed);
    size_t before = input.triangles.size();
    for (const double distance : {0.2, 1.0, 3.0}) {
      const Decimated result = decimated(input, distance);
      EXPECT_LE(result.to_input.upper, distance);
      EXPECT_LE(result.to_input.lower, result.to_input.upper);
      EXPECT_LE(sampled_distance(result.surface, input, 8), result.to_input.upper);
      EXPECT_EQ(describe(inspect(result.surface)), "closed, 1 component, no defect");
      EXPECT_TRUE(inspect(result.surface).outward);
      EXPECT_LT(result.surface.triangles.size(), before);
      before = result.surface.triangles.size();
    }
    EXPECT_LT(before, 120u);
  }
}

// The rim's vertices cannot go: 4n − 2 triangles without a vertex inside, two more with one.
TEST(Decimate, of_a_plane_little_but_the_border_is_left) {
  for (const int n : {4, 15}) {
    const Surface input = patch(n);
    const Decimated result = decimated(input, 0.01);
    EXPECT_GE(result.surface.triangles.size(), size_t(4 * n - 2));
    EXPECT_LE(result.surface.triangles.size(), size_t(4 * n));
    for (const Vec3& p : result.surface.points) EXPECT_LT(std::abs(p.z()), 1e-9);
    EXPECT_LT(result.to_input.upper, 1e-5);
    EXPECT_LT(result.from_input.upper, 3e-3);
  }
}

TEST(Decimate, borders_and_landmarks_stay) {
  const Surface input = waved_sheet(20);
  const std::vector<Vec3> landmarks = {{52, 48, 3}, {120, 90, -5}};
  const Decimated result =
      decimate(input, {.distance = 0.5, .landmarks = landmarks}, [](int64_t) {});
  const auto at_border = [&](const Vec3& p) {
    return p.x() == 0 || p.y() == 0 || p.x() == 200 || p.y() == 200;
  };
  EXPECT_EQ(places(result.surface, at_border), places(input, at_border));
  EXPECT_EQ(inspect(result.surface).border_edges, inspect(input).border_edges);
  EXPECT_EQ(inspect(result.surface).border_loops, 1);
  ASSERT_EQ(result.landmark_distance.size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    double minimum = 1e9;
    for (const Vec3& p : result.surface.points)
      minimum = std::min(minimum, (p - landmarks[i]).norm());
    EXPECT_NEAR(minimum, result.landmark_distance[i], 1e-12);
  }
}

TEST(Decimate, thin_walls_do_not_run_through_each_other) {
  Surface outer = bumpy_ball(24, 0, 1), inner = outer;
  for (Vec3& p : inner.points) p *= 0.992;  // a wall of 0.4 mm
  for (auto& t : inner.triangles) turn(t);
  const Surface shell = both(outer, inner);
  ASSERT_EQ(inspect(shell).self_intersections, 0);
  const Decimated result = decimated(shell, 1.5);
  EXPECT_EQ(inspect(result.surface).self_intersections, 0);
  EXPECT_EQ(inspect(result.surface).components, 2);
  EXPECT_LT(result.surface.triangles.size(), shell.triangles.size() / 3);
}

/// A ring of n triangular prisms: three edges around its tube, which must not be pinched.
Surface thin_ring(int n) {
  Surface s{"ring", {}, {}};
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < 3; ++k) {
      const double a = 2 * M_PI * i / n, b = 2 * M_PI * k / 3, r = 40 + 3 * std::cos(b);
      s.points.emplace_back(r * std::cos(a), r * std::sin(a), 3 * std::sin(b));
    }
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < 3; ++k) {
      const int64_t j = (i + 1) % n, l = (k + 1) % 3;
      s.triangles.push_back({3 * i + k, 3 * j + k, 3 * j + l});
      s.triangles.push_back({3 * i + k, 3 * j + l, 3 * i + l});
    }
  return s;
}

TEST(Decimate, a_ring_stays_a_ring) {
  const Surface input = thin_ring(60);
  for (const double distance : {1.0, 20.0}) {
    const Surface result = decimated(input, distance).surface;
    EXPECT_EQ(describe(inspect(result)), "closed, 1 component, no defect");
    EXPECT_EQ(2 * result.points.size(), result.triangles.size());  // V − E + F = 0
    EXPECT_LT(result.triangles.size(), 150u);
  }
}

TEST(Decimate, a_target_count_is_met_and_its_distance_measured) {
  const Surface input = bumpy_ball(26, 4, 1);
  for (const int64_t target : {600, 200}) {
    const Decimated result = decimate(input, {.triangles = target}, [](int64_t) {});
    EXPECT_EQ(static_cast<int64_t>(result.surface.triangles.size()), target);
    const double sampled = sampled_distance(result.surface, input, 20);
    EXPECT_LE(sampled, result.to_input.upper);
    EXPECT_NEAR(sampled, result.to_input.upper, 0.05 * sampled);
    EXPECT_EQ(describe(inspect(result.surface)), "closed, 1 component, no defect");
  }
}

// A count costs about the distance that, requested, leads to that count.
TEST(Decimate, distances_are_measured_alike_whatever_the_bound) {
  const Surface ball = bumpy_ball(40, 2, 1);
  for (const double distance : {10.0, 1000.0}) {
    const Decimated result =
        decimate(ball, {.distance = distance, .triangles = 600}, [](int64_t) {});
    const double there = sampled_distance(result.surface, ball, 20),
                 back = sampled_distance(ball, result.surface, 20);
    EXPECT_GE(result.to_input.lower, there - 0.05) << distance;
    EXPECT_LE(result.to_input.upper, there + 0.1) << distance;
    EXPECT_LE(result.from_input.upper, back + 0.1) << distance;
  }
}

TEST(Decimate, a_count_costs_no_more_than_it_must) {
  const Surface input = bumpy_ball(26, 4, 2);
  const auto count = static_cast<int64_t>(decimated(input, 1.0).surface.triangles.size());
  const Decimated result = decimate(input, {.triangles = count}, [](int64_t) {});
  EXPECT_LT(result.to_input.upper, 1.5);
}

TEST(Decimate, a_solid_never_falls_below_a_tetrahedron) {
  const Decimated result = decimate(cube(), {.triangles = 4}, [](int64_t) {});
  EXPECT_GE(result.surface.triangles.size(), 4u);
  EXPECT_EQ(inspect(result.surface).non_manifold_edges, 0);
  const Decimated same = decimated(tetrahedron(), 1000);
  EXPECT_EQ(same.surface.triangles.size(), 4u);
}

using DecimateFiles = SurfaceFiles;

TEST_F(DecimateFiles, a_mesh_with_three_triangles_at_an_edge_is_refused) {
  Surface fins = patch(2);
  fins.points.push_back({10, 10, 30});
  fins.triangles.push_back({4, 1, 9});
  write_ply(folder_ / "fins.ply", fins);
  const std::string message = refusal([&] { load_surface(folder_ / "fins.ply", Role::mesh); });
  EXPECT_NE(message.find("fins.ply: 1 non-manifold edge"), std::string::npos) << message;
}

TEST(Hausdorff, closed_forms) {
  const Surface inner = cube(Vec3::Zero(), 100), outer = cube(Vec3::Constant(-10), 120);
  const auto expect = [](const DistanceBounds& bounds, double truth) {
    EXPECT_LE(bounds.lower, truth + 1e-9);
    EXPECT_GE(bounds.upper, truth);
    EXPECT_LT(bounds.upper - bounds.lower, 1.1e-3);
  };
  expect(one_sided_distance(inner, outer, 1e-3), 10);
  expect(one_sided_distance(outer, inner, 1e-3), 10 * std::sqrt(3.0));
  expect(one_sided_distance(inner, inner, 1e-3), 0);
}

// The farthest point lies inside a triangle, at no vertex: a lid over a ridge's two sides.
TEST(Hausdorff, a_point_inside_a_triangle_counts) {
  const Surface valley{
      "valley",
      {{0, 0, 0}, {40, 0, -30}, {80, 0, 0}, {0, 50, 0}, {40, 50, -30}, {80, 50, 0}},
      {{0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}}};
  const Surface lid{
      "lid", {{0, 0, 0}, {80, 0, 0}, {80, 50, 0}, {0, 50, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  const DistanceBounds bounds = one_sided_distance(lid, valley, 1e-4);
  EXPECT_NEAR(bounds.upper, 24, 2e-4);  // 40 · 30 / 50
  EXPECT_NEAR(bounds.lower, 24, 2e-4);
}

TEST(Hausdorff, bounds_hold_the_densely_sampled_distance) {
  for (const unsigned seed : {4u, 5u}) {
    const Surface a = bumpy_ball(12, 4, seed), b = bumpy_ball(30, 4, seed + 10);
    for (const auto& [from, to] : {std::pair(&a, &b), std::pair(&b, &a)}) {
      const DistanceBounds bounds = one_sided_distance(*from, *to, 1e-3);
      const double sampled = sampled_distance(*from, *to, 25);
      EXPECT_LE(sampled, bounds.upper);
      EXPECT_NEAR(sampled, bounds.upper, 0.05);
    }
  }
}

TEST(Hausdorff, an_empty_surface_is_an_internal_error) {
  EXPECT_THROW(one_sided_distance(cube(), {"none", {}, {}}, 1e-3), base::InternalError);
}

}  // namespace decimate_test
}  // namespace repose::tools::decimation
