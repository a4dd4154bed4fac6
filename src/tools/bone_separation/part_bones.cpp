#include "repose/tools/bone_separation/part_bones.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "minimum_cut.h"
#include "repose/base/error.h"

namespace repose::tools::bone_separation {
namespace {

constexpr double firmness = 7;  // what an edge well inside a bone costs more, in areas of its face

/// The voxels at or above a level as the nodes of a graph.
class Bone {
 public:
  Bone(const Volume& volume, double level)
      : volume_(volume), level_(level), node_(volume.values.size(), -1) {
    double above = 0;
    for (size_t v = 0; v < volume.values.size(); ++v)
      if (volume.values[v] >= level) {
        node_[v] = static_cast<int32_t>(voxels_.size());
        voxels_.push_back(static_cast<int64_t>(v));
        above += volume.values[v] - level;
      }
    if (above > 0) typical_ = above / static_cast<double>(voxels_.size());
    for (int axis = 0; axis < 3; ++axis)
      area_[axis] = volume.axes.col((axis + 1) % 3).cross(volume.axes.col((axis + 2) % 3)).norm();
  }

  const std::vector<int64_t>& voxels() const { return voxels_; }
  double typical() const { return typical_; }  ///< how far values lie above the level

  GridGraph graph() const {
    const std::array<int32_t, 6> none = {-1, -1, -1, -1, -1, -1};
    GridGraph graph{std::vector<std::array<int32_t, 6>>(voxels_.size(), none),
                    std::vector<std::array<int32_t, 6>>(voxels_.size())};
    for (size_t node = 0; node < voxels_.size(); ++node)
      for (int axis = 0; axis < 3; ++axis) {
        const int32_t other = next(voxels_[node], axis);
        if (other < 0) continue;
        const size_t up = 2 * static_cast<size_t>(axis), down = up + 1;
        graph.neighbor[node][up] = other;
        graph.neighbor[other][down] = static_cast<int32_t>(node);
        graph.capacity[node][up] = graph.capacity[other][down] =
            cost(voxels_[node], voxels_[other], axis);
      }
    return graph;
  }

  /// Holds the nodes within `radius` of a point in a terminal; says whether there is one.
  bool hold(const Vec3& point, double radius, uint8_t terminal, Terminals& terminals) const {
    bool found = false;
    for (size_t node = 0; node < voxels_.size(); ++node)
      if ((volume_.center(voxels_[node]) - point).squaredNorm() <= radius * radius) {
        terminals[node] = terminal;
        found = true;
      }
    return found;
  }

  /// mm², of the faces between the two sides.
  double area_between(const std::vector<bool>& side) const {
    double total = 0;
    for (size_t node = 0; node < voxels_.size(); ++node)
      for (int axis = 0; axis < 3; ++axis) {
        const int32_t other = next(voxels_[node], axis);
        if (other >= 0 && side[node] != side[other]) total += area_[axis];
      }
    return total;
  }

 private:
  /// The node of the next voxel along an axis; −1: none.
  int32_t next(int64_t voxel, int axis) const {
    if (volume_.index_of(voxel)[axis] + 1 == volume_.size[axis]) return -1;
    const std::array<int64_t, 3> stride = {1, volume_.size[0], volume_.size[0] * volume_.size[1]};
    return node_[voxel + stride[axis]];
  }

  /// In units of which the smallest face costs one.
  int32_t cost(int64_t voxel, int64_t other, int axis) const {
    const double above = std::min(volume_.values[voxel], volume_.values[other]) - level_;
    const double firm = std::clamp(above / typical_, 0.0, 1.0);
    const double faces = area_[axis] / *std::min_element(area_.begin(), area_.end());
    return static_cast<int32_t>(std::lround(faces * (1 + firmness * firm)));
  }

  const Volume& volume_;
  double level_, typical_ = 1;
  std::vector<int32_t> node_;
  std::vector<int64_t> voxels_;
  std::array<double, 3> area_;
};

/// Refuses points of the first bone that the second would hold.
void check_apart(const std::string& name, const std::array<std::vector<Vec3>, 2>& points) {
  for (const Vec3& first : points[0])
    for (const Vec3& second : points[1])
      if (const double distance = (first - second).norm(); distance <= part_hold[1])
        base::refuse(
            "{}: point {:.1f} of the first bone is {:.2g} mm from a point of the second, expected "
            "more than {:g} mm; give each bone points of its own",
            name, first, distance, part_hold[1]);
}

Terminals terminals_of(const Bone& bone, const Volume& volume, double level,
                       const std::array<std::vector<Vec3>, 2>& points) {
  Terminals terminals(bone.voxels().size(), 0);
  for (const uint8_t part : {0, 1})
    for (const Vec3& point : points[part])
      if (!bone.hold(point, part_hold[part], part + 1, terminals))
        base::refuse(
            "{}: point {:.1f} of the {} bone has no value of {:g} or more within {} mm; put it "
            "into the bone, in LPS",
            volume.name, point, part == 0 ? "first" : "second", level, part_hold[part]);
  if (std::find(terminals.begin(), terminals.end(), 1) == terminals.end())
    base::refuse("{}: the points of the first bone all lie beside those of the second",
                 volume.name);
  return terminals;
}

}  // namespace

PartedBones part_bones(const Volume& volume, double level,
                       const std::array<std::vector<Vec3>, 2>& points) {
  check_apart(volume.name, points);
  const Bone bone(volume, level);
  const Terminals terminals = terminals_of(bone, volume, level, points);
  GridGraph graph = bone.graph();
  const std::vector<bool> second = minimum_cut(graph, terminals);
  PartedBones result{{volume, volume}, bone.area_between(second)};
  // 1.5 times as far below as it was above: the surface between two voxels lies nearer to its own.
  for (size_t node = 0; node < second.size(); ++node) {
    const int64_t voxel = bone.voxels()[node];
    const double above = std::max(volume.values[voxel] - level, 0.01 * bone.typical());
    result.parts[second[node] ? 0 : 1].values[voxel] = static_cast<float>(level - 1.5 * above);
  }
  return result;
}

}  // namespace repose::tools::bone_separation
