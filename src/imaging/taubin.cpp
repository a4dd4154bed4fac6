#include "repose/imaging/taubin.h"

#include <algorithm>

#include "repose/surface/edges.h"

namespace repose::imaging {
using namespace surface;
namespace {

constexpr double lambda = 0.5, pass_band = 0.1, mu = -1 / (1 / lambda - pass_band);

/// Moves all points that do not stay.
void step(const VertexNeighbors& neighbors, const std::vector<char>& stays, double weight,
          const std::vector<Vec3>& from, std::vector<Vec3>& to) {
  for (size_t p = 0; p < from.size(); ++p) {
    const std::span<const int64_t> around = neighbors[static_cast<int64_t>(p)];
    to[p] = from[p];
    if (stays[p] || around.empty()) continue;
    Vec3 sum = Vec3::Zero();
    for (const int64_t other : around) sum += from[other];
    to[p] += weight * (sum / static_cast<double>(around.size()) - from[p]);
  }
}

}  // namespace

double smooth_taubin(Surface& surface, int64_t rounds, const Watch& watch) {
  const EdgeTable edges(surface.triangles);
  const VertexNeighbors neighbors(edges, surface.points.size());
  const std::vector<char> stays = border_vertices(edges, surface.points.size());
  const std::vector<Vec3> before = surface.points;
  std::vector<Vec3> between(before.size());
  for (int64_t round = 0; round < rounds; ++round) {
    step(neighbors, stays, lambda, surface.points, between);
    step(neighbors, stays, mu, between, surface.points);
    if (watch) watch(static_cast<double>(round + 1) / static_cast<double>(rounds));
  }
  double maximum = 0;
  for (size_t p = 0; p < before.size(); ++p)
    maximum = std::max(maximum, (surface.points[p] - before[p]).norm());
  return maximum;
}

}  // namespace repose::imaging
