#include "readers.h"

#include <fmt/format.h>

#include "repose/scene/landmarks.h"

namespace repose::scene {

std::vector<Vec3> read_path(const Value& value) {
  std::vector<Vec3> path;
  if (value.is_list())
    for (const Value& point : value.items()) path.push_back(point.vector());
  else
    for (const Landmark& point : read_landmarks(value.file())) path.push_back(point.position);
  if (path.size() < 2)
    value.refuse("must have two points at least, it has {}; give where it begins and ends",
                 path.size());
  return path;
}

Incision read_mouth(const Value& value, int layers) {
  return {read_path(Map(value).at("path")), layers, "mouth"};
}

namespace {

Incision read_incision(const Map& map, int layers) {
  const Value depth = map.at("layers");
  Incision incision{read_path(map.at("path")), depth.integer()};
  if (incision.layers > layers)
    depth.refuse("must be a whole number, 1 … {}, as tissue.layers is, it is {}", layers,
                 incision.layers);
  return incision;
}

}  // namespace

std::vector<Incision> read_incisions(const Value& list, int layers) {
  std::vector<Incision> incisions;
  for (const Value& item : list.items()) {
    incisions.push_back(read_incision(Map(item), layers));
    incisions.back().name = fmt::format("incisions[{}]", incisions.size() - 1);
  }
  return incisions;
}

}  // namespace repose::scene
