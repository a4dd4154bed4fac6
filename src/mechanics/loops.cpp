#include "repose/mechanics/loops.h"

#include <algorithm>

namespace repose::mechanics {

namespace {

template <size_t n>
bool touches_soft_tissue(const model::Points& points, const std::array<int64_t, n>& element) {
  return std::any_of(element.begin(), element.end(),
                     [&](int64_t i) { return points.set[i] == model::PointSet::soft_tissue; });
}

SpringLoop make_spring_loop(const model::Model& part, int exponent, int64_t owned) {
  SpringLoop loop;
  loop.exponent = exponent;
  const model::Springs& springs = part.springs;
  for (size_t e = 0; e < springs.points.size(); ++e) {
    if (springs.exponent[e] != exponent) continue;
    if (!touches_soft_tissue(part.points, springs.points[e])) continue;
    loop.points.push_back(
        {static_cast<int32_t>(springs.points[e][0]), static_cast<int32_t>(springs.points[e][1])});
    loop.stiffness.push_back(springs.stiffness[e]);
    loop.rest_length.push_back(springs.rest_length[e]);
    loop.inverse_reference.push_back(1.0 / springs.reference[e]);
    if (static_cast<int64_t>(e) < owned) ++loop.counted;
  }
  return loop;
}

}  // namespace

Loops make_loops(const model::Model& part, int64_t owned_springs, int64_t owned_prisms) {
  Loops loops;
  for (int exponent = 0; exponent <= 2; ++exponent) {
    SpringLoop loop = make_spring_loop(part, exponent, owned_springs);
    if (loop.size() > 0) loops.springs.push_back(std::move(loop));
  }
  const model::Prisms& prisms = part.prisms;
  for (size_t e = 0; e < prisms.points.size(); ++e) {
    if (!touches_soft_tissue(part.points, prisms.points[e])) continue;
    std::array<int32_t, 6> corners;
    std::copy(prisms.points[e].begin(), prisms.points[e].end(), corners.begin());
    loops.prisms.points.push_back(corners);
    loops.prisms.rest_volume.push_back(prisms.rest_volume[e]);
    loops.prisms.row.push_back(static_cast<int64_t>(e));
    if (static_cast<int64_t>(e) < owned_prisms) ++loops.prisms.counted;
  }
  loops.prisms.target_volume = loops.prisms.rest_volume;
  return loops;
}

}  // namespace repose::mechanics
