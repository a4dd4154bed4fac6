#include "distance_volume.h"

#include <algorithm>
#include <cmath>

#include "repose/surface/edges.h"
#include "repose/surface/triangle_tree.h"

namespace repose::imaging {
using namespace surface;
namespace {

using Index = std::array<int64_t, 3>;
using Vec3f = Eigen::Vector3f;

/// Closest points of a surface, found at its triangles and handed on between neighbors.
class ClosestPoints {
 public:
  ClosestPoints(const Volume& grid, double reach)
      : grid_(grid),
        voxel_(grid.spacing(0)),
        closest_(grid.values.size()),
        squared_(grid.values.size(), 0),
        changed_(grid.values.size(), 0) {
    for (size_t v = 0; v < squared_.size(); ++v)
      if (grid.values[v] > 0) squared_[v] = static_cast<float>(reach * reach);
  }

  void add(const Corners& triangle) {
    Index low, high;
    for (int a = 0; a < 3; ++a) {
      const auto [minimum, maximum] = std::minmax({triangle[0][a], triangle[1][a], triangle[2][a]});
      low[a] = std::clamp(static_cast<int64_t>(std::floor((minimum - grid_.origin[a]) / voxel_)),
                          int64_t{0}, grid_.size[a] - 1);
      high[a] = std::clamp(static_cast<int64_t>(std::ceil((maximum - grid_.origin[a]) / voxel_)),
                           int64_t{0}, grid_.size[a] - 1);
    }
    for (int64_t k = low[2]; k <= high[2]; ++k)
      for (int64_t j = low[1]; j <= high[1]; ++j)
        for (int64_t i = low[0]; i <= high[0]; ++i) {
          const int64_t voxel = grid_.index(i, j, k);
          if (squared_[voxel] == 0) continue;
          Vec3 point;
          squared_distance(grid_.origin + place({i, j, k}).cast<double>(), triangle, &point);
          if (offer(voxel, {i, j, k}, (point - grid_.origin).cast<float>())) changed_[voxel] = 1;
        }
  }

  /// Each voxel offers its closest point to its neighbors until none is improved.
  std::vector<float> distances() {
    std::vector<Index> front, next;  // in the order of memory at first
    for (int64_t voxel = 0; voxel < std::ssize(changed_); ++voxel)
      if (changed_[voxel]) front.push_back(grid_.index_of(voxel));
    for (; !front.empty(); front.swap(next)) {
      next.clear();
      for (const Index& at : front) propagate(at, next);
    }
    for (float& value : squared_) value = std::sqrt(value);
    return std::move(squared_);
  }

 private:
  /// mm beside the origin, small enough for floats.
  Vec3f place(const Index& at) const {
    return static_cast<float>(voxel_) *
           Vec3f(static_cast<float>(at[0]), static_cast<float>(at[1]), static_cast<float>(at[2]));
  }

  /// True if the point is the closest so far.
  bool offer(int64_t voxel, const Index& at, const Vec3f& point) {
    const float squared = (point - place(at)).squaredNorm();
    if (!(squared < squared_[voxel])) return false;
    squared_[voxel] = squared;
    closest_[voxel] = point;
    return true;
  }

  void propagate(const Index& at, std::vector<Index>& next) {
    const int64_t voxel = grid_.index(at[0], at[1], at[2]);
    changed_[voxel] = 0;
    const Vec3f point = closest_[voxel];
    for (int axis = 0; axis < 3; ++axis)
      for (const int64_t side : {-1, 1}) {
        Index beside = at;
        beside[axis] += side;
        if (beside[axis] < 0 || beside[axis] >= grid_.size[axis]) continue;
        const int64_t other = grid_.index(beside[0], beside[1], beside[2]);
        if (!offer(other, beside, point) || changed_[other]) continue;
        changed_[other] = 1;
        next.push_back(beside);
      }
  }

  const Volume& grid_;
  double voxel_;
  std::vector<Vec3f> closest_;  ///< mm beside the origin, where the distance is below the reach
  std::vector<float> squared_;  ///< mm²
  std::vector<char> changed_;   ///< since a voxel last offered its point
};

}  // namespace

Volume distance_volume(const Surface& surface, Volume grid, double reach) {
  ClosestPoints points(grid, reach);
  for (const Triangle& triangle : surface.triangles) points.add(corners(surface, triangle));
  grid.name = surface.name;
  grid.values = points.distances();
  return grid;
}

Volume distance_volume(const Surface& surface, double voxel, double margin, double reach) {
  const Eigen::AlignedBox3d box = bounding_box(surface.points);
  Volume grid;
  grid.axes = voxel * Mat3::Identity();
  grid.origin = box.min() - Vec3::Constant(margin);
  for (int a = 0; a < 3; ++a)
    grid.size[a] = 2 + static_cast<int64_t>((box.sizes()[a] + 2 * margin) / voxel);
  grid.values.assign(grid.size[0] * grid.size[1] * grid.size[2], 1);
  return distance_volume(surface, std::move(grid), reach);
}

}  // namespace repose::imaging
