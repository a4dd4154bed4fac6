#include "head_directions.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <string_view>

#include "repose/surface/edges.h"

namespace repose::model {
namespace {

constexpr double open_share = 0.2;  // of a skin's area: its mean normal, where it is a patch
constexpr double sideways = 0.6;    // of the skin's mean normal along the jaw's width: of a cheek
constexpr double near_middle = 12;  // mm
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

/// The direction in which points lie farthest from their mean: of a jaw from side to side.
Vec3 widest_direction(const std::vector<Vec3>& points) {
  return Eigen::SelfAdjointEigenSolver<Mat3>(scatter_of(points)).eigenvectors().col(2);
}

/// Returns where a head with a closed skin faces: across the jaw's width and the way up to the
/// skull. Behind the jaw's middle are its highest points, of the rami, and along the nearest axis
/// of the coordinates the skull's middle; nothing if these are on different sides.
std::optional<Vec3> facing_of_bones(const BoneGroup& upper, const BoneGroup& lower) {
  constexpr double rami = 0.1, behind = 5;  // of the jaw's points; mm
  const Vec3 to_skull = upper.box.center() - lower.box.center(), up = to_skull.normalized();
  Vec3 facing = widest_direction(lower.points).cross(up).normalized();
  std::vector<Vec3> jaw = lower.points;
  std::ranges::sort(jaw, std::ranges::greater(), [&](const Vec3& x) { return up.dot(x); });
  const auto highest = static_cast<size_t>(std::ceil(rami * static_cast<double>(jaw.size())));
  const auto mean_along = [&](size_t count) {
    double sum = 0;
    for (size_t i = 0; i < count; ++i) sum += facing.dot(jaw[i]);
    return sum / static_cast<double>(count);
  };
  const double ahead = mean_along(highest) - mean_along(jaw.size());
  if (ahead > 0) facing = -facing;
  Eigen::Index axis = 0;
  facing.cwiseAbs().maxCoeff(&axis);
  if (std::abs(ahead) < behind || to_skull[axis] * std::copysign(1, facing[axis]) > -behind)
    return {};
  return facing;
}

/// Returns where a patch of skin faces, `outward` or the other way, and in its place where bones
/// face that do not face away from there: a patch of chin and neck faces down. Nothing if it is of
/// a cheek.
std::optional<Vec3> facing_of_patch(const SkinMesh& mesh, const Vec3& outward,
                                    const BoneGroup& upper, const BoneGroup& lower) {
  const Vec3 skin = base::mean(mesh.points);
  const Vec3 bones = (upper.box.center() + lower.box.center()) / 2, normal = outward.normalized();
  const bool named_wrongly = upper.box.volume() < lower.box.volume();  // a jaw is the smaller one
  const BoneGroup& jaw = named_wrongly ? upper : lower;
  if (std::abs(normal.dot(widest_direction(jaw.points))) > sideways) return {};
  const Vec3 facing = normal.dot(skin - bones) < 0 ? Vec3(-normal) : normal;
  const auto of_bones = named_wrongly ? std::nullopt : facing_of_bones(upper, lower);
  return of_bones && of_bones->dot(facing) > 0 ? of_bones : facing;
}

template <class Keep>
std::vector<Vec3> those(const std::vector<Vec3>& points, const Keep& keep) {
  std::vector<Vec3> kept;
  std::ranges::copy_if(points, std::back_inserter(kept), keep);
  return kept.empty() ? points : kept;
}

}  // namespace

Mat3 scatter_of(const std::vector<Vec3>& points) {
  const Vec3 mean = base::mean(points);
  Mat3 scatter = Mat3::Zero();
  for (const Vec3& x : points) scatter += (x - mean) * (x - mean).transpose();
  return scatter;
}

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
  const bool patch = outward.norm() >= open_share * area;
  const auto facing =
      patch ? facing_of_patch(mesh, outward, upper, lower) : facing_of_bones(upper, lower);
  if (!facing) return {};
  HeadDirections frame;
  frame.facing = *facing;
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
