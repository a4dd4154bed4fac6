#include "repose/mechanics/nodal_volumes.h"

#include <algorithm>

#include "repose/mechanics/prism_volume.h"

namespace repose::mechanics {

namespace {

constexpr double share = 1.0 / 6;  // of a prism, to each of its points

using PrismPoints = PrismTriples<double>;

PrismPoints gather(const std::array<int32_t, 6>& points, std::span<const Vec3> values) {
  PrismPoints corners;
  for (int c = 0; c < 6; ++c) corners[c] = triple(values[points[c]]);
  return corners;
}

PrismSlope<double> slope_of(const std::array<int32_t, 6>& points, std::span<const Vec3> position) {
  return PrismSlope<double>(PrismEdges<double>(gather(points, position)));
}

/// [P] e/C, N/mm².
std::vector<double> pressures(const NodalVolumes& nodal, std::span<const Vec3> position) {
  std::vector<double> sum(nodal.stiffness.size(), 0.0);
  for (size_t m = 0; m < nodal.points.size(); ++m) {
    const double change = slope_of(nodal.points[m], position).volume - nodal.rest_volume[m];
    for (const int32_t p : nodal.points[m]) sum[p] += share * change;
  }
  for (size_t p = 0; p < sum.size(); ++p) sum[p] *= nodal.stiffness[p];
  return sum;
}

double mean(const std::array<int32_t, 6>& points, const std::vector<double>& values) {
  double sum = 0;
  for (const int32_t p : points) sum += share * values[p];
  return sum;
}

double energy(const NodalVolumes& nodal, const std::vector<double>& pressure) {
  double sum = 0;
  for (int64_t p = 0; p < nodal.counted; ++p)
    if (nodal.stiffness[p] > 0) sum += 0.5 * pressure[p] * pressure[p] / nodal.stiffness[p];
  return sum;
}

/// [P] of (e/C)' along `direction`, N/mm² a mm.
std::vector<double> pressure_rates(const NodalVolumes& nodal, std::span<const Vec3> position,
                                   std::span<const Vec3> direction) {
  std::vector<double> sum(nodal.stiffness.size(), 0.0);
  for (const auto& points : nodal.points) {
    const PrismSlope<double> v = slope_of(points, position);
    double change = 0;
    for (int c = 0; c < 6; ++c) change += v.gradient[c].dot(triple(direction[points[c]]));
    for (const int32_t p : points) sum[p] += share * change;
  }
  for (size_t p = 0; p < sum.size(); ++p) sum[p] *= nodal.stiffness[p];
  return sum;
}

}  // namespace

NodalVolumes make_nodal_volumes(const model::Model& part, int64_t owned) {
  const model::Prisms& prisms = part.prisms;
  NodalVolumes nodal;
  if (prisms.nodal_modulus.empty()) return nodal;
  std::vector<double> compliance(part.points.position.size(), 0.0);
  for (size_t m = 0; m < prisms.points.size(); ++m) {
    const auto& points = prisms.points[m];
    std::copy_n(points.begin(), 6, nodal.points.emplace_back().begin());
    for (const int64_t p : points)
      compliance[p] += share * prisms.rest_volume[m] / prisms.nodal_modulus[m];
  }
  nodal.rest_volume = prisms.rest_volume;
  for (const double c : compliance) nodal.stiffness.push_back(c > 0 ? 1 / c : 0);
  nodal.counted = owned;
  return nodal;
}

std::vector<double> nodal_slopes(const NodalVolumes& nodal, std::span<const Vec3> position) {
  const std::vector<double> pressure = pressures(nodal, position);
  std::vector<double> slopes;
  slopes.reserve(nodal.points.size());
  for (const auto& points : nodal.points) slopes.push_back(mean(points, pressure));
  return slopes;
}

double nodal_energy(const NodalVolumes& nodal, std::span<const Vec3> position) {
  return energy(nodal, pressures(nodal, position));
}

double add_nodal_gradient(const NodalVolumes& nodal, std::span<const Vec3> position, double weight,
                          std::span<Vec3> gradient) {
  const std::vector<double> pressure = pressures(nodal, position);
  for (const auto& points : nodal.points) {
    const double slope = weight * mean(points, pressure);
    const PrismSlope<double> v = slope_of(points, position);
    for (int c = 0; c < 6; ++c) gradient[points[c]] += slope * vec3(v.gradient[c]);
  }
  return energy(nodal, pressure);
}

void add_nodal_action(const NodalVolumes& nodal, std::span<const Vec3> position, double weight,
                      std::span<const Vec3> direction, std::span<Vec3> product) {
  const std::vector<double> pressure = pressures(nodal, position);
  const std::vector<double> rate = pressure_rates(nodal, position, direction);
  for (const auto& points : nodal.points) {
    const PrismEdges<double> edges(gather(points, position));
    const PrismSlope<double> v(edges);
    const PrismPoints turned =
        prism_slope_change(edges, PrismEdges<double>(gather(points, direction)));
    const double slope = weight * mean(points, pressure), bend = weight * mean(points, rate);
    for (int c = 0; c < 6; ++c)
      product[points[c]] += vec3(bend * v.gradient[c] + slope * turned[c]);
  }
}

std::vector<NodalGradient> nodal_gradients(const NodalVolumes& nodal, int64_t owned,
                                           std::span<const Vec3> position) {
  std::vector<NodalGradient> result(nodal.stiffness.size());
  for (const auto& points : nodal.points) {
    const PrismSlope<double> v = slope_of(points, position);
    for (const int32_t p : points) {
      if (p >= owned) continue;
      NodalGradient& at = result[p];
      for (int c = 0; c < 6; ++c) {
        const auto known = std::find(at.points.begin(), at.points.end(), points[c]);
        const auto k = static_cast<size_t>(known - at.points.begin());
        if (known == at.points.end()) {
          at.points.push_back(points[c]);
          at.gradient.emplace_back(Vec3::Zero());
        }
        at.gradient[k] += share * vec3(v.gradient[c]);
      }
    }
  }
  return result;
}

std::vector<double> volume_slopes(const model::Model& model, std::span<const Vec3> position) {
  const model::Prisms& prisms = model.prisms;
  const NodalVolumes nodal = make_nodal_volumes(model, 0);
  std::vector<double> slopes = nodal_slopes(nodal, position);
  slopes.resize(prisms.points.size(), 0.0);
  for (size_t m = 0; m < slopes.size(); ++m) {
    std::array<Vec3, 6> corners;
    for (int c = 0; c < 6; ++c) corners[c] = position[prisms.points[m][c]];
    const double own = prisms.modulus[m] - (nodal.empty() ? 0 : prisms.nodal_modulus[m]);
    const double v0 = prisms.rest_volume[m], change = prism_volume(corners.data()) - v0;
    slopes[m] += (own * change - prisms.modulus[m] * (prisms.target_volume[m] - v0)) / v0;
  }
  return slopes;
}

}  // namespace repose::mechanics
