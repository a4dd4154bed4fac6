#include "read_osteotomies.h"

#include "bone_names.h"

namespace repose::scene {
namespace {

CutPlane read_plane(const Value& item) {
  const Map map(item);
  CutPlane plane{map.at("point").vector(), map.at("normal").vector(), {}};
  if (!(plane.normal.norm() > 0)) map.at("normal").refuse("must not be zero; give a direction");
  if (const auto radius = map.find("radius")) plane.radius = radius->number();
  return plane;
}

Osteotomy read_osteotomy(const Map& map, const std::vector<BoneEntry>& bones) {
  Osteotomy cut{};
  const Value bone = map.at("bone");
  cut.bone = find_bone(bone.text(), bone, bones);
  if (const auto planes = map.find("planes"))
    for (const Value& plane : planes->items()) cut.planes.push_back(read_plane(plane));
  if (const auto surface = map.find("surface")) cut.surface = surface->file();
  if (cut.planes.empty() && !cut.surface)
    map.itself().refuse("has no cut; give planes: [{{point: ..., normal: ...}}] or a surface");
  if (const auto kerf = map.find("kerf")) cut.kerf = kerf->number();
  if (const auto seed = map.find("seed")) cut.seed = seed->vector();
  return cut;
}

}  // namespace

void read_osteotomies(const Value& list, Scene& scene) {
  for (const Value& item : list.items()) {
    const Map map(item);
    Osteotomy cut = read_osteotomy(map, scene.bones);
    cut.piece = scene.bones.size();
    const std::string name = read_new_name(map.at("piece"), scene.bones);
    scene.bones.push_back({name, scene.bones[cut.bone].surface});
    scene.osteotomies.push_back(std::move(cut));
  }
}

}  // namespace repose::scene
