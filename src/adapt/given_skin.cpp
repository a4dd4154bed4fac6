#include "repose/adapt/given_skin.h"

#include <Eigen/Dense>
#include <algorithm>
#include <map>

#include "repose/meshtools/signed_distance.h"
#include "repose/surface/triangle_tree.h"

namespace repose::adapt {

namespace {

constexpr size_t neighbors = 16;
constexpr int max_rings = 4;             // of edges around the nearest triangle
constexpr double fade = 20;              // mm
constexpr double ridge = 0.01;           // of the mean square extent of the neighbors
constexpr double beyond_farthest = 1.1;  // where the weights end

/// A copy whose triangles share the points that lie at one place, as the sides of cuts do.
surface::Surface welded(const surface::Surface& skin) {
  std::map<std::array<double, 3>, int64_t> first;
  surface::Surface whole = skin;
  for (Triangle& triangle : whole.triangles)
    for (int64_t& p : triangle) {
      const Vec3& at = skin.points[p];
      p = first.try_emplace({at.x(), at.y(), at.z()}, p).first->second;
    }
  return whole;
}

/// The solved skin, by whose points places move.
class SolvedSkin {
 public:
  explicit SolvedSkin(const surface::Surface& skin)
      : skin_(skin),
        whole_(welded(skin)),
        distance_(whole_),
        tree_(whole_),
        beside_(skin.points.size()) {
    for (const Triangle& t : skin.triangles)
      for (int k = 0; k < 3; ++k)
        for (const int other : {1, 2}) beside_[t[k]].push_back(t[(k + other) % 3]);
  }

  /// The share of the motion that is left at a place: 1 over the skin, 0 far beyond its rim.
  double share_at(const Vec3& at) const {
    const auto off = distance_.at(at);
    return off.beyond_rim ? std::clamp(1 - std::abs(off.distance) / fade, 0.0, 1.0) : 1.0;
  }
  /// The displacement of a place as a sum over points.
  GivenSkinMap::Sum motion_at(const Vec3& at) const;

 private:
  std::vector<int64_t> points_near(const Vec3& at) const;

  const surface::Surface& skin_;
  surface::Surface whole_;
  meshtools::SignedDistance distance_;
  surface::TriangleTree tree_;
  std::vector<std::vector<int64_t>> beside_;  // [points] the other ends of its edges
};

/// The nearest points, nearest first, of those around the nearest triangle: so they are on one side
/// of a cut.
std::vector<int64_t> SolvedSkin::points_near(const Vec3& at) const {
  const Triangle& nearest = skin_.triangles[tree_.nearest(at).triangle];
  std::vector<int64_t> found(nearest.begin(), nearest.end());
  for (int ring = 0; ring < max_rings && found.size() < neighbors; ++ring)
    for (size_t k = 0, count = found.size(); k < count; ++k)
      for (const int64_t p : beside_[found[k]])
        if (std::find(found.begin(), found.end(), p) == found.end()) found.push_back(p);
  std::sort(found.begin(), found.end(), [&](int64_t p, int64_t q) {
    return (skin_.points[p] - at).squaredNorm() < (skin_.points[q] - at).squaredNorm();
  });
  found.resize(std::min(found.size(), neighbors));
  return found;
}

/// The affine motion of the nearest points at `at`, weighted by (1 − d²/h²)².
GivenSkinMap::Sum SolvedSkin::motion_at(const Vec3& at) const {
  const std::vector<int64_t> near = points_near(at);
  const double reach = beyond_farthest * (skin_.points[near.back()] - at).norm() + 1e-9;
  double sum = 0;
  Vec3 middle = Vec3::Zero();
  GivenSkinMap::Sum motion;
  for (const int64_t row : near) {
    const double share = (skin_.points[row] - at).norm() / reach;
    motion.emplace_back(row, std::pow(1 - share * share, 2));
    sum += motion.back().second;
    middle += motion.back().second * skin_.points[row];
  }
  middle /= sum;
  Mat3 spread = Mat3::Zero();
  for (const auto& [row, weight] : motion) {
    const Vec3 beside = skin_.points[row] - middle;
    spread += weight * beside * beside.transpose();
  }
  const double extent = spread.trace() / 3;
  spread += ridge * extent * Mat3::Identity();
  Vec3 step = at - middle;
  const double far = std::sqrt(3 * extent / sum);
  if (step.norm() > far) step *= far / step.norm();
  const Vec3 slope = spread.ldlt().solve(step);
  for (auto& [row, weight] : motion) weight *= 1 / sum + (skin_.points[row] - middle).dot(slope);
  return motion;
}

}  // namespace

GivenSkinMap map_to_given(const surface::Surface& given, const surface::Surface& skin) {
  const SolvedSkin solved(skin);
  GivenSkinMap map;
  for (const Vec3& point : given.points) {
    const double share = solved.share_at(point);
    map.solved.push_back(share);
    GivenSkinMap::Sum& sum = map.sum.emplace_back();
    if (share > 0) sum = solved.motion_at(point);
    for (auto& [row, weight] : sum) weight *= share;
  }
  return map;
}

surface::PointData displacement_of_given(const surface::Surface& given,
                                         const surface::Surface& skin,
                                         const std::vector<Vec3>& displacement) {
  const GivenSkinMap map = map_to_given(given, skin);
  surface::PointData data;
  data.vectors.push_back({"displacement", {}});
  data.fields.push_back({"solved", map.solved});
  for (const GivenSkinMap::Sum& sum : map.sum) {
    Vec3& moved = data.vectors[0].values.emplace_back(Vec3::Zero());
    for (const auto& [row, weight] : sum) moved += weight * displacement[row];
  }
  return data;
}

}  // namespace repose::adapt
