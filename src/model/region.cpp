#include "region.h"

#include <algorithm>
#include <memory>

#include "repose/base/error.h"
#include "repose/imaging/volume.h"
#include "repose/surface/defects.h"
#include "repose/surface/distance.h"
#include "repose/surface/read.h"

namespace repose::model {
namespace {

Contains inside(const scene::SphereRegion& sphere, double near) {
  return [=](const Vec3& x) { return (x - sphere.center).norm() <= sphere.radius + near; };
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

Contains inside(const scene::MeshRegion& mesh, double near) {
  const surface::Surface read = surface::read_surface(mesh.file);
  const surface::Defects defects = surface::inspect(read, false);
  if (defects.border_edges > 0 || defects.non_manifold_edges > 0)
    base::refuse("{}: a region is the inside of a closed mesh; this one has {}", mesh.file.string(),
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

}  // namespace

Contains contains_of(const scene::Region& region, double near) {
  return std::visit([&](const auto& of) { return inside(of, near); }, region);
}

}  // namespace repose::model
