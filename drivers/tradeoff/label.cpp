#include "label.h"

#include <fmt/format.h>

namespace repose::tradeoff {

std::string label(const Way& way) {
  if (way.study == "load steps")
    return way.load_steps > 0 ? fmt::format("{}", way.load_steps) : "automatic";
  if (way.study == "volume") return std::string(word(way.volume));
  if (way.study == "layers" || way.study == "springs") return fmt::format("{}", way.layers);
  if (way.study == "mesh") return way.edge > 0 ? fmt::format("{:g} mm", way.edge) : "as it is";
  return fmt::format("{}, {:g} mm", way.method, way.accuracy);
}

}  // namespace repose::tradeoff
