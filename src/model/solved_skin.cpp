#include "solved_skin.h"

#include <fmt/format.h>

#include <algorithm>

#include "bone_field.h"
#include "load_entry.h"
#include "motion_range.h"
#include "region.h"
#include "repose/anatomy/complete.h"
#include "repose/base/error.h"
#include "repose/meshtools/face.h"
#include "repose/surface/defects.h"

namespace repose::model {
namespace {

constexpr size_t max_solved_triangles = 100'000;             // of a skin solved as it is given
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
  const auto cover = [&](const std::vector<Vec3>& path) {
    request.places.insert(request.places.end(), path.begin(), path.end());
  };
  for (const scene::Incision& cut : scene.incisions) cover(cut.path);
  if (scene.anatomy) cover(scene.anatomy->lip_gap);
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

/// Returns what of a refusal says what is wrong: "FILE: what; remedy" without file and remedy.
std::string refusal_reason(const std::string& refusal, const std::string& file) {
  std::string text = refusal.substr(0, refusal.find(';'));
  if (text.starts_with(file + ": ")) text.erase(0, file.size() + 2);
  return text;
}

std::string describe_remeshing(const meshtools::Face& face, const Anatomy& anatomy, double edge) {
  return fmt::format(
      "the skin that is solved has {} vertices with edges of {:.3g} mm, no angle below {:.0f}°; of "
      "them 95 % lie within {:.2f} mm of the given skin ({} triangles), all within {:.2f} mm",
      face.skin.points.size(), edge, face.min_angle, face.off_95, anatomy.skin.triangles.size(),
      face.off_max);
}

}  // namespace

GivenSkin load_skin(const scene::Scene& scene) {
  if (scene.tissue.edge) return {load_entry(scene.skin, surface::Role::raw), ""};
  if (scene.tissue.keeps_given_skin) return {load_entry(scene.skin, surface::Role::skin), ""};
  surface::Surface raw = load_entry(scene.skin, surface::Role::raw);
  if (raw.triangles.size() > max_solved_triangles)
    return {std::move(raw), fmt::format("it has more than {} triangles", max_solved_triangles)};
  try {
    surface::Surface skin = surface::accept_surface(raw, surface::Role::skin);
    if (surface::inspect(skin, false).border_edges > 0) return {std::move(skin), ""};
    return {std::move(skin), "it is closed, as that of a whole head"};
  } catch (const base::InputError& refusal) {
    std::string obstacle = refusal_reason(refusal.what(), raw.name);
    return {std::move(raw), std::move(obstacle)};
  }
}

void remesh_skin(Anatomy& anatomy) {
  const meshtools::FaceRequest request = request_of(anatomy);
  meshtools::Face face = meshtools::solvable_face(anatomy.skin, request);
  anatomy.remarks.push_back(describe_remeshing(face, anatomy, request.edge));
  anatomy::fit_lips(face.skin, anatomy.scene, anatomy.remarks);
  const bool parted = std::ranges::any_of(anatomy.scene.incisions, &scene::Incision::parts_lips);
  if (!parted && face.openings >= face.borders && face.borders > 0 && face.openings > 0)
    anatomy.warnings.push_back(fmt::format(
        "remeshing closed {} of {} openings of the given skin, such as its mouth: give a smaller "
        "tissue.edge, or part the lips by mouth.path",
        face.openings - face.borders + 1, face.openings));
  if (const int64_t lifted = lift_off(anatomy.bones, face.skin); lifted > 0)
    anatomy.remarks.push_back(
        fmt::format("{} vertices of it lay up to {:g} mm inside bone and were moved out", lifted,
                    deepest_lifted));
  anatomy.given_skin = std::move(anatomy.skin);
  anatomy.skin = std::move(face.skin);
}

bool replace_given_skin(Anatomy& anatomy, const std::string& obstacle) {
  scene::Tissue& tissue = anatomy.scene.tissue;
  if (tissue.edge || tissue.keeps_given_skin) return false;
  tissue.edge = 0;
  const size_t first = anatomy.remarks.size();
  try {
    remesh_skin(anatomy);
  } catch (const base::InputError&) {
    tissue.edge.reset();
    return false;
  }
  std::string& remark = anatomy.remarks[first];
  remark = fmt::format(
      "the given skin was remeshed: {}; {}; tissue.edge sets the length, and tissue.edge: given "
      "keeps the given mesh",
      obstacle, remark);
  return true;
}

}  // namespace repose::model
