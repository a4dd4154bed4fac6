#include "read_contact.h"

#include "read_incisions.h"

namespace repose::scene {

Region read_region(const Map& map) {
  const auto sphere = map.find("sphere"), mesh = map.find("mesh"), volume = map.find("volume"),
             curve = map.find("curve");
  if (sphere.has_value() + mesh.has_value() + volume.has_value() + curve.has_value() != 1)
    map.itself().refuse("needs exactly one of sphere, mesh, volume and curve");
  if (mesh) return MeshRegion{mesh->file()};
  if (volume) return LabelRegion{volume->file_or_folder(), map.at("label").integer()};
  if (curve) return CurveRegion{read_path(*curve), map.at("radius").number()};
  const Map ball(*sphere);
  return SphereRegion{ball.at("center").vector(), ball.at("radius").number()};
}

std::vector<AttachRegion> read_attach_regions(const Value& list) {
  std::vector<AttachRegion> regions;
  for (const Value& item : list.items()) {
    const Map map(item);
    regions.push_back({read_region(map), static_cast<Attach>(map.at("attach").choice())});
  }
  return regions;
}

std::vector<AttachRegion> read_teeth(const Value& list) {
  std::vector<AttachRegion> regions;
  for (const Value& item : list.items()) regions.push_back({read_region(Map(item)), Attach::slide});
  return regions;
}

Contact read_contact(const Value& value) {
  const Map map(value);
  Contact contact;
  if (const auto bones = map.find("bones")) contact.bones = bones->choice() == 0;
  if (const auto cuts = map.find("cuts")) contact.cuts = cuts->choice() == 0;
  if (const auto grid = map.find("grid")) contact.grid = grid->number();
  if (const auto stiffness = map.find("stiffness")) contact.stiffness = stiffness->number();
  return contact;
}

}  // namespace repose::scene
