#include "border.h"

#include <fmt/format.h>

#include <limits>

namespace repose::model {
namespace {

constexpr double near_border = 15;  // mm

/// The place of the border that is nearest to a bone that moves.
struct BorderPlace {
  double distance = std::numeric_limits<double>::infinity();  // mm
  int32_t bone = -1;
  Vec3 at = Vec3::Zero();
};

BorderPlace nearest_place(const MotionRange& range, const std::vector<surface::Surface>& bones,
                          const SkinMesh& mesh, const BoneField& field) {
  BorderPlace nearest;
  if (mesh.border_loops.empty()) return nearest;
  for (int32_t b = 0; b < field.size(); ++b) {
    if (range.travel(bones[b], b) <= negligible_travel) continue;
    const scene::RigidMotion back = range.only_move(b).value_or(scene::RigidMotion()).inverse();
    for (const int64_t v : mesh.border_loops.front()) {
      const Vec3& x = mesh.points[v];
      const double distance = std::min(field.distance(b, x), field.distance(b, back.apply(x)));
      if (distance < nearest.distance) nearest = {distance, b, x};
    }
  }
  return nearest;
}

std::string effect_of(scene::Rim rim) {
  return rim == scene::Rim::fixed ? "its border is held there, and skin 40 to 70 mm from the mouth "
                                    "may be off by 1.7 to 3.5 mm"
                                  : "skin 40 to 70 mm from the mouth may be off by 0.2 to 0.3 mm";
}

std::string remedy_of(const scene::Scene& scene) {
  if (scene.tissue.edge) return "solve more of the skin (tissue.margin, tissue.face)";
  return scene.rim == scene::Rim::fixed
             ? "give the skin of the whole head with tissue.edge, or boundary: {rim: auto}"
             : "give the skin of the whole head with tissue.edge";
}

}  // namespace

std::string describe_near_border(const scene::Scene& scene, const MotionRange& range,
                                 const std::vector<surface::Surface>& bones, const SkinMesh& mesh,
                                 const BoneField& field) {
  const BorderPlace place = nearest_place(range, bones, mesh, field);
  if (!(place.distance <= near_border)) return "";
  return fmt::format(
      "the skin ends {:.1f} mm from bone '{}', which moves, at {:.1f}: {} (as measured on one "
      "head); {}",
      place.distance, scene.bones[place.bone].name, place.at, effect_of(scene.rim),
      remedy_of(scene));
}

}  // namespace repose::model
