#include "readers.h"

#include "bone_names.h"
#include "osteotomy_templates.h"

namespace repose::scene {
namespace {

CutPlane read_plane(const Value& item) {
  const Map map(item);
  CutPlane plane{map.at("point").vector(), map.at("normal").vector(), {}};
  if (!(plane.normal.norm() > 0)) map.at("normal").refuse("must not be zero; give a direction");
  if (const auto radius = map.find("radius")) plane.radius = radius->number();
  return plane;
}

/// Planes or a sheet by a template, where the entry names one.
void read_template(const Map& map, const Scene& scene, Osteotomy& cut) {
  const auto name = map.find("template"), level = map.find("level");
  if (level && !name) level->refuse("belongs to a template; give template, or remove it");
  if (!name) return;
  for (const char* other : {"planes", "surface", "seed"})
    if (const auto value = map.find(other))
      value->refuse("and template exclude each other; remove one of them");
  if (!scene.anatomy)
    name->refuse("needs landmarks to be placed by; give anatomy: {{landmarks: FILE}}");
  cut.made_by = static_cast<OsteotomyTemplate>(name->choice());
  if (level && cut.made_by == OsteotomyTemplate::sagittal_split)
    level->refuse("has no meaning for sagittal_split; remove it");
  try {
    place_template(*scene.anatomy, level ? std::optional(level->number()) : std::nullopt, cut);
  } catch (const base::InputError& error) {
    name->refuse("cannot be placed: {}", error.what());
  }
}

Osteotomy read_osteotomy(const Map& map, const Scene& scene) {
  Osteotomy cut{};
  const Value bone = map.at("bone");
  cut.bone = find_bone(bone.text(), bone, scene.bones);
  read_template(map, scene, cut);
  if (const auto planes = map.find("planes"))
    for (const Value& plane : planes->items()) cut.planes.push_back(read_plane(plane));
  if (const auto surface = map.find("surface")) cut.surface = surface->file();
  if (cut.planes.empty() && !cut.surface && !cut.sheet)
    map.itself().refuse(
        "has no cut; give planes: [{{point: ..., normal: ...}}], a surface or a template");
  if (const auto kerf = map.find("kerf")) cut.kerf = kerf->number();
  if (const auto seed = map.find("seed")) cut.seed = seed->vector();
  return cut;
}

}  // namespace

void read_osteotomies(const Value& list, Scene& scene) {
  for (const Value& item : list.items()) {
    const Map map(item);
    Osteotomy cut = read_osteotomy(map, scene);
    cut.piece = scene.bones.size();
    const std::string name = read_new_name(map.at("piece"), scene.bones);
    scene.bones.push_back({name, scene.bones[cut.bone].surface});
    if (scene.anatomy)
      for (const std::string& warning : check_cut(*scene.anatomy, cut))
        scene.warnings.push_back(
            fmt::format("osteotomies[{}]: {}", scene.osteotomies.size(), warning));
    scene.osteotomies.push_back(std::move(cut));
  }
}

}  // namespace repose::scene
