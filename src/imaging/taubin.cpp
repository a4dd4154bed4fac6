#include "repose/imaging/taubin.h"

#include <algorithm>

#include "repose/surface/edges.h"

namespace repose::imaging {
using namespace surface;
namespace {

constexpr double lambda = 0.5, pass_band = 0.1, mu = -1 / (1 / lambda - pass_band);

/// Neighbours of each point, row after row; none for points on a border, which stay.
struct Neighbours {
  std::vector<int64_t> begin, point;
};

Neighbours neighbours_of(const Surface& surface) {
  const EdgeTable edges(surface.triangles);
  std::vector<bool> border(surface.points.size(), false);
  std::vector<int64_t> count(surface.points.size() + 1, 0);
  for (int64_t e = 0; e < edges.edges(); ++e) {
    const HalfEdge& half = edges[e].front();
    if (edges[e].size() == 1) border[half.low] = border[half.high] = true;
    ++count[half.low];
    ++count[half.high];
  }
  Neighbours all{std::vector<int64_t>(surface.points.size() + 1, 0), {}};
  for (size_t p = 0; p < surface.points.size(); ++p)
    all.begin[p + 1] = all.begin[p] + (border[p] ? 0 : count[p]);
  all.point.resize(all.begin.back());
  std::vector<int64_t> next(all.begin.begin(), all.begin.end() - 1);
  for (int64_t e = 0; e < edges.edges(); ++e) {
    const HalfEdge& half = edges[e].front();
    if (!border[half.low]) all.point[next[half.low]++] = half.high;
    if (!border[half.high]) all.point[next[half.high]++] = half.low;
  }
  return all;
}

void step(const Neighbours& neighbours, double weight, const std::vector<Vec3>& from,
          std::vector<Vec3>& to) {
  for (size_t p = 0; p < from.size(); ++p) {
    const int64_t begin = neighbours.begin[p], end = neighbours.begin[p + 1];
    to[p] = from[p];
    if (begin == end) continue;
    Vec3 sum = Vec3::Zero();
    for (int64_t n = begin; n < end; ++n) sum += from[neighbours.point[n]];
    to[p] += weight * (sum / static_cast<double>(end - begin) - from[p]);
  }
}

}  // namespace

double smooth_taubin(Surface& surface, int64_t rounds, const Watch& watch) {
  const Neighbours neighbours = neighbours_of(surface);
  const std::vector<Vec3> before = surface.points;
  std::vector<Vec3> between(before.size());
  for (int64_t round = 0; round < rounds; ++round) {
    step(neighbours, lambda, surface.points, between);
    step(neighbours, mu, between, surface.points);
    if (watch) watch(static_cast<double>(round + 1) / static_cast<double>(rounds));
  }
  double most = 0;
  for (size_t p = 0; p < before.size(); ++p)
    most = std::max(most, (surface.points[p] - before[p]).norm());
  return most;
}

}  // namespace repose::imaging
