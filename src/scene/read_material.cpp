#include "readers.h"

#include <algorithm>

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

MaterialRegion read_material_region(const Map& map, double poisson) {
  return {read_skin_region(map), read_elasticity(map, poisson)};
}

void read_dilatation(const Value& value, Material& material) {
  material.dilatation = static_cast<Dilatation>(value.choice());
  if (material.dilatation == Dilatation::prism) return;
  double minimum = material.deep.poisson;
  for (const Stratum& stratum : material.strata)
    minimum = std::min(minimum, stratum.elasticity.poisson);
  for (const MaterialRegion& region : material.regions)
    minimum = std::min(minimum, region.elasticity.poisson);
  if (!(minimum > 0))
    value.refuse(
        "nodal averages what resists changes of volume: every poisson must be above 0, one is {}; "
        "raise it or remove dilatation",
        minimum);
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
      material.regions.push_back(read_material_region(Map(item), material.deep.poisson));
  if (const auto dilatation = map.find("dilatation")) read_dilatation(*dilatation, material);
  return material;
}

}  // namespace repose::scene
