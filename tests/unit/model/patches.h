#pragma once
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "repose/scene/scene.h"
#include "repose/surface/surface.h"

/// Small skins and bones whose models are known beforehand.
namespace repose::model::patches {

/// A flat square skin at height 0, outside up: cells × cells squares of two triangles.
inline surface::Surface square(int cells, double side) {
  surface::Surface skin{.name = "square.ply", .points = {}, .triangles = {}};
  for (int j = 0; j <= cells; ++j)
    for (int i = 0; i <= cells; ++i)
      skin.points.emplace_back(side * i / cells, side * j / cells, 0);
  for (int64_t j = 0; j < cells; ++j)
    for (int64_t i = 0; i < cells; ++i) {
      const int64_t a = j * (cells + 1) + i, b = a + 1, c = a + cells + 1, d = c + 1;
      skin.triangles.push_back({a, b, d});
      skin.triangles.push_back({a, d, c});
    }
  return skin;
}

/// A closed box, outwards.
inline surface::Surface box(const Vec3& low, const Vec3& high) {
  surface::Surface bone{.name = "box.ply", .points = {}, .triangles = {}};
  for (int k = 0; k < 8; ++k)
    bone.points.emplace_back(k & 1 ? high.x() : low.x(), k & 2 ? high.y() : low.y(),
                             k & 4 ? high.z() : low.z());
  bone.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return bone;
}

/// A flat annulus at height 0, outside up, of concentric rings with the given numbers of points.
inline surface::Surface annulus(const std::vector<int>& rings, double inner, double outer) {
  surface::Surface skin{.name = "annulus.ply", .points = {}, .triangles = {}};
  std::vector<int64_t> first;
  for (size_t r = 0; r < rings.size(); ++r) {
    first.push_back(static_cast<int64_t>(skin.points.size()));
    const double radius =
        inner + (outer - inner) * static_cast<double>(r) / static_cast<double>(rings.size() - 1);
    for (int k = 0; k < rings[r]; ++k) {
      const double angle = 2 * std::numbers::pi * k / rings[r];
      skin.points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), 0);
    }
  }
  for (size_t r = 0; r + 1 < rings.size(); ++r) {
    const int n = rings[r], m = rings[r + 1];
    const int64_t in = first[r], out = first[r + 1];
    for (int i = 0, j = 0; i < n || j < m;) {
      const bool step_out = i == n || (j < m && int64_t{j + 1} * n <= int64_t{i + 1} * m);
      if (step_out) {
        skin.triangles.push_back({in + i % n, out + j % m, out + (j + 1) % m});
        ++j;
      } else {
        skin.triangles.push_back({in + i % n, out + j % m, in + (i + 1) % n});
        ++i;
      }
    }
  }
  return skin;
}

/// A closed sphere about the origin, outwards: an octahedron refined `times` times.
inline surface::Surface sphere(double radius, int times) {
  surface::Surface s{.name = "sphere.ply", .points = {}, .triangles = {}};
  s.points = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  s.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                 {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int k = 0; k < times; ++k) {
    std::vector<Triangle> finer;
    const auto midpoint = [&](int64_t a, int64_t b) {
      const Vec3 m = (s.points[a] + s.points[b]).normalized();
      for (size_t i = 0; i < s.points.size(); ++i)
        if ((s.points[i] - m).norm() < 1e-12) return static_cast<int64_t>(i);
      s.points.push_back(m);
      return static_cast<int64_t>(s.points.size()) - 1;
    };
    for (const auto& [a, b, c] : s.triangles) {
      const int64_t ab = midpoint(a, b), bc = midpoint(b, c), ca = midpoint(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    s.triangles = finer;
  }
  for (Vec3& x : s.points) x *= radius;
  return s;
}

/// A scene with these bones, none of which moves, and nothing else but defaults.
inline scene::Scene scene_of(int layers, const std::vector<std::string>& bones) {
  scene::Scene scene;
  scene.file = "scene.yaml";
  scene.tissue.layers = layers;
  for (const std::string& name : bones) scene.bones.push_back({name, name + ".ply"});
  scene.moves.resize(bones.size());
  return scene;
}

/// The paper's numbers: 477 vertices, 1351 edges, 874 triangles, one hole.
inline surface::Surface paper_sized_annulus() {
  return annulus({20, 24, 28, 32, 36, 40, 42, 45, 48, 50, 52, 60}, 20, 80);
}

}  // namespace repose::model::patches
