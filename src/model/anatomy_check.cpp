#include "anatomy_check.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "head_directions.h"
#include "repose/surface/distance.h"

namespace repose::model {
namespace {

constexpr double flat = 0.03;                           // thickness of a skin over its width
constexpr double smallest_jaw = 15, largest_jaw = 400;  // mm, from its middle: in cm it is 8
constexpr double out_of_middle = 10;                    // mm, between the middles of jaw and skull
constexpr double apart = 12;                            // mm, between jaw and skull
constexpr double turning = 1;                           // degrees
constexpr double joint_slide = 5;                       // mm
constexpr double joint_over_chin = 1.5;                 // of their displacements
constexpr double joint_up = 4;                          // mm
constexpr double opening = 3;                           // mm, of the front teeth
constexpr double at_mouth = 45;                         // mm
constexpr double along_axis = 0.5;                      // cosine
constexpr double resolution = 1e-9;
constexpr double near_border = 15;  // mm

/// A scene's anatomy with what the checks share.
struct Anatomical {
  const scene::Scene& scene;
  const MotionRange& range;
  const SkinMesh& mesh;
  const std::vector<surface::Surface>& bones;
  std::vector<BoneRole> roles;
  BoneGroup upper, lower;
  std::optional<HeadDirections> directions;  ///< that axes, sides, fit, hinge and lips need
};

std::string names_of(const Anatomical& head, BoneRole role) {
  std::vector<std::string> names;
  for (size_t b = 0; b < head.roles.size(); ++b)
    if (head.roles[b] == role) names.push_back("'" + head.scene.bones[b].name + "'");
  return fmt::format("{}", fmt::join(names, ", "));
}

bool moves(const Anatomical& head, size_t bone) {
  return head.range.travel(head.bones[bone], static_cast<int32_t>(bone)) > negligible_travel;
}

std::string check_flatness(const Anatomical& head) {
  const Vec3 squares =
      Eigen::SelfAdjointEigenSolver<Mat3>(scatter_of(head.mesh.points)).eigenvalues();
  if (squares[0] > flat * flat * squares[1] + resolution) return "";
  return "the skin is flat: it seems to be the end of a scan, not a face; give the face, or the "
         "skin of the whole head";
}

std::string check_size(const Anatomical& head) {
  if (head.lower.empty() || head.upper.empty()) return "";
  const double reach = head.lower.box.diagonal().norm() / 2;
  if (reach >= smallest_jaw && reach <= largest_jaw) return "";
  return fmt::format(
      "{} reaches {:.3g} mm from its middle, a mandible about 80 mm: surfaces seem not to be in "
      "mm; "
      "scale them",
      names_of(head, BoneRole::lower), reach);
}

std::string check_rest(const Anatomical& head) {
  bool any_moves = false, any_rests = false;
  for (size_t b = 0; b < head.bones.size(); ++b) (moves(head, b) ? any_moves : any_rests) = true;
  if (any_moves && !any_rests)
    return "every bone moves, and tissue over the rest of the skull ends free: give the skull as "
           "a bone that rests";
  if (!head.lower.empty() && head.upper.empty() && head.bones.size() == 1)
    return fmt::format(
        "there is no bone besides {}: tissue over the skull ends free; give the "
        "skull as a bone",
        names_of(head, BoneRole::lower));
  return "";
}

/// Exchanged bones and axes other than LPS exclude each other: one line tells of the first found.
std::string check_axes(const Anatomical& head) {
  const double up = (head.upper.box.center() - head.lower.box.center()).z();
  const Vec3& forward = head.directions->facing;
  if (up < 0 && head.lower.box.volume() > head.upper.box.volume())
    return fmt::format(
        "{} lies above {} and is larger: their meshes seem to be exchanged; exchange the files",
        names_of(head, BoneRole::lower), names_of(head, BoneRole::upper));
  if (head.directions->upward.z() < -along_axis)
    return fmt::format(
        "the head is upside down: {} lies above {}; +z must point up (LPS: +x left, +y back, +z "
        "up), turn all meshes",
        names_of(head, BoneRole::lower), names_of(head, BoneRole::upper));
  if (forward.y() > along_axis)
    return "the face looks towards +y: these are RAS coordinates, and a scene is in LPS (+x left, "
           "+y back, +z up); export the meshes in LPS, or change the signs of x and y in all of "
           "them and in the scene";
  if (forward.y() > -along_axis || head.directions->upward.z() < along_axis)
    return fmt::format(
        "the face looks along {:.2f} and not along −y: turn all meshes to LPS (+x left, +y back, "
        "+z up), or give moves along the head's own directions",
        forward);
  return "";
}

/// Landmarks whose names differ in the side tell left from right.
std::string check_sides(const Anatomical& head) {
  for (const auto& [name, place] : head.scene.landmarks) {
    const size_t at = name.find("left");
    if (at == std::string::npos) continue;
    std::string other = name;
    const auto found = head.scene.landmarks.find(other.replace(at, 4, "right"));
    if (found == head.scene.landmarks.end()) continue;
    if (head.directions->left.dot(place - found->second) > 0) continue;
    return fmt::format(
        "landmark {} lies on the right of {}: the head or its landmarks are mirrored; change the "
        "sign of x in one of them",
        name, other);
  }
  return "";
}

double gap_between(const BoneGroup& lower, const Anatomical& head) {
  double gap = std::numeric_limits<double>::infinity();
  for (size_t b = 0; b < head.bones.size(); ++b) {
    if (head.roles[b] != BoneRole::upper) continue;
    const surface::DistanceTree tree(head.bones[b]);
    for (const Vec3& x : lower.points) gap = std::min(gap, tree.nearest(x).distance);
  }
  return gap;
}

double middle_along(const Vec3& direction, const BoneGroup& bones) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Vec3& x : bones.points) {
    low = std::min(low, direction.dot(x));
    high = std::max(high, direction.dot(x));
  }
  return (low + high) / 2;
}

/// Returns how far the middle of the jaw lies beside that of the skull, mm: along the axis of the
/// coordinates, across where the skin faces, or along the axis by landmarks, the least of them, for
/// heads may be turned.
double middles_apart(const Anatomical& head) {
  const HeadDirections& frame = *head.directions;
  std::vector<Vec3> lefts{frame.left, frame.up.cross(frame.facing).normalized()};
  if (head.scene.anatomy) lefts.emplace_back(head.scene.anatomy->axes.row(0));
  double least = std::numeric_limits<double>::infinity();
  for (const Vec3& left : lefts)
    least =
        std::min(least, std::abs(middle_along(left, head.lower) - middle_along(left, head.upper)));
  return least;
}

std::string check_fit(const Anatomical& head) {
  const double aside = middles_apart(head);
  const std::string jaw = names_of(head, BoneRole::lower), skull = names_of(head, BoneRole::upper);
  constexpr const char* remedy = "check that both come from one scan and in one frame";
  if (aside > out_of_middle)
    return fmt::format("the middle of {} lies {:.0f} mm beside that of {}; {}", jaw, aside, skull,
                       remedy);
  const double gap = gap_between(head.lower, head);
  if (gap > apart)
    return fmt::format("{} comes no nearer to {} than {:.0f} mm; {}", jaw, skull, gap, remedy);
  return "";
}

/// Whole jaws: lower bones that no osteotomy divides.
std::vector<size_t> whole_jaws(const Anatomical& head) {
  std::vector<size_t> whole;
  for (size_t b = 0; b < head.bones.size(); ++b) {
    const bool cut = std::ranges::any_of(head.scene.osteotomies, [&](const scene::Osteotomy& o) {
      return o.bone == b || o.piece == b;
    });
    if (head.roles[b] == BoneRole::lower && !cut && moves(head, b)) whole.push_back(b);
  }
  return whole;
}

double degrees_of(const scene::RigidMotion& motion) {
  const Mat3 rotation = motion.matrix().topLeftCorner<3, 3>();
  return Eigen::AngleAxisd(rotation).angle() * 180 / std::numbers::pi;
}

std::string check_hinge(const Anatomical& head) {
  const JawPoints jaw = jaw_points(head.lower, *head.directions);
  const Vec3 joints = (jaw.left_joint + jaw.right_joint) / 2;
  for (const size_t b : whole_jaws(head)) {
    const scene::RigidMotion& move = head.scene.moves[b];
    if (degrees_of(move) < turning) continue;
    const Vec3 by = move.apply(joints) - joints;
    const double chin = (move.apply(jaw.chin) - jaw.chin).norm();
    const bool reversed = by.norm() > std::max(joint_slide, joint_over_chin * chin);
    if (!reversed && head.directions->up.dot(by) < joint_up) continue;
    return fmt::format(
        "'{}' turns about an axis far from its joints: they move {:.1f} mm and the chin {:.1f} mm; "
        "the hinge runs through both condyles, near {:.0f} and {:.0f}",
        head.scene.bones[b].name, by.norm(), chin, jaw.right_joint, jaw.left_joint);
  }
  return "";
}

bool mouth_is_open(const Anatomical& head, const Vec3& incisor) {
  const auto near = [&](const Vec3& x) { return (x - incisor).norm() < at_mouth; };
  for (size_t k = 1; k < head.mesh.border_loops.size(); ++k)
    for (const int64_t v : head.mesh.border_loops[k])
      if (near(head.mesh.points[v])) return true;
  return std::ranges::any_of(head.scene.incisions, [&](const scene::Incision& cut) {
    return std::ranges::any_of(cut.path, near);
  });
}

std::string check_lips(const Anatomical& head) {
  const JawPoints jaw = jaw_points(head.lower, *head.directions);
  if (mouth_is_open(head, jaw.incisor)) return "";
  double drop = 0;
  for (const size_t b : whole_jaws(head))
    drop = std::max(drop,
                    head.directions->up.dot(jaw.incisor - head.scene.moves[b].apply(jaw.incisor)));
  if (drop < opening) return "";
  return fmt::format(
      "the lips are one skin, and the jaw opens by {:.0f} mm at its front teeth: the mouth stays "
      "closed; part the lips (mouth: {{path: […]}}, points from one corner of the mouth to the "
      "other), or give a skin with an open mouth",
      drop);
}

/// The directions of a head by its landmarks where they tell them, otherwise by skin and bones.
std::optional<HeadDirections> directions_of(const Anatomical& head) {
  const auto& plan = head.scene.anatomy;
  if (!plan || !plan->landmarks.contains("condyle_right_center") || head.upper.empty() ||
      head.lower.empty())
    return head_directions(head.mesh, head.upper, head.lower);
  const Vec3 left = plan->axes.row(0), forward = -plan->axes.row(1), up = plan->axes.row(2);
  return HeadDirections{up, forward, left, forward, up};
}

/// The place of the border that is nearest to a bone that moves.
struct BorderPlace {
  double distance = std::numeric_limits<double>::infinity();  // mm
  int32_t bone = -1;
  Vec3 at = Vec3::Zero();
};

BorderPlace nearest_place(const MotionRange& range, const std::vector<surface::Surface>& bones,
                          const SkinMesh& mesh, const BoneField& field) {
  BorderPlace nearest;
  if (mesh.border_loops.empty()) return nearest;
  for (int32_t b = 0; b < field.size(); ++b) {
    if (range.travel(bones[b], b) <= negligible_travel) continue;
    const scene::RigidMotion back = range.only_move(b).value_or(scene::RigidMotion()).inverse();
    for (const int64_t v : mesh.border_loops.front()) {
      const Vec3& x = mesh.points[v];
      const double distance = std::min(field.distance(b, x), field.distance(b, back.apply(x)));
      if (distance < nearest.distance) nearest = {distance, b, x};
    }
  }
  return nearest;
}

std::string effect_of(scene::Rim rim) {
  return rim == scene::Rim::fixed ? "its border is held there, and skin 40 to 70 mm from the mouth "
                                    "may be off by 1.7 to 3.5 mm"
                                  : "skin 40 to 70 mm from the mouth may be off by 0.2 to 0.3 mm";
}

std::string remedy_of(const scene::Scene& scene) {
  if (scene.tissue.edge) return "solve more of the skin (tissue.margin, tissue.face)";
  return scene.rim == scene::Rim::fixed
             ? "give the skin of the whole head with tissue.edge, or boundary: {rim: auto}"
             : "give the skin of the whole head with tissue.edge";
}

}  // namespace

std::vector<std::string> check_anatomy(const scene::Scene& scene, const MotionRange& range,
                                       const SkinMesh& mesh,
                                       const std::vector<surface::Surface>& bones) {
  Anatomical head{scene, range, mesh, bones, roles_of(scene), {}, {}, {}};
  head.upper = bones_of(BoneRole::upper, head.roles, bones);
  head.lower = bones_of(BoneRole::lower, head.roles, bones);
  head.directions = directions_of(head);
  std::vector<std::string> warnings;
  const auto run = [&](std::initializer_list<std::string (*)(const Anatomical&)> checks) {
    for (const auto check : checks)
      if (std::string warning = check(head); !warning.empty())
        warnings.push_back(std::move(warning));
  };
  run({check_flatness, check_size, check_rest});
  if (head.directions) run({check_axes, check_sides, check_fit, check_hinge, check_lips});
  return warnings;
}

std::string describe_near_border(const scene::Scene& scene, const MotionRange& range,
                                 const std::vector<surface::Surface>& bones, const SkinMesh& mesh,
                                 const BoneField& field) {
  const BorderPlace place = nearest_place(range, bones, mesh, field);
  if (!(place.distance <= near_border)) return "";
  return fmt::format(
      "the skin ends {:.1f} mm from bone '{}', which moves, at {:.1f}: {} (as measured on one "
      "head); {}",
      place.distance, scene.bones[place.bone].name, place.at, effect_of(scene.rim),
      remedy_of(scene));
}

}  // namespace repose::model
