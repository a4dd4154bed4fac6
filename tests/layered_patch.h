#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "repose/model/model.h"
#include "repose/model/prism_geometry.h"

/// A flat rectangular piece of tissue as a model, for tests and benchmarks.
namespace repose::test {

/// Size of a patch: columns × layers of points, skin at z = 0, the deepest layer held by bone.
struct PatchSize {
  int64_t columns_x = 4, columns_y = 3;
  int64_t layers = 3;
  double spacing = 1.0;    ///< mm between columns
  double thickness = 0.8;  ///< mm between layers
};

/// Edges and triangles (counter-clockwise seen from outside, +z) of the patch's skin.
struct PatchSkin {
  std::vector<std::array<int64_t, 2>> edges;
  std::vector<Triangle> triangles;
};

inline PatchSkin patch_skin(const PatchSize& size) {
  PatchSkin skin;
  const int64_t nx = size.columns_x, ny = size.columns_y;
  for (int64_t c = 0; c < nx * ny; ++c) {
    const bool right = c % nx + 1 < nx, up = c / nx + 1 < ny;
    if (right) skin.edges.push_back({c, c + 1});
    if (up) skin.edges.push_back({c, c + nx});
    if (!right || !up) continue;
    skin.edges.push_back({c, c + nx + 1});
    skin.triangles.push_back({c, c + 1, c + nx + 1});
    skin.triangles.push_back({c, c + nx + 1, c + nx});
  }
  return skin;
}

/// Adds a quadratic-strain spring with k0 = 1 N/mm, at rest as it lies.
inline void add_patch_spring(model::Model& model, int64_t i, int64_t j) {
  const double length = (model.points.position[j] - model.points.position[i]).norm();
  model.springs.points.push_back({i, j});
  model.springs.set.push_back(static_cast<int32_t>(model.spring_sets.size()) - 1);
  model.springs.rest_length.push_back(length);
  model.springs.stiffness.push_back(1.0);
  model.springs.exponent.push_back(2);
  model.springs.reference.push_back(length);
}

inline void add_patch_points(model::Model& model, const PatchSize& size) {
  for (int64_t c = 0; c < size.columns_x * size.columns_y; ++c)
    for (int64_t a = 0; a < size.layers; ++a) {
      const bool deepest = a == size.layers - 1;
      model.points.position.push_back({static_cast<double>(c % size.columns_x) * size.spacing,
                                       static_cast<double>(c / size.columns_x) * size.spacing,
                                       -static_cast<double>(a) * size.thickness});
      model.points.set.push_back(deepest ? model::PointSet::bone : model::PointSet::soft_tissue);
      model.points.layer.push_back(static_cast<int32_t>(a));
      model.points.column.push_back(c);
      model.points.bone.push_back(deepest ? 0 : -1);
    }
  model.points.target = model.points.position;
  model.points.mass.assign(model.points.position.size(), 0.0);
  model.points.external_force.assign(model.points.position.size(), Vec3::Zero());
  model.bones = {"bone"};
}

/// Springs by set, as in a model built from a scene: layers, connecting, diagonals.
inline void add_patch_springs(model::Model& model, const PatchSize& size, const PatchSkin& skin) {
  const int64_t n = size.layers;
  for (int64_t a = 0; a < n; ++a) {
    model.spring_sets.push_back("layer " + std::to_string(a));
    for (const auto& [p, q] : skin.edges) add_patch_spring(model, p * n + a, q * n + a);
  }
  for (int64_t a = 0; a + 1 < n; ++a) {
    model.spring_sets.push_back("connecting " + std::to_string(a));
    for (int64_t c = 0; c < size.columns_x * size.columns_y; ++c)
      add_patch_spring(model, c * n + a, c * n + a + 1);
  }
  for (int64_t a = 0; a + 1 < n; ++a) {
    model.spring_sets.push_back("diagonal " + std::to_string(a));
    for (const auto& [p, q] : skin.edges) {
      add_patch_spring(model, p * n + a, q * n + a + 1);
      add_patch_spring(model, q * n + a, p * n + a + 1);
    }
  }
}

/// Prisms by gap, with positive volume.
inline void add_patch_prisms(model::Model& model, const PatchSize& size, const PatchSkin& skin) {
  const int64_t n = size.layers;
  for (int64_t a = 0; a + 1 < n; ++a)
    for (const auto& [p, q, r] : skin.triangles) {
      const std::array<int64_t, 6> corners = {p * n + a,     r * n + a,     q * n + a,
                                              p * n + a + 1, r * n + a + 1, q * n + a + 1};
      std::array<Vec3, 6> x;
      for (int c = 0; c < 6; ++c) x[c] = model.points.position[corners[c]];
      model.prisms.points.push_back(corners);
      model.prisms.rest_volume.push_back(model::prism_volume(x.data()));
    }
}

inline model::Model layered_patch(const PatchSize& size) {
  model::Model model;
  const PatchSkin skin = patch_skin(size);
  add_patch_points(model, size);
  add_patch_springs(model, size, skin);
  add_patch_prisms(model, size, skin);
  return model;
}

}  // namespace repose::test
