#include "readers.h"

namespace repose::scene {

void read_attach_regions(const Value& list, std::vector<AttachRegion>& regions) {
  for (const Value& item : list.items()) {
    const Map map(item);
    AttachRegion& region = regions.emplace_back(
        AttachRegion{read_region(map), static_cast<Attach>(map.at("attach").choice())});
    const auto gap = map.find("gap");
    if (!gap) continue;
    region.gap = gap->number();
    if (region.gap > 0 && (region.attach == Attach::fixed || region.attach == Attach::slide))
      gap->refuse("goes with attach: contact or free, tissue that is not held; remove it");
  }
}

void read_regions(const Value& list, Attach how, std::vector<AttachRegion>& regions) {
  for (const Value& item : list.items()) regions.push_back({read_region(Map(item)), how, 0});
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
