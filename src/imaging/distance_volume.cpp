#include "distance_volume.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "repose/surface/triangle_tree.h"

namespace repose::imaging {
using namespace surface;
namespace {

using Index = std::array<int64_t, 3>;
using Vec3f = Eigen::Vector3f;

/// Closest points of a surface, found at its triangles and handed on by sweeps over the grid.
class ClosestPoints {
 public:
  explicit ClosestPoints(const Volume& grid)
      : grid_(grid),
        voxel_(grid.spacing(0)),
        closest_(grid.size[0] * grid.size[1] * grid.size[2]),
        squared_(closest_.size(), std::numeric_limits<float>::infinity()) {}

  void add(const Corners& triangle) {
    Index low, high;
    for (int a = 0; a < 3; ++a) {
      const auto [least, most] = std::minmax({triangle[0][a], triangle[1][a], triangle[2][a]});
      low[a] = std::clamp(static_cast<int64_t>(std::floor((least - grid_.origin[a]) / voxel_)),
                          int64_t{0}, grid_.size[a] - 1);
      high[a] = std::clamp(static_cast<int64_t>(std::ceil((most - grid_.origin[a]) / voxel_)),
                           int64_t{0}, grid_.size[a] - 1);
    }
    for (int64_t k = low[2]; k <= high[2]; ++k)
      for (int64_t j = low[1]; j <= high[1]; ++j)
        for (int64_t i = low[0]; i <= high[0]; ++i) {
          Vec3 point;
          squared_distance(grid_.origin + place(i, j, k).cast<double>(), triangle, &point);
          offer(grid_.index(i, j, k), place(i, j, k), (point - grid_.origin).cast<float>());
        }
  }

  /// Each of the eight sweeps carries closest points along one diagonal of the grid.
  std::vector<float> distances() {
    for (int sweep = 0; sweep < 16; ++sweep) run(sweep % 8);
    std::vector<float> distance(squared_.size());
    for (size_t v = 0; v < distance.size(); ++v) distance[v] = std::sqrt(squared_[v]);
    return distance;
  }

 private:
  /// mm beside the origin, small enough for floats.
  Vec3f place(int64_t i, int64_t j, int64_t k) const {
    return static_cast<float>(voxel_) *
           Vec3f(static_cast<float>(i), static_cast<float>(j), static_cast<float>(k));
  }

  void offer(int64_t voxel, const Vec3f& at, const Vec3f& point) {
    const float squared = (point - at).squaredNorm();
    if (!(squared < squared_[voxel])) return;
    squared_[voxel] = squared;
    closest_[voxel] = point;
  }

  void run(int directions) {
    const auto [columns, rows, slices] = grid_.size;
    const std::array<bool, 3> back{(directions & 1) != 0, (directions & 2) != 0,
                                   (directions & 4) != 0};
    const Index behind{back[0] ? 1 : -1, (back[1] ? 1 : -1) * columns,
                       (back[2] ? 1 : -1) * columns * rows};
    for (int64_t c = 0; c < slices; ++c)
      for (int64_t b = 0; b < rows; ++b)
        for (int64_t a = 0; a < columns; ++a) {
          const int64_t i = back[0] ? columns - 1 - a : a, j = back[1] ? rows - 1 - b : b,
                        k = back[2] ? slices - 1 - c : c;
          const int64_t voxel = grid_.index(i, j, k);
          const std::array<bool, 3> has{a > 0, b > 0, c > 0};
          const Vec3f at = place(i, j, k);
          for (int n = 0; n < 3; ++n)
            if (has[n] && std::isfinite(squared_[voxel + behind[n]]))
              offer(voxel, at, closest_[voxel + behind[n]]);
        }
  }

  const Volume& grid_;
  double voxel_;
  std::vector<Vec3f> closest_;  ///< mm beside the origin
  std::vector<float> squared_;  ///< mm²
};

}  // namespace

Volume distance_volume(const Surface& surface, const Volume& grid) {
  ClosestPoints points(grid);
  for (const Triangle& triangle : surface.triangles) points.add(corners(surface, triangle));
  return {surface.name, grid.size, grid.axes, grid.origin, points.distances(), {}};
}

Volume distance_volume(const Surface& surface, double voxel, double margin) {
  Vec3 low = surface.points.front(), high = low;
  for (const Vec3& point : surface.points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  Volume grid;
  grid.axes = voxel * Mat3::Identity();
  grid.origin = low - Vec3::Constant(margin);
  for (int a = 0; a < 3; ++a)
    grid.size[a] = 2 + static_cast<int64_t>((high[a] - low[a] + 2 * margin) / voxel);
  return distance_volume(surface, grid);
}

}  // namespace repose::imaging
