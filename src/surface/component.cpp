#include "repose/surface/component.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "repose/base/error.h"
#include "repose/surface/edges.h"
#include "repose/surface/triangle_tree.h"

namespace repose::surface {
namespace {

/// Returns the part of each triangle; parts are numbered in the order of their first triangle.
std::vector<int64_t> parts_of(const Surface& surface, const EdgeTable& edges, int64_t& count) {
  UnionFind sets = connected(surface.triangles, edges);
  std::vector<int64_t> part(surface.triangles.size());
  count = 0;
  for (int64_t t = 0; t < std::ssize(part); ++t)
    part[t] = sets.find(t) == t ? count++ : part[sets.find(t)];
  return part;
}

/// Every part with its own points.
std::vector<Surface> split(const Surface& surface, const EdgeTable& edges) {
  int64_t count = 0;
  const auto part = parts_of(surface, edges, count);
  std::vector<Surface> parts(count);
  std::vector<int64_t> row(surface.points.size(), -1), owner(surface.points.size(), -1);
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    Surface& target = parts[part[t]];
    Triangle triangle = surface.triangles[t];
    for (int64_t& vertex : triangle) {
      const int64_t old = vertex;
      if (owner[old] != part[t]) {
        owner[old] = part[t];
        row[old] = std::ssize(target.points);
        target.points.push_back(surface.points[old]);
      }
      vertex = row[old];
    }
    target.triangles.push_back(triangle);
  }
  for (Surface& each : parts) each.name = surface.name;
  return parts;
}

}  // namespace

double area_of(const Surface& surface) {
  double twice = 0;
  for (const Triangle& t : surface.triangles) twice += scaled_normal(corners(surface, t)).norm();
  return twice / 2;
}

double volume_of(const Surface& surface) {
  return surface.points.empty() ? 0 : six_volumes(surface.points, surface.triangles) / 6;
}

std::vector<Vec3> vertex_normals(const Surface& surface) {
  std::vector<Vec3> normals(surface.points.size(), Vec3::Zero());
  for (const Triangle& t : surface.triangles) {
    const Vec3 normal = scaled_normal(corners(surface, t));
    for (const int64_t v : t) normals[v] += normal;
  }
  for (Vec3& normal : normals) normal.normalize();
  return normals;
}

std::vector<Vec3> angle_normals(const Surface& surface) {
  std::vector<Vec3> normals(surface.points.size(), Vec3::Zero());
  for (const Triangle& t : surface.triangles) {
    const Corners at = corners(surface, t);
    const Vec3 normal = scaled_normal(at).normalized();
    for (int k = 0; k < 3; ++k) {
      const Vec3 a = at[(k + 1) % 3] - at[k], b = at[(k + 2) % 3] - at[k];
      normals[t[k]] += std::atan2(a.cross(b).norm(), a.dot(b)) * normal;
    }
  }
  for (Vec3& normal : normals) normal.normalize();
  return normals;
}

Samples sample(const Surface& surface, double spacing) {
  Samples samples;
  for (const Triangle& triangle : surface.triangles) {
    const auto [a, b, c] = corners(surface, triangle);
    const auto n = std::max(1, static_cast<int>(std::ceil(longest_side({a, b, c}) / spacing)));
    const double area = (b - a).cross(c - a).norm() / 2 / (static_cast<double>(n) * n);
    for (int i = 0; i < n; ++i)
      for (int j = 0; i + j < n; ++j)
        for (int half = 0; half < (i + j + 1 < n ? 2 : 1); ++half) {
          const double x = (i + (1.0 + half) / 3) / n, y = (j + (1.0 + half) / 3) / n;
          samples.point.push_back(a + x * (b - a) + y * (c - a));
          samples.area.push_back(area);
        }
  }
  return samples;
}

void append(const Surface& part, Surface& whole) {
  const auto shift = std::ssize(whole.points);
  whole.points.insert(whole.points.end(), part.points.begin(), part.points.end());
  for (const auto& [a, b, c] : part.triangles)
    whole.triangles.push_back({a + shift, b + shift, c + shift});
}

Surface compact(std::string name, const std::vector<Vec3>& points,
                std::vector<Triangle> triangles) {
  Surface found{std::move(name), {}, std::move(triangles)};
  std::vector<int64_t> row(points.size(), -1);
  for (Triangle& triangle : found.triangles)
    for (int64_t& vertex : triangle) {
      if (row[vertex] < 0) {
        row[vertex] = std::ssize(found.points);
        found.points.push_back(points[vertex]);
      }
      vertex = row[vertex];
    }
  return found;
}

std::vector<Surface> components(const Surface& surface) {
  const EdgeTable edges(surface.triangles);
  std::vector<Surface> parts = split(surface, edges);
  const bool by_area = !edges.border().empty();
  std::vector<std::pair<double, size_t>> order;
  for (size_t p = 0; p < parts.size(); ++p)
    order.emplace_back(by_area ? -area_of(parts[p]) : -std::abs(volume_of(parts[p])), p);
  std::sort(order.begin(), order.end());
  std::vector<Surface> sorted;
  for (const auto& [size, p] : order) sorted.push_back(std::move(parts[p]));
  return sorted;
}

Surface largest_component(const Surface& surface) {
  auto parts = components(surface);
  if (parts.empty()) base::refuse("{}: holds no triangle", surface.name);
  return std::move(parts.front());
}

Surface components_above(const Surface& surface, double volume) {
  Surface kept{surface.name, {}, {}};
  double largest = 0;
  for (const Surface& part : components(surface)) {
    largest = std::max(largest, std::abs(volume_of(part)));
    if (std::abs(volume_of(part)) < volume) continue;
    append(part, kept);
  }
  if (kept.triangles.empty())
    base::refuse("{}: no component of {:g} mm³ or more; the largest has {:.4g} mm³", surface.name,
                 volume, largest);
  return kept;
}

}  // namespace repose::surface
