#include "repose/tools/bone_separation/propose_points.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "repose/anatomy/head_frame.h"
#include "repose/base/error.h"
#include "repose/imaging/isosurface.h"
#include "repose/imaging/volume_filter.h"

namespace repose::tools::bone_separation {
namespace {

// Sizes of heads, mm.
constexpr double profile_width = 15;   // of the profile, on either side of the middle
constexpr double chin_depth = 65;      // of the chin behind the front: it swings back as jaws open
constexpr double part_volume = 10000;  // mm³: smaller parts of bone are the hyoid or noise
constexpr double teeth_height[] = {25, 70}, teeth_depth = 45, teeth_width = 30;
constexpr double slab_half = 6, slab_depth = 55, slab_width = 36;
constexpr double jaw_height = 110;      // above the lowest point of the chin
constexpr double jaw_volume = 150000;   // mm³
constexpr double chin_size = 10;        // half of it
constexpr double joint_width = 25;      // from the middle, at least
constexpr double joint_way = 97;        // mm from the chin, at least; angles of jaws lie nearer
constexpr double alike = 0.9;           // of the ways on both sides
constexpr double usual_rise = 0.65;     // radians, of the way from the chin to a condyle
constexpr double most_pitch = 0.07;     // radians
constexpr double closed_volume = 1000;  // mm³, of a skull at the middle, behind the teeth
constexpr double coarser = 2;           // voxels that noise or metal is averaged over
constexpr double head_extent[] = {80, 2000};       // of a volume with a head; beyond, not in mm
constexpr double symmetric = 3;                    // voxels by which the midsagittal plane is found
constexpr double tilt[] = {0.996, 0.7};            // cosines between its normal and x: 5°, 45°
constexpr double cut_area = 30;                    // mm², of a jaw in the volume's border
constexpr double level_step = 40, max_steps = 40;  // HU
constexpr double spacing[] = {25, 10};             // of points in skull and jaw
constexpr double apart = 14;                       // skull's points from the jaw

using Cell = std::array<int64_t, 3>;

Cell cell_of(const Vec3& point, double size) {
  Cell cell;
  for (int axis = 0; axis < 3; ++axis)
    cell[axis] = static_cast<int64_t>(std::floor(point[axis] / size));
  return cell;
}

/// The rotation that takes the normal of the head's midsagittal plane to x, so that a head which is
/// rolled or yawed in the scan is found as one that is not.
Mat3 level_sides(const Volume& volume, double level) {
  const Volume rough = imaging::coarsen(volume, symmetric);
  if (imaging::value_range(rough)[1] < level) return Mat3::Identity();
  const Vec3 normal = anatomy::fit_midsagittal_normal(imaging::isosurface(rough, level));
  if (normal.x() > tilt[0] || normal.x() < tilt[1]) return Mat3::Identity();
  return Eigen::Quaterniond::FromTwoVectors(normal, Vec3::UnitX()).toRotationMatrix();
}

/// Faces of voxels in the border of a volume.
struct Cut {
  double area = 0;             // mm²
  Vec3 moment = Vec3::Zero();  // area times place in the scan
};

/// Bone of a head: where its chin and teeth are, and what hangs together at higher levels. Places
/// are leveled.
class Head {
 public:
  Head(const Volume& volume, double level, const Mat3& leveling)
      : volume_(volume), level_(level), leveling_(leveling) {
    find_bone();
    if (bone_.empty())
      base::refuse(
          "{}: no part of {:g} cm³ has values of {:g} or more; choose the level of bone: {}",
          volume.name, part_volume / 1000, level, imaging::describe_values(volume));
    find_middle();
    find_chin();
    find_teeth();
  }

  /// The chin's component without the slab at the teeth, at the lowest level at which it is no part
  /// of the skull; empty: there is none. Sets the level.
  std::vector<int64_t> part_jaw() {
    for (int step = 0; step < max_steps; ++step, level_ += level_step)
      if (std::vector<int64_t> jaw = flood(); !jaw.empty()) return jaw;
    return {};
  }

  /// Returns the longest way of a part from the chin on each side, mm; 0 for a part that is closed
  /// at the back, which is no jaw.
  std::array<Vec3, 2> rami(const std::vector<int64_t>& part) const {
    std::array<Vec3, 2> longest = {Vec3::Zero(), Vec3::Zero()};
    double behind = 0;
    for (const int64_t voxel : part) {
      const Vec3 way = center(voxel) - chin_;
      Vec3& side = longest[way.x() > 0];
      if (std::abs(way.x()) > joint_width && way.z() > 0 && way.norm() > side.norm()) side = way;
      if (std::abs(way.x()) < profile_width && way.y() > slab_depth) behind += voxel_volume();
    }
    if (behind >= closed_volume) longest.fill(Vec3::Zero());
    return longest;
  }

  /// Returns what of the jaw lies in the border of the volume.
  Cut cut_of(const std::vector<int64_t>& jaw) const {
    Cut cut;
    for (const int64_t voxel : jaw) {
      const double area = area_in_border(voxel);
      cut.area += area;
      cut.moment += area * volume_.center(voxel);
    }
    return cut;
  }

  /// One voxel inside bone in each cell of a grid, of those in `voxels`, as it lies in the scan.
  std::vector<Vec3> thinned(const std::vector<int64_t>& voxels, double size) const {
    std::map<Cell, Vec3> points;
    for (const int64_t voxel : voxels)
      if (is_inside(voxel)) points.try_emplace(cell_of(center(voxel), size), volume_.center(voxel));
    std::vector<Vec3> result;
    for (const auto& [cell, point] : points) result.push_back(point);
    return result;
  }

  /// Bone above the teeth and not near the jaw.
  std::vector<int64_t> skull(const std::vector<int64_t>& jaw) const {
    std::set<Cell> near;
    for (const int64_t voxel : jaw) {
      const Cell cell = cell_of(center(voxel), apart);
      for (int n = 0; n < 27; ++n)
        near.insert({cell[0] + n % 3 - 1, cell[1] + n / 3 % 3 - 1, cell[2] + n / 9 - 1});
    }
    std::vector<int64_t> voxels;
    for (const int64_t voxel : bone_) {
      const Vec3 at = center(voxel);
      if (volume_.values[voxel] >= level_ && above_teeth(at) > apart &&
          !near.contains(cell_of(at, apart)))
        voxels.push_back(voxel);
    }
    return voxels;
  }

 private:
  Vec3 center(int64_t voxel) const { return leveling_ * volume_.center(voxel); }

  /// mm², of the faces of a voxel in the border of the volume.
  double area_in_border(int64_t voxel) const {
    const auto at = volume_.index_of(voxel);
    double area = 0;
    for (int axis = 0; axis < 3; ++axis)
      if (at[axis] == 0 || at[axis] + 1 == volume_.size[axis])
        area += voxel_volume() / volume_.spacing(axis);
    return area;
  }

  double above_teeth(const Vec3& at) const {
    return at.z() - teeth_[0] - teeth_[1] * (at.y() - front_);
  }

  bool in_slab(const Vec3& at) const {
    return std::abs(above_teeth(at)) < slab_half && at.y() < front_ + slab_depth &&
           std::abs(at.x() - middle_) < slab_width;
  }

  bool is_inside(int64_t voxel) const {
    int count = 0;
    volume_.visit_neighbors(voxel,
                            [&](int64_t other) { count += volume_.values[other] >= level_; });
    return count == 6;
  }

  double voxel_volume() const { return std::abs(volume_.axes.determinant()); }

  /// Collects the voxels of the parts of bone that are large enough.
  void find_bone() {
    std::vector<bool> seen(volume_.values.size());
    std::vector<int64_t> part;
    const auto add = [&](int64_t voxel) {
      if (seen[voxel] || volume_.values[voxel] < level_) return;
      seen[voxel] = true;
      part.push_back(voxel);
    };
    for (size_t v = 0; v < volume_.values.size(); ++v) {
      add(static_cast<int64_t>(v));
      if (part.empty()) continue;
      for (size_t next = 0; next < part.size(); ++next) volume_.visit_neighbors(part[next], add);
      if (static_cast<double>(part.size()) * voxel_volume() >= part_volume)
        bone_.insert(bone_.end(), part.begin(), part.end());
      part.clear();
    }
    std::sort(bone_.begin(), bone_.end());
  }

  void find_middle() {
    std::vector<double> across;
    for (const int64_t voxel : bone_) across.push_back(center(voxel).x());
    middle_ = base::median(std::move(across));
  }

  /// Finds the lowest bone behind the front, and the front between there and the teeth.
  void find_chin() {
    std::map<int64_t, double> profile;  // every 2 mm of height: the foremost y
    for (const int64_t voxel : bone_) {
      const Vec3 at = center(voxel);
      if (std::abs(at.x() - middle_) > profile_width) continue;
      double& minimum = profile.try_emplace(std::llround(at.z() / 2), at.y()).first->second;
      minimum = std::min(minimum, at.y());
    }
    const auto foremost = [&](double low, double high) {
      double front = std::numeric_limits<double>::infinity();
      for (const auto& [height, y] : profile)
        if (2.0 * static_cast<double>(height) >= low && 2.0 * static_cast<double>(height) <= high)
          front = std::min(front, y);
      return front;
    };
    const double limit = foremost(-INFINITY, INFINITY) + chin_depth;
    for (const auto& [height, y] : profile)
      if (y < limit) {
        chin_ = {middle_, y, 2 * static_cast<double>(height)};
        break;
      }
    front_ = foremost(chin_.z(), chin_.z() + teeth_height[1]);
    std::vector<double> across;
    for (const int64_t voxel : bone_) {
      const Vec3 way = center(voxel) - chin_;
      if (std::abs(way.y()) < chin_size && std::abs(way.z()) < chin_size)
        across.push_back(center(voxel).x());
    }
    chin_.x() = base::median(std::move(across));
  }

  /// Fits height over depth of the densest twentieth of the bone where teeth are.
  void find_teeth() {
    std::vector<std::pair<float, Vec3>> values;
    for (const int64_t voxel : bone_) {
      const Vec3 at = center(voxel);
      const double height = at.z() - chin_.z();
      if (height > teeth_height[0] && height < teeth_height[1] && at.y() < front_ + teeth_depth &&
          std::abs(at.x() - middle_) < teeth_width)
        values.emplace_back(volume_.values[voxel], at);
    }
    if (values.size() < 100)
      base::refuse(
          "{}: no teeth above the chin, at height {:.0f} mm; does the CT hold the jaw, in LPS?",
          volume_.name, chin_.z());
    const size_t dense = values.size() / 20;
    std::nth_element(values.begin(), values.begin() + static_cast<int64_t>(dense), values.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    double y = 0, z = 0, yy = 0, yz = 0;
    const auto count = static_cast<double>(dense);
    for (size_t i = 0; i < dense; ++i) {
      const double depth = values[i].second.y() - front_, height = values[i].second.z();
      y += depth / count;
      z += height / count;
      yy += depth * depth / count;
      yz += depth * height / count;
    }
    const double slope = std::clamp((yz - y * z) / std::max(yy - y * y, 1.0), -0.4, 0.4);
    teeth_ = {z - slope * y, slope};
  }

  /// The chin's component at the level; empty where it is none of a jaw.
  std::vector<int64_t> flood() const {
    std::vector<int64_t> found;
    std::vector<bool> seen(volume_.values.size());
    const auto add = [&](int64_t voxel) {
      if (seen[voxel] || volume_.values[voxel] < level_ || in_slab(center(voxel))) return;
      seen[voxel] = true;
      found.push_back(voxel);
    };
    for (const int64_t voxel : bone_) {
      const Vec3 at = center(voxel);
      if (at.z() < chin_.z() + 15 && at.y() < front_ + chin_depth &&
          std::abs(at.x() - middle_) < profile_width)
        add(voxel);
    }
    for (size_t next = 0; next < found.size(); ++next) {
      if (center(found[next]).z() > chin_.z() + jaw_height ||
          static_cast<double>(found.size()) * voxel_volume() > jaw_volume)
        return {};
      volume_.visit_neighbors(found[next], add);
    }
    return found;
  }

  const Volume& volume_;
  double level_;
  Mat3 leveling_;
  std::vector<int64_t> bone_;
  double middle_ = 0, front_ = 0;  // mm: x, y at the teeth
  Vec3 chin_ = Vec3::Zero();
  std::array<double, 2> teeth_{};  // height at the front, and slope, of the occlusal plane
};

struct Proposal {
  std::array<std::vector<Vec3>, 2> points;  // in skull and jaw
  double least = 0, most = 0;               // mm, of the ways from the chin on both sides
  double rise = 0;                          // of the longer way, radians
  Cut cut;
};

Proposal propose(const Volume& volume, double level, const Mat3& leveling) {
  Head head(volume, level, leveling);
  const std::vector<int64_t> jaw = head.part_jaw();
  if (jaw.empty()) return {};
  const auto [right, left] = head.rami(jaw);
  const Vec3& longer = right.norm() > left.norm() ? right : left;
  return {{head.thinned(head.skull(jaw), spacing[0]), head.thinned(jaw, spacing[1])},
          std::min(right.norm(), left.norm()),
          longer.norm(),
          std::atan2(longer.z(), longer.y()),
          head.cut_of(jaw)};
}

bool is_doubtful(const Proposal& found) {
  return found.least < joint_way || found.least < alike * found.most;
}

/// Refuses a jaw that was not found, or that the volume does not hold as a whole.
void require_jaw(const Proposal& found, const std::string& volume) {
  if (found.cut.area >= cut_area)
    base::refuse(
        "{}: the volume ends inside the jaw, at {:.0f} ({:.0f} mm² of bone); give a CT that holds "
        "the jaw from the chin to its condyles, or points in skull and jaw (-apart)",
        volume, Vec3(found.cut.moment / found.cut.area), found.cut.area);
  if (found.least < joint_way)
    base::refuse(
        "{}: the jaw was not found, because it is part of the skull at every level, lacks its "
        "condyles or is turned: the head must look along −y, its top along z (LPS); give points in "
        "skull and jaw (-apart), or mend the volume's direction",
        volume);
}

/// Refuses a volume whose sides are all too short, or all too long, for a head in mm.
void require_millimeters(const Volume& volume) {
  Vec3 sides;
  for (int axis = 0; axis < 3; ++axis)
    sides[axis] = static_cast<double>(volume.size[axis]) * volume.spacing(axis);
  if (sides.maxCoeff() < head_extent[0] || sides.minCoeff() > head_extent[1])
    base::refuse(
        "{}: is {:.3g} × {:.3g} × {:.3g} mm large, which no CT of a head is; give its spacing in "
        "mm (m and µm are read as mm)",
        volume.name, sides[0], sides[1], sides[2]);
}

}  // namespace

std::array<std::vector<Vec3>, 2> propose_points(const Volume& volume, double level) {
  require_millimeters(volume);
  Mat3 leveling = level_sides(volume, level);
  Proposal found = propose(volume, level, leveling);
  const auto take_better = [&](const Volume& from) {
    Proposal other = propose(from, level, leveling);
    if (other.least > found.least) found = std::move(other);
  };
  if (found.least > 0 && is_doubtful(found) && std::abs(found.rise - usual_rise) > most_pitch) {
    leveling = Eigen::AngleAxisd(usual_rise - found.rise, Vec3::UnitX()) * leveling;
    take_better(volume);
  }
  if (is_doubtful(found)) take_better(coarsen(volume, coarser));
  require_jaw(found, volume.name);
  return std::move(found.points);
}

}  // namespace repose::tools::bone_separation
