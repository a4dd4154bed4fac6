#include "repose/adapt/report.h"

#include <fmt/format.h>

#include <cmath>

namespace repose::adapt {

std::string describe_ladder(const Ladder& ladder) {
  std::string text;
  for (const Rung& r : ladder.rungs) {
    text += fmt::format(
        "  {:<22} {} points, edges {:.3g} mm, {} layers: {} evaluations, {} of the "
        "Hessian, {:.2f} s",
        "coarse model", r.points, r.resolution.edge, r.resolution.layers, r.evaluations,
        r.assemblies, r.seconds);
    if (std::isfinite(r.change))
      text +=
          fmt::format("; {:.2g} mm from the one before, skin {:.2g} mm", r.change, r.skin_change);
    text += "\n";
  }
  if (!ladder.refusal.empty())
    text += fmt::format("  {:<22} {}\n", "no finer coarse model", ladder.refusal);
  return text;
}

}  // namespace repose::adapt
