#include "readers.h"

#include <limits>

namespace repose::scene {
namespace {

PaintedRegion read_painted(const Value& value) {
  const Map map(value);
  const auto color = map.find("color"), property = map.find("property");
  if (color.has_value() == property.has_value()) value.refuse("needs one of color and property");
  PaintedRegion region;
  region.file = map.at("mesh").file();
  if (property) region.property = property->text();
  if (const auto minimum = map.find("at_least")) {
    if (color) minimum->refuse("is of property, and color is given; remove one");
    region.at_least = minimum->number();
  }
  if (color) {
    const std::vector<double> given = color->numbers();
    if (given.size() != 3) color->refuse("must be red, green and blue, it has {}", given.size());
    region.color = {given[0], given[1], given[2]};
  }
  const auto depth = map.find("depth");
  region.depth = depth ? depth->number() : std::numeric_limits<double>::infinity();
  return region;
}

Region read_space(const std::string& kind, const Map& map) {
  const Value value = map.at(kind);
  if (kind == "mesh") return ClosedMesh{value.file()};
  if (kind == "volume") return LabelRegion{value.file_or_folder(), map.at("label").integer()};
  if (kind == "curve") return CurveRegion{read_path(value), map.at("radius").number()};
  if (kind == "box") return read_box(Map(value));
  return read_sphere(Map(value));
}

}  // namespace

Region read_region(const Map& map) {
  return read_space(map.only({"sphere", "box", "mesh", "volume", "curve"}), map);
}

SkinRegion read_skin_region(const Map& map) {
  const std::string kind = map.only({"sphere", "box", "mesh", "volume", "curve", "painted"});
  if (kind == "painted") return read_painted(map.at(kind));
  return read_space(kind, map);
}

Sphere read_sphere(const Map& map) {
  return {map.at("center").vector(), map.at("radius").number()};
}

Box read_box(const Map& map) {
  const Value size = map.at("size");
  Box box{map.at("center").vector(), size.vector()};
  if (!(box.size.minCoeff() > 0)) size.refuse("must be greater than 0 along every axis");
  return box;
}

}  // namespace repose::scene
