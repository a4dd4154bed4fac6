#include "readers.h"

namespace repose::scene {
namespace {

/// A vector that must not be zero.
Vec3 read_direction(const Value& value) {
  Vec3 direction = value.vector();
  if (!(direction.norm() > 0)) value.refuse("must not be zero; give a direction");
  return direction;
}

decltype(Instrument::shape) read_shape(const Map& map) {
  const std::string kind = map.only({"sphere", "capsule", "box", "half_space", "mesh"});
  const Value value = map.at(kind);
  if (kind == "mesh") return ClosedMesh{value.file()};
  const Map of(value);
  if (kind == "sphere") return read_sphere(of);
  if (kind == "box") return read_box(of);
  if (kind == "capsule")
    return Capsule{of.at("from").vector(), of.at("to").vector(), of.at("radius").number()};
  return HalfSpace{of.at("point").vector(), read_direction(of.at("normal"))};
}

Instrument read_instrument(const Map& map) {
  Instrument instrument{read_shape(map), read_direction(map.at("push"))};
  if (const auto skin = map.find("skin")) instrument.slide = skin->choice() == 1;
  return instrument;
}

}  // namespace

std::vector<Instrument> read_instruments(const Value& list) {
  std::vector<Instrument> instruments;
  for (const Value& item : list.items()) instruments.push_back(read_instrument(Map(item)));
  return instruments;
}

}  // namespace repose::scene
