#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "study.h"

namespace repose::tradeoff {

namespace {

constexpr double negligible = 0.3;  // of what the model leaves: a finer search changes nothing

/// The fastest converged run of each accuracy, by accuracy.
std::map<double, const Measurement*> fastest(const std::vector<Measurement>& found) {
  std::map<double, const Measurement*> best;
  for (const Measurement& m : found) {
    if (m.variant.study != "solver" || !m.converged) continue;
    const Measurement*& kept = best[m.variant.accuracy];
    if (!kept || m.seconds < kept->seconds) kept = &m;
  }
  return best;
}

std::string describe_costs(const std::map<double, const Measurement*>& best) {
  if (best.empty()) return "No run of the solver reached its accuracy.";
  const Measurement &loose = *best.rbegin()->second, &tight = *best.begin()->second;
  std::string text = fmt::format("{:g} mm costs {:.2g} s ({})", loose.variant.accuracy,
                                 loose.seconds, loose.variant.method);
  if (best.size() > 1)
    text += fmt::format(", {:g} mm {:.2g} s ({})", tight.variant.accuracy, tight.seconds,
                        tight.variant.method);
  return text + ".";
}

/// The row of a study at the scene's own layers or, of a mesh, the finest one; none where no row
/// could be compared.
const Measurement* row_of(const std::vector<Measurement>& found, const std::string& study,
                          const Variant& usual) {
  const Measurement* chosen = nullptr;
  for (const Measurement& m : found) {
    if (m.variant.study != study || !std::isfinite(m.skin_95)) continue;
    if (study == "layers" && m.variant.layers != usual.layers) continue;
    if (!chosen || m.variant.edge < chosen->variant.edge) chosen = &m;
  }
  return chosen;
}

int max_layers(const std::vector<Measurement>& found) {
  int maximum = 0;
  for (const Measurement& m : found)
    if (m.variant.study == "layers") maximum = std::max(maximum, m.variant.layers);
  return maximum;
}

}  // namespace

std::string conclude(const std::vector<Measurement>& found, const Variant& usual) {
  std::string text = describe_costs(fastest(found));
  const Measurement* layers = row_of(found, "layers", usual);
  const Measurement* mesh = row_of(found, "mesh", usual);
  const int maximum = max_layers(found);
  double left = 0;
  if (layers && maximum > usual.layers) {
    left = layers->skin_95;
    text += fmt::format(" {} layers leave 95 % of the skin within {:.2g} mm of {} layers.",
                        usual.layers, left, maximum);
  }
  if (mesh)
    text += fmt::format(" A skin with edges of {:g} mm is {:.2g} mm away (95 %).",
                        mesh->variant.edge, mesh->skin_95);
  if (left == 0) return text + " Compare more layers (-layers) to learn what the model leaves.";
  if (usual.accuracy <= negligible * left)
    return text + fmt::format(" Refine layers and mesh before asking for more than {:g} mm.",
                              usual.accuracy);
  return text + fmt::format(" A finer accuracy than the scene's {:g} mm pays, down to {:.1g} mm.",
                            usual.accuracy, negligible * left);
}

}  // namespace repose::tradeoff
