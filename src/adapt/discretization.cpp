#include "repose/adapt/discretization.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "repose/meshtools/remesh.h"

namespace repose::adapt {

namespace {

constexpr double still = 0.1;  // mm, below which a skin point does not count as moving

/// Mean distance of two positions of the skin points that move.
double mean_difference(const GridSequence& sequence, const std::vector<Vec3>& position,
                       const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double sum = 0, count = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    if (sequence.layer[i] > 0) continue;
    if ((position[i] - sequence.initial[i]).norm() < still) continue;
    sum += (a[i] - b[i]).norm();
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

}  // namespace

std::vector<Resolution> halved_resolutions(const model::Anatomy& anatomy) {
  constexpr double fewest = 100;  // columns
  const scene::Tissue& tissue = anatomy.scene.tissue;
  const bool free = layers_are_free(tissue);
  const double edge = meshtools::even_edge(anatomy.skin);
  std::vector<Resolution> resolutions;
  for (const int times : {4, 2}) {
    if (static_cast<double>(anatomy.skin.points.size()) < fewest * times * times) continue;
    const int gaps = std::max(1, static_cast<int>(std::lround((tissue.layers - 1.0) / times)));
    resolutions.push_back({times * edge, free ? gaps + 1 : tissue.layers});
  }
  return resolutions;
}

Convergence convergence_of(const model::Anatomy& anatomy, const model::Counts& own,
                           int64_t max_unknowns) {
  constexpr int finer = 2, growth = 8;  // of the unknowns
  const scene::Tissue& tissue = anatomy.scene.tissue;
  Convergence found{halved_resolutions(anatomy), "these are the finest that are tried"};
  found.resolutions.push_back({0, tissue.layers});
  if (!tissue.edge) found.limit = "the skin as given is the finest mesh there is; give tissue.edge";
  if (!layers_are_free(tissue))
    found.limit = "the scene fixes its layers (tissue.depths, depths_mm or mass)";
  if (!tissue.edge || !layers_are_free(tissue)) return found;
  double edge = meshtools::even_edge(anatomy.skin);
  int64_t unknowns = 3 * own.soft;
  int gaps = tissue.layers - 1;
  for (int k = 0; k < finer; ++k) {
    unknowns *= growth;
    if (unknowns > max_unknowns) {
      found.limit = fmt::format("a finer one has about {:.2g} million unknowns",
                                1e-6 * static_cast<double>(unknowns));
      break;
    }
    found.resolutions.push_back({edge /= 2, (gaps *= 2) + 1});
  }
  return found;
}

Discretization discretization_of(const std::vector<Vec3>& position, const GridSequence& sequence) {
  Discretization found;
  found.at_point.assign(position.size(), 0.0);
  if (!sequence.before.empty()) {
    const double last = mean_difference(sequence, position, position, sequence.position);
    const double before = mean_difference(sequence, position, sequence.position, sequence.before);
    found.observed = last > 0 && before > last;
    if (found.observed) found.order = std::clamp(std::log2(before / last), 0.5, 2.0);
  }
  const double share = 1 / (std::exp2(found.order) - 1);
  std::vector<double> moving;
  for (size_t i = 0; i < position.size(); ++i) {
    if (sequence.layer[i] > 0) continue;
    found.at_point[i] = share * (position[i] - sequence.position[i]).norm();
    if ((position[i] - sequence.initial[i]).norm() >= still) moving.push_back(found.at_point[i]);
  }
  if (moving.empty()) return found;
  std::sort(moving.begin(), moving.end());
  for (const double error : moving) found.mean += error / static_cast<double>(moving.size());
  found.percentile_95 = moving[(moving.size() - 1) * 95 / 100];
  found.largest = moving.back();
  return found;
}

std::string describe_discretization(const Discretization& d) {
  return fmt::format(
      "  {:<22} leave the moving skin {:.2g} mm from the continuum on average, {:.2g} mm at 95 %, "
      "{:.2g} mm at most (order {:.2g} {})\n",
      "mesh and layers", d.mean, d.percentile_95, d.largest, d.order,
      d.observed ? "observed" : "assumed");
}

}  // namespace repose::adapt
