#include "head_directions.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <string_view>

#include "repose/surface/edges.h"

namespace repose::model {
namespace {

constexpr double open_share = 0.2;     // of a skin's area: its mean normal, where it is a patch
constexpr double near_middle = 12;     // mm
constexpr double front_of_jaw = 0.25;  // of its extent

bool holds_any(const std::string& name, std::initializer_list<std::string_view> words) {
  return std::ranges::any_of(
      words, [&](std::string_view word) { return name.find(word) != std::string::npos; });
}

BoneRole role_by_name(std::string name) {
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
  if (holds_any(name, {"mandib", "lower", "chin"})) return BoneRole::lower;
  if (holds_any(name, {"skull", "crani", "maxill", "upper"})) return BoneRole::upper;
  return name.find("jaw") != std::string::npos ? BoneRole::lower : BoneRole::unknown;
}

Vec3 farthest_along(const std::vector<Vec3>& points, const Vec3& direction) {
  return *std::ranges::max_element(points, {}, [&](const Vec3& x) { return direction.dot(x); });
}

/// The axes of the coordinates that are nearest to what was found.
void align_with_axes(HeadDirections& frame) {
  double best = -std::numeric_limits<double>::infinity();
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      const Vec3 up = std::copysign(1, frame.upward[a]) * Vec3::Unit(a),
                 forward = std::copysign(1, frame.facing[b]) * Vec3::Unit(b);
      const double fit = up.dot(frame.upward) + forward.dot(frame.facing);
      if (a == b || fit <= best) continue;
      best = fit;
      frame.up = up;
      frame.forward = forward;
    }
  frame.left = frame.up.cross(frame.forward);
}

template <class Keep>
std::vector<Vec3> those(const std::vector<Vec3>& points, const Keep& keep) {
  std::vector<Vec3> kept;
  std::ranges::copy_if(points, std::back_inserter(kept), keep);
  return kept.empty() ? points : kept;
}

}  // namespace

std::vector<BoneRole> roles_of(const scene::Scene& scene) {
  std::vector<BoneRole> roles;
  for (const scene::BoneEntry& bone : scene.bones) roles.push_back(role_by_name(bone.name));
  for (const scene::Osteotomy& cut : scene.osteotomies) roles[cut.piece] = roles[cut.bone];
  return roles;
}

BoneGroup bones_of(BoneRole role, const std::vector<BoneRole>& roles,
                   const std::vector<surface::Surface>& bones) {
  BoneGroup group;
  for (size_t b = 0; b < bones.size(); ++b) {
    if (roles[b] != role) continue;
    group.points.insert(group.points.end(), bones[b].points.begin(), bones[b].points.end());
  }
  group.box = surface::bounding_box(group.points);
  return group;
}

std::optional<HeadDirections> head_directions(const SkinMesh& mesh, const BoneGroup& upper,
                                              const BoneGroup& lower) {
  if (upper.empty() || lower.empty()) return {};
  Vec3 outward = Vec3::Zero();
  double area = 0;
  for (const Vec3& normal : mesh.triangle_normal) {
    outward -= normal;
    area += normal.norm();
  }
  if (outward.norm() < open_share * area) return {};
  Vec3 skin = Vec3::Zero();
  for (const Vec3& x : mesh.points) skin += x / static_cast<double>(mesh.points.size());
  const Vec3 bones = (upper.box.center() + lower.box.center()) / 2;
  HeadDirections frame;
  frame.facing = outward.normalized();
  if (frame.facing.dot(skin - bones) < 0) frame.facing = -frame.facing;
  const Vec3 up = upper.box.center() - lower.box.center();
  const Vec3 across = up - up.dot(frame.facing) * frame.facing;
  if (across.norm() < 1e-3 * up.norm()) return {};
  frame.upward = across.normalized();
  align_with_axes(frame);
  return frame;
}

JawPoints jaw_points(const BoneGroup& lower, const HeadDirections& frame) {
  const double middle = frame.left.dot(lower.box.center());
  const auto side = [&](const Vec3& x) { return frame.left.dot(x) - middle; };
  const Vec3 joint = frame.up - frame.forward;
  JawPoints points;
  points.left_joint = farthest_along(
      those(lower.points, [&](const Vec3& x) { return side(x) > near_middle; }), joint);
  points.right_joint = farthest_along(
      those(lower.points, [&](const Vec3& x) { return side(x) < -near_middle; }), joint);
  const std::vector<Vec3> central =
      those(lower.points, [&](const Vec3& x) { return std::abs(side(x)) < near_middle; });
  points.chin = farthest_along(central, frame.forward - 0.5 * frame.up);
  const double front = frame.forward.dot(farthest_along(central, frame.forward));
  const double depth = front_of_jaw * lower.box.diagonal().norm() / 2;
  points.incisor = farthest_along(
      those(central, [&](const Vec3& x) { return front - frame.forward.dot(x) < depth; }),
      frame.up);
  return points;
}

}  // namespace repose::model
