#include "solved_skin.h"

#include <fmt/format.h>

#include "bone_field.h"
#include "motion_range.h"
#include "region.h"
#include "repose/meshtools/face.h"

namespace repose::model {
namespace {

constexpr double deepest_lifted = 3, thinnest_tissue = 0.3;  // mm

meshtools::FaceRequest request_of(const Anatomy& anatomy) {
  const scene::Scene& scene = anatomy.scene;
  const double edge = *scene.tissue.edge;
  meshtools::FaceRequest request{edge > 0 ? edge : meshtools::edge_for(anatomy.skin)};
  request.margin = scene.tissue.margin;
  for (const scene::SkinRegion& region : scene.tissue.face)
    request.regions.push_back(contains_of_skin(region));
  if (!scene.instruments.empty()) return request;
  const MotionRange range(scene, anatomy.bones);
  for (size_t b = 0; b < anatomy.bones.size(); ++b)
    if (range.travel(anatomy.bones[b], static_cast<int32_t>(b)) > negligible_travel)
      request.beneath.push_back(anatomy.bones[b]);
  for (const scene::Force& force : scene.forces) request.places.push_back(force.at);
  for (const scene::Incision& cut : scene.incisions)
    request.places.insert(request.places.end(), cut.path.begin(), cut.path.end());
  return request;
}

/// Moves vertices out of the bones that they lie in, where that is not deep; returns how many.
int64_t lift_off(const std::vector<surface::Surface>& bones, surface::Surface& skin) {
  const BoneField field(bones);
  int64_t lifted = 0;
  for (Vec3& point : skin.points) {
    const BoneField::Nearest nearest = field.nearest(point);
    if (nearest.distance > deepest_lifted || field.containing(point) < 0) continue;
    const Vec3 out = nearest.point - point;
    if (out.norm() > 0) point = nearest.point + thinnest_tissue * out.normalized();
    ++lifted;
  }
  return lifted;
}

}  // namespace

void solve_remeshed(Anatomy& anatomy) {
  const meshtools::FaceRequest request = request_of(anatomy);
  meshtools::Face face = meshtools::solvable_face(anatomy.skin, request);
  anatomy.remarks.push_back(fmt::format(
      "the skin that is solved has {} vertices with edges of {:.3g} mm, no angle below {:.0f}°; of "
      "them 95 % lie within {:.2f} mm of the given skin ({} triangles), all within {:.2f} mm",
      face.skin.points.size(), request.edge, face.least_angle, face.off_95,
      anatomy.skin.triangles.size(), face.off_most));
  if (const int64_t lifted = lift_off(anatomy.bones, face.skin); lifted > 0)
    anatomy.remarks.push_back(
        fmt::format("{} vertices of it lay up to {:g} mm inside bone and were moved out", lifted,
                    deepest_lifted));
  anatomy.given_skin = std::move(anatomy.skin);
  anatomy.skin = std::move(face.skin);
}

}  // namespace repose::model
