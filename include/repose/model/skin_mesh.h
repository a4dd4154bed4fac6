#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "repose/base/error.h"
#include "repose/surface/surface.h"

namespace repose::model {

/// Rows of lists packed one after another: row i is item[begin[i]] … item[begin[i+1]−1].
struct Rows {
  std::vector<int64_t> begin;  ///< [rows + 1]
  std::vector<int64_t> item;
  std::span<const int64_t> operator[](int64_t row) const {
    return {item.data() + begin[row], static_cast<size_t>(begin[row + 1] - begin[row])};
  }
};

/// The skin triangulation with what the columns and layers ask of it. Edges are sorted (smaller
/// vertex first, then by vertices), so that their order depends on the triangles only.
struct SkinMesh {
  std::vector<Vec3> points;                   ///< [V] mm
  std::vector<Triangle> triangles;            ///< [F] counter-clockwise outside
  std::vector<std::array<int64_t, 2>> edges;  ///< [E]
  std::vector<int32_t> edge_triangles;        ///< [E] 1 on a border, else 2
  std::vector<double> edge_area;              ///< [E] mm², sum over its triangles
  std::vector<Vec3> triangle_normal;          ///< [F] inward, length = area in mm²
  std::vector<double> vertex_area;            ///< [V] mm², a third of the triangles around
  std::vector<Vec3> vertex_normal;            ///< [V] inward unit, area-weighted
  std::vector<std::array<int64_t, 3>> triangle_edges;  ///< [F] in the order of the edges
  Rows triangles_of;                                   ///< [V] triangles around a vertex
  Rows edges_of;                                       ///< [V] edges around a vertex
  std::vector<std::vector<int64_t>> border_loops;      ///< vertices of each, the longest (mm) first

  double edge_length(int64_t edge) const {
    return (points[edges[edge][1]] - points[edges[edge][0]]).norm();
  }
  int64_t other_end(int64_t edge, int64_t vertex) const {
    return edges[edge][0] == vertex ? edges[edge][1] : edges[edge][0];
  }
};

/// Builds the tables, O(F log F). Throws InputError naming the surface and the place where a vertex
/// is in no triangle, a triangle has no area, an edge has more than two triangles, or two triangles
/// of an edge disagree about which side is outside.
SkinMesh make_skin_mesh(const surface::Surface& skin);

/// The triangles at any of the vertices, and the vertices of the triangles; ascending.
std::vector<int64_t> triangles_at(const SkinMesh& mesh, const std::vector<int64_t>& vertices);
std::vector<int64_t> vertices_of(const SkinMesh& mesh, const std::vector<int64_t>& triangles);

/// Reverses every triangle and normal.
void flip(SkinMesh& mesh);

/// A skin that no tissue fits, with the triangles where it does not.
class RefusedPlaces : public base::InputError {
 public:
  RefusedPlaces(const std::string& message, std::string reason, surface::Surface places)
      : InputError(message), reason_(std::move(reason)), places_(std::move(places)) {}
  const std::string& reason() const { return reason_; }  ///< what is wrong there, a clause
  const surface::Surface& places() const { return places_; }

 private:
  std::string reason_;
  surface::Surface places_;
};

/// Throws RefusedPlaces: one line with what is wrong at `vertices`, every place (a part of the skin
/// that they make up) by its first vertex, and the remedy.
[[noreturn]] void refuse_places(const std::string& skin_name, const SkinMesh& mesh,
                                const std::vector<int64_t>& vertices, const std::string& what,
                                const std::string& remedy);

}  // namespace repose::model
