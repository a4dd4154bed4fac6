#include "read_material.h"

#include <algorithm>
#include <limits>

#include "material_presets.h"

namespace repose::scene {

namespace {

/// The moduli of an item; Poisson's ratio is `poisson` where it gives none.
Elasticity read_elasticity(const Map& map, double poisson) {
  const auto given = map.find("poisson");
  return {map.at("young").number(), given ? given->number() : poisson};
}

Stratum read_stratum(const Value& value, double poisson) {
  const Map map(value);
  return {map.at("thickness").number(), read_elasticity(map, poisson)};
}

PaintedRegion read_painted(const Value& value) {
  const Map map(value);
  const auto color = map.find("color"), property = map.find("property");
  if (color.has_value() == property.has_value()) value.refuse("needs one of color and property");
  PaintedRegion region;
  region.file = map.at("mesh").file();
  if (property) region.property = property->text();
  if (const auto least = map.find("at_least")) {
    if (color) least->refuse("is of property, and color is given; remove one");
    region.at_least = least->number();
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

MaterialRegion read_region(const Value& value, double poisson) {
  const Map map(value);
  const auto sphere = map.find("sphere"), mesh = map.find("mesh"), volume = map.find("volume");
  const auto painted = map.find("painted");
  if (sphere.has_value() + mesh.has_value() + volume.has_value() + painted.has_value() != 1)
    value.refuse("needs one of sphere, mesh, volume and painted");
  const Elasticity elasticity = read_elasticity(map, poisson);
  if (mesh) return {MeshRegion{mesh->file()}, elasticity};
  if (volume) return {LabelRegion{volume->file_or_folder(), map.at("label").integer()}, elasticity};
  if (painted) return {read_painted(*painted), elasticity};
  const Map ball(*sphere);
  return {SphereRegion{ball.at("center").vector(), ball.at("radius").number()}, elasticity};
}

void read_dilatation(const Value& value, Material& material) {
  material.dilatation = static_cast<Dilatation>(value.choice());
  if (material.dilatation == Dilatation::prism) return;
  double least = material.deep.poisson;
  for (const Stratum& stratum : material.strata)
    least = std::min(least, stratum.elasticity.poisson);
  for (const MaterialRegion& region : material.regions)
    least = std::min(least, region.elasticity.poisson);
  if (!(least > 0))
    value.refuse(
        "nodal averages what resists changes of volume: every poisson must be above 0, one is {}; "
        "raise it or remove dilatation",
        least);
}

}  // namespace

Material default_material() { return material_presets().front().material; }

Material read_material(const Value& value) {
  const Map map(value);
  const auto preset = map.find("preset");
  Material material = material_presets()[preset ? preset->choice() : 0].material;
  if (const auto young = map.find("young")) material.deep.young = young->number();
  if (const auto poisson = map.find("poisson")) {
    material.deep.poisson = poisson->number();
    for (Stratum& stratum : material.strata) stratum.elasticity.poisson = poisson->number();
  }
  const auto skin = map.find("skin"), strata = map.find("strata");
  if (skin && strata) strata->refuse("and tissue.material.skin exclude each other; remove one");
  if (skin) material.strata = {read_stratum(*skin, material.deep.poisson)};
  if (strata) {
    material.strata.clear();
    for (const Value& item : strata->items())
      material.strata.push_back(read_stratum(item, material.deep.poisson));
  }
  if (const auto regions = map.find("regions"))
    for (const Value& item : regions->items())
      material.regions.push_back(read_region(item, material.deep.poisson));
  if (const auto dilatation = map.find("dilatation")) read_dilatation(*dilatation, material);
  return material;
}

}  // namespace repose::scene
