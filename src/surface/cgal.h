#pragma once
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <string>

#include "repose/surface/surface.h"

/// Kernel and conversions of all CGAL-based files. Predicates are exact, constructions rounded.
namespace repose::surface {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point3 = Kernel::Point_3;
using Triangle3 = Kernel::Triangle_3;
using Segment3 = Kernel::Segment_3;

inline Point3 to_cgal(const Vec3& point) { return {point.x(), point.y(), point.z()}; }
inline Vec3 from_cgal(const Point3& point) { return {point.x(), point.y(), point.z()}; }

inline Triangle3 to_cgal(const Surface& surface, const Triangle& triangle) {
  return {to_cgal(surface.points[triangle[0]]), to_cgal(surface.points[triangle[1]]),
          to_cgal(surface.points[triangle[2]])};
}

/// The triangles of a CGAL::Surface_mesh without garbage.
template <class Mesh>
Surface surface_of(const Mesh& mesh, const std::string& name) {
  Surface surface{name, {}, {}};
  for (const auto vertex : mesh.vertices()) surface.points.push_back(from_cgal(mesh.point(vertex)));
  for (const auto face : mesh.faces()) {
    const auto h = mesh.halfedge(face);
    surface.triangles.push_back({mesh.source(h), mesh.target(h), mesh.target(mesh.next(h))});
  }
  return surface;
}

}  // namespace repose::surface
