#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "repose/model/model.h"

namespace repose::tools::check {

/// A closed surface of triangles in uniform grids. Nothing here is shared with the trees and fields
/// that the solver uses.
class TriangleGrid {
 public:
  explicit TriangleGrid(const surface::Surface& surface);

  const Vec3& low_corner() const { return low_corner_; }
  /// mm to the closest triangle, `reach` where none is nearer.
  double distance(const Vec3& point, double reach) const;
  /// The closest point of the triangles, none where none is within `reach` (mm).
  std::optional<Vec3> closest_point(const Vec3& point, double reach) const;
  /// Returns whether the surface winds around a point: by the signed crossings of a ray, or, where
  /// it has holes, by winding_number().
  bool contains(const Vec3& point) const;
  /// The solid angles of all triangles (van Oosterom & Strackee 1983) over 4π: 1 inside a surface
  /// that faces outward, 0 outside.
  double winding_number(const Vec3& point) const;

 private:
  using Corners = std::array<Vec3, 3>;
  using Cell = std::array<int64_t, 3>;
  struct Ball {
    Vec3 center;
    double radius;  // mm
  };
  Cell cell_of(const Vec3& point) const;
  int64_t crossings(const Vec3& point) const;
  template <class Visit>
  void visit_near(const Vec3& point, double radius, Visit&& visit) const;

  std::vector<Corners> triangles_;
  std::vector<Ball> balls_;  // one around each triangle
  Vec3 low_corner_;          // mm, of the box around all as the surface lies
  bool closed_ = false;
  Vec3 low_, high_;  // mm, of the box around all, turned
  double edge_ = 1;  // mm, of a cell
  Cell size_{};
  std::vector<std::vector<int32_t>> cells_;    // triangles whose boxes meet a cell
  std::vector<std::vector<int32_t>> columns_;  // the same for columns of cells along z
  mutable int32_t latest_ = 0;                 // triangle that was closest to the latest point
};

/// A rigid body that tissue touches, beside which points are at load 0.
class Obstacle {
 public:
  Obstacle(const model::Model& model, const model::Body& body);

  bool is_mesh() const { return std::holds_alternative<TriangleGrid>(shape_); }
  /// mm, of a mesh's box: the least coordinates of its triangles.
  const Vec3& low_corner() const { return std::get<TriangleGrid>(shape_).low_corner(); }
  /// Signed distance in mm, negative inside; to a mesh `reach` where it is larger.
  double distance(const Vec3& point, double reach) const;
  /// Outward unit normal at the closest point; zero for a mesh.
  Vec3 normal(const Vec3& point) const;

 private:
  std::variant<scene::Sphere, scene::Capsule, scene::Box, scene::HalfSpace, TriangleGrid> shape_;
};

}  // namespace repose::tools::check
