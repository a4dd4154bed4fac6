#include "repose/adapt/report.h"

#include <fmt/format.h>

#include <cmath>

namespace repose::adapt {

std::string describe_choice(const Ladder& ladder, double wanted) {
  const Rung& chosen = ladder.rungs.back();
  return fmt::format(
      "  {:<22} of these, the last; its skin is {:.2g} mm from the scene's own at most, by its "
      "distance from the one before{}\n",
      "solved model", chosen.discretisation_error,
      chosen.discretisation_error > wanted
          ? fmt::format(": MORE THAN THE {:g} mm ASKED FOR", wanted)
          : "");
}

std::string describe_ladder(const Ladder& ladder) {
  std::string text;
  for (const Rung& r : ladder.rungs) {
    text += fmt::format(
        "  {:<22} {} points, edges {:.3g} mm, {} layers: {} evaluations, {} of the "
        "Hessian, {:.2f} s",
        "coarse model", r.points, r.resolution.edge, r.resolution.layers, r.evaluations,
        r.assemblies, r.seconds);
    if (std::isfinite(r.skin_change))
      text += fmt::format("; skin {:.2g} mm from the one before", r.skin_change);
    text += "\n";
  }
  if (!ladder.refusal.empty())
    text += fmt::format("  {:<22} {}\n", "no finer coarse model", ladder.refusal);
  return text;
}

}  // namespace repose::adapt
