#include "repose/model/build.h"

#include "load_entry.h"
#include "repose/anatomy/same_head.h"
#include "repose/base/error.h"
#include "repose/meshtools/osteotomy.h"
#include "repose/surface/component.h"
#include "repose/surface/read.h"

namespace repose::model {
namespace {

meshtools::Osteotomy plan_of(const scene::Osteotomy& cut, const std::string& piece) {
  meshtools::Osteotomy plan{piece, {}, {}, cut.kerf, cut.seed};
  for (const scene::CutPlane& plane : cut.planes) {
    plan.planes.push_back({plane.point, plane.normal});
    if (plane.radius) plan.planes.back().radius = *plane.radius;
  }
  if (cut.surface) plan.surface = meshtools::load_cutter(*cut.surface);
  if (cut.sheet) plan.surface = surface::Surface{"sheet", cut.sheet->points, cut.sheet->triangles};
  return plan;
}

void make(const scene::Scene& scene, const scene::Osteotomy& cut, Bones& bones) {
  surface::Surface& bone = bones.surfaces[cut.bone];
  const std::string& name = scene.bones[cut.piece].name;
  meshtools::Pieces parts = meshtools::cut_bone(bone, plan_of(cut, name));
  bones.remarks.push_back(fmt::format(
      "piece '{}' of {:.0f} mm³ is cut off '{}', which keeps {:.0f} mm³; the saw takes {:.0f} mm³",
      name, surface::volume_of(parts.piece), scene.bones[cut.bone].name,
      surface::volume_of(parts.rest), parts.kerf_volume));
  bones.remarks.insert(bones.remarks.end(), parts.remarks.begin(), parts.remarks.end());
  bone = std::move(parts.rest);
  bones.surfaces.push_back(std::move(parts.piece));
}

}  // namespace

Bones read_bones(const scene::Scene& scene, const surface::Surface* skin) {
  scene::require_bones(scene);
  Bones bones;
  const size_t whole = scene.bones.size() - scene.osteotomies.size();
  for (size_t b = 0; b < whole; ++b) {
    const surface::Surface raw = load_entry(scene.bones[b].surface, surface::Role::raw);
    bones.surfaces.push_back(surface::accept_surface(raw, surface::Role::bone));
    if (surface::volume_of(raw) < 0)
      bones.warnings.push_back(fmt::format(
          "{}: its triangles face inward, as after changing the sign of one axis: make sure that "
          "left is left, and export the mesh again",
          raw.name));
  }
  if (scene.anatomy)
    anatomy::require_same_head(scene.anatomy->landmarks, scene.anatomy->file.string(),
                               skin ? *skin : load_entry(scene.skin, surface::Role::raw),
                               bones.surfaces);
  for (size_t k = 0; k < scene.osteotomies.size(); ++k) {
    try {
      make(scene, scene.osteotomies[k], bones);
    } catch (const base::InputError& error) {
      base::refuse("{}: osteotomies[{}]: {}", scene.file.string(), k, error.what());
    }
  }
  return bones;
}

}  // namespace repose::model
