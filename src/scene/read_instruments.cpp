#include "readers.h"

namespace repose::scene {
namespace {

/// A vector that must not be zero.
Vec3 read_direction(const Value& value) {
  Vec3 direction = value.vector();
  if (!(direction.norm() > 0)) value.refuse("must not be zero; give a direction");
  return direction;
}

Instrument read_instrument(const Map& map) {
  Instrument instrument{{}, read_direction(map.at("push"))};
  if (const auto skin = map.find("skin")) instrument.slide = skin->choice() == 1;
  int shapes = 0;
  const auto shape = [&](const char* name, const auto& read) {
    if (const auto value = map.find(name)) {
      instrument.shape = read(*value);
      ++shapes;
    }
  };
  shape("sphere", [](const Value& value) {
    const Map of(value);
    return Sphere{of.at("center").vector(), of.at("radius").number()};
  });
  shape("capsule", [](const Value& value) {
    const Map of(value);
    return Capsule{of.at("from").vector(), of.at("to").vector(), of.at("radius").number()};
  });
  shape("box", [](const Value& value) { return read_box(Map(value)); });
  shape("half_space", [](const Value& value) {
    const Map of(value);
    return HalfSpace{of.at("point").vector(), read_direction(of.at("normal"))};
  });
  shape("mesh", [](const Value& value) { return ClosedMesh{value.file()}; });
  if (shapes != 1)
    map.itself().refuse("must hold exactly one of sphere, capsule, box, half_space, mesh");
  return instrument;
}

}  // namespace

std::vector<Instrument> read_instruments(const Value& list) {
  std::vector<Instrument> instruments;
  for (const Value& item : list.items()) instruments.push_back(read_instrument(Map(item)));
  return instruments;
}

}  // namespace repose::scene
