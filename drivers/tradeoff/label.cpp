#include "label.h"

#include <fmt/format.h>

namespace repose::tradeoff {

std::string label(const Variant& variant) {
  if (variant.study == "load steps")
    return variant.load_steps > 0 ? fmt::format("{}", variant.load_steps) : "automatic";
  if (variant.study == "volume") return std::string(word(variant.volume));
  if (variant.study == "layers" || variant.study == "springs")
    return fmt::format("{}", variant.layers);
  if (variant.study == "mesh")
    return variant.edge > 0 ? fmt::format("{:g} mm", variant.edge) : "as it is";
  return fmt::format("{}, {:g} mm", variant.method, variant.accuracy);
}

}  // namespace repose::tradeoff
