#include "region.h"

#include <algorithm>
#include <memory>

#include "repose/base/error.h"
#include "repose/base/text.h"
#include "repose/imaging/volume.h"
#include "repose/surface/defects.h"
#include "repose/surface/distance.h"
#include "repose/surface/read.h"
#include "repose/surface/triangle_tree.h"

namespace repose::model {
namespace {

Contains inside(const scene::Sphere& sphere, double near) {
  return [=](const Vec3& x) { return (x - sphere.center).norm() <= sphere.radius + near; };
}

Contains inside(const scene::Box& box, double near) {
  return [=](const Vec3& x) {
    const Vec3 beyond = (x - box.center).cwiseAbs() - 0.5 * box.size;
    return beyond.cwiseMax(0).norm() <= near;
  };
}

Contains inside(const scene::TurnedBox& turned, double near) {
  return [along = inside(turned.box, near), axes = turned.axes](const Vec3& x) {
    return along(axes * x);
  };
}

Contains inside(const scene::CurveRegion& curve, double near) {
  return [=](const Vec3& x) {
    for (size_t k = 0; k + 1 < curve.path.size(); ++k) {
      const Vec3 axis = curve.path[k + 1] - curve.path[k], from = x - curve.path[k];
      const double square = axis.squaredNorm();
      const double along = square > 0 ? std::clamp(from.dot(axis) / square, 0.0, 1.0) : 0;
      if ((from - along * axis).norm() <= curve.radius + near) return true;
    }
    return false;
  };
}

Contains inside(const scene::ClosedMesh& mesh, double near) {
  const surface::Surface read = surface::read_surface(mesh.file);
  const surface::Defects defects = surface::inspect(read, false);
  if (defects.border_edges > 0 || defects.non_manifold_edges > 0)
    base::refuse("{}: a region is the inside of a closed mesh; this one is {}", mesh.file.string(),
                 surface::describe(defects));
  const auto tree = std::make_shared<surface::DistanceTree>(read);
  return [tree, near](const Vec3& x) {
    return tree->contains(x) || (near > 0 && tree->nearest(x).distance <= near);
  };
}

Contains inside(const scene::LabelRegion& region, double near) {
  const auto labels = std::make_shared<imaging::Volume>(imaging::read_volume(region.volume));
  const Mat3 to_voxels = imaging::inverse_axes(*labels);
  std::array<int64_t, 3> reach;
  for (int axis = 0; axis < 3; ++axis) reach[axis] = std::lround(near / labels->spacing(axis));
  return [labels, to_voxels, reach, label = region.label](const Vec3& x) {
    const Vec3 at = to_voxels * (x - labels->origin);
    std::array<int64_t, 3> low, high;
    for (int axis = 0; axis < 3; ++axis) {
      const int64_t voxel = std::lround(at[axis]);
      low[axis] = std::max<int64_t>(0, voxel - reach[axis]);
      high[axis] = std::min(labels->size[axis] - 1, voxel + reach[axis]);
    }
    for (int64_t k = low[2]; k <= high[2]; ++k)
      for (int64_t j = low[1]; j <= high[1]; ++j)
        for (int64_t i = low[0]; i <= high[0]; ++i)
          if (labels->at(i, j, k) == static_cast<float>(label)) return true;
    return false;
  };
}

constexpr double beside = 10;              // mm, of a painted mesh that is not the skin's
constexpr double max_share_beside = 0.05;  // of its vertices that lie farther

/// Returns a flag for each vertex: 1 where it is painted.
std::vector<char> painted_vertices(const scene::PaintedRegion& region,
                                   const surface::VertexValues& mesh) {
  constexpr double tolerance = 40;  // of 255: brushes blend at their rims
  constexpr const char* channels[3] = {"red", "green", "blue"};
  const auto values_of = [&](const std::string& name) -> const std::vector<double>& {
    if (const std::vector<double>* values = mesh.find(name)) return *values;
    base::refuse(
        "{}: its vertices have no property {}; they have {}", region.file.string(),
        base::quote(name),
        mesh.names.empty() ? "x, y and z alone" : fmt::format("{}", fmt::join(mesh.names, ", ")));
  };
  std::vector<char> painted(mesh.points.size(), 1);
  if (!region.property.empty()) {
    const std::vector<double>& values = values_of(region.property);
    for (size_t p = 0; p < painted.size(); ++p) painted[p] = values[p] >= region.at_least;
    return painted;
  }
  for (int c = 0; c < 3; ++c) {
    const std::vector<double>& values = values_of(channels[c]);
    for (size_t p = 0; p < painted.size(); ++p)
      painted[p] &= std::abs(values[p] - region.color[c]) <= tolerance;
  }
  return painted;
}

struct Paint {
  std::vector<Vec3> points;
  std::vector<char> marks;  ///< [points] painted or not
};

Paint read_paint(const scene::PaintedRegion& region) {
  const surface::VertexValues mesh = surface::read_vertex_values(region.file);
  std::vector<char> marks = painted_vertices(region, mesh);
  if (std::count(marks.begin(), marks.end(), 1) == 0)
    base::refuse("{}: none of its {} vertices is painted {}", region.file.string(), marks.size(),
                 region.property.empty()
                     ? fmt::format("{:g}", region.color)
                     : fmt::format("by {} ≥ {:g}", region.property, region.at_least));
  return {mesh.points, std::move(marks)};
}

Contains painted(const scene::PaintedRegion& region) {
  const auto paint = std::make_shared<Paint>(read_paint(region));
  const auto tree = std::make_shared<surface::TriangleTree>(surface::tree_of_points(paint->points));
  return [=](const Vec3& skin) {
    const auto vertex = tree->nearest(skin);
    return paint->marks[vertex.triangle] && std::sqrt(vertex.squared) <= beside;
  };
}

void check_on_skin(const scene::PaintedRegion& region, const surface::TriangleTree& skin) {
  const Paint paint = read_paint(region);
  size_t off = 0;
  double farthest = 0;
  for (const Vec3& point : paint.points) {
    const double distance = std::sqrt(skin.nearest(point).squared);
    off += distance > beside;
    farthest = std::max(farthest, distance);
  }
  const size_t all = paint.points.size();
  if (static_cast<double>(off) <= max_share_beside * static_cast<double>(all)) return;
  base::refuse(
      "{}: {} of its {} vertices lie more than {:g} mm from the skin, up to {:.3g} mm, expected at "
      "most {:g} %; paint a mesh of the skin in the skin's coordinates",
      region.file.string(), off, all, beside, farthest, 100 * max_share_beside);
}

}  // namespace

Contains contains_of(const scene::Region& region, double near) {
  return std::visit([&](const auto& of) { return inside(of, near); }, region);
}

Contains contains_of_skin(const scene::SkinRegion& region) {
  if (const auto* space = std::get_if<scene::Region>(&region)) return contains_of(*space);
  return painted(std::get<scene::PaintedRegion>(region));
}

ContainsTissue contains_tissue(const scene::SkinRegion& region) {
  if (const auto* space = std::get_if<scene::Region>(&region))
    return [contains = contains_of(*space)](const Vec3& place, const Vec3&) {
      return contains(place);
    };
  return [above = contains_of_skin(region), depth = std::get<scene::PaintedRegion>(region).depth](
             const Vec3& place, const Vec3& skin) {
    return above(skin) && (place - skin).norm() <= depth;
  };
}

void check_painted_meshes(const scene::Tissue& tissue, const surface::Surface& skin) {
  std::vector<scene::SkinRegion> regions = tissue.face;
  if (tissue.material)
    for (const scene::MaterialRegion& region : tissue.material->regions)
      regions.push_back(region.where);
  std::optional<surface::TriangleTree> tree;
  for (const scene::SkinRegion& region : regions) {
    const auto* painted = std::get_if<scene::PaintedRegion>(&region);
    if (!painted) continue;
    if (!tree) tree.emplace(skin);
    check_on_skin(*painted, *tree);
  }
}

}  // namespace repose::model
