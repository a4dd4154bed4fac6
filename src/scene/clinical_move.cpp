#include "clinical_move.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

#include "head_axes.h"
#include "repose/base/text.h"

namespace repose::scene {
namespace {

constexpr std::array<std::string_view, 4> upper{"nasion_bone", "nasal_spine", "a_point",
                                                "upper_incisor_edge"};
constexpr std::array<std::string_view, 4> front_of_lower{"lower_incisor_edge", "b_point",
                                                         "pogonion_bone", "menton_bone"};

template <size_t n>
bool is_among(const std::array<std::string_view, n>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool is_of_rami(std::string_view name) {
  return name.starts_with("condyle_") || name.starts_with("gonion_");
}

/// Rows of bones that are no piece.
std::vector<std::size_t> whole_bones(const Scene& scene) {
  std::vector<std::size_t> rows;
  for (std::size_t b = 0; b < scene.bones.size(); ++b)
    if (std::none_of(scene.osteotomies.begin(), scene.osteotomies.end(),
                     [&](const Osteotomy& cut) { return cut.piece == b; }))
      rows.push_back(b);
  return rows;
}

std::optional<std::size_t> called(const Scene& scene, const std::vector<std::size_t>& rows,
                                  std::string_view name) {
  for (const std::size_t b : rows)
    if (base::lower(scene.bones[b].name) == name) return b;
  return std::nullopt;
}

std::optional<std::size_t> whole_bone_of(const Scene& scene, const std::string& landmark) {
  const std::vector<std::size_t> rows = whole_bones(scene);
  const auto mandible = called(scene, rows, "mandible");
  if (is_among(front_of_lower, landmark) || is_of_rami(landmark)) return mandible;
  if (!is_among(upper, landmark)) return std::nullopt;
  for (const char* name : {"maxilla", "skull"})
    if (const auto row = called(scene, rows, name)) return row;
  if (!mandible || rows.size() != 2) return std::nullopt;
  return rows[0] == *mandible ? rows[1] : rows[0];
}

/// Returns whether the piece of a cut holds a landmark; nothing where that is open.
std::optional<bool> holds(const Osteotomy& cut, const std::string& landmark, const Vec3* place) {
  if (cut.made_by == OsteotomyTemplate::sagittal_split) return !is_of_rami(landmark);
  const bool plain = !cut.surface && !cut.seed &&
                     std::none_of(cut.planes.begin(), cut.planes.end(),
                                  [](const CutPlane& plane) { return plane.radius.has_value(); });
  if (!place || !plain) return std::nullopt;
  return std::all_of(cut.planes.begin(), cut.planes.end(), [&](const CutPlane& plane) {
    return (*place - plane.point).dot(plane.normal) > 0;
  });
}

/// The row of the bone or piece on which a bony landmark of a standard name lies, by the scene
/// alone: of the lower jaw on "mandible", of the upper on "maxilla" or "skull", or on the only bone
/// beside the mandible, and on a piece of it where it lies in front of all of its planes. Nothing
/// for other landmarks, and where a cut by a surface, by a disc or with a seed leaves it open.
std::optional<std::size_t> carrying_bone(const Scene& scene, const std::string& landmark) {
  auto row = whole_bone_of(scene, landmark);
  const Vec3* place = scene.anatomy ? find(scene.anatomy->landmarks, landmark.c_str()) : nullptr;
  for (const Osteotomy& cut : scene.osteotomies) {
    if (row != cut.bone) continue;
    const auto held = holds(cut, landmark, place);
    if (!held) return std::nullopt;
    if (*held) row = cut.piece;
  }
  return row;
}

enum class Jaw { upper, lower, chin, other };

const Osteotomy* cut_of(const Scene& scene, std::size_t bone) {
  for (const Osteotomy& cut : scene.osteotomies)
    if (cut.piece == bone) return &cut;
  return nullptr;
}

constexpr const char* upper_edge = "upper_incisor_edge";
constexpr const char* lower_edge = "lower_incisor_edge";

/// By the incisors or the chin that a bone carries; a skull with incisors is no jaw.
Jaw jaw_of(const Scene& scene, std::size_t bone) {
  const Osteotomy* cut = cut_of(scene, bone);
  if (carrying_bone(scene, lower_edge) == bone) return Jaw::lower;
  const bool apart = cut || base::lower(scene.bones[bone].name) == "maxilla";
  if (apart && carrying_bone(scene, upper_edge) == bone) return Jaw::upper;
  const bool chin = cut && (cut->made_by == OsteotomyTemplate::genioplasty ||
                            carrying_bone(scene, "pogonion_bone") == bone);
  return chin ? Jaw::chin : Jaw::other;
}

/// The first of several bones whose jaw satisfies `matches`, or else the first of them.
template <class Matches>
std::size_t first_of(const std::vector<std::size_t>& bones, const Scene& scene, Matches matches) {
  const auto found = std::find_if(bones.begin(), bones.end(),
                                  [&](std::size_t bone) { return matches(jaw_of(scene, bone)); });
  return found == bones.end() ? bones.front() : *found;
}

bool has_incisors(Jaw jaw) { return jaw == Jaw::upper || jaw == Jaw::lower; }

/// One clinical move of an entry's bones, read with what it needs of the head. It turns about the
/// pivot of the first bone that has a default, and reaches targets with the first that has
/// incisors.
class ClinicalMove {
 public:
  ClinicalMove(const Value& value, const Scene& scene, const std::vector<std::size_t>& bones)
      : map_(value),
        scene_(scene),
        bones_(bones),
        bone_(first_of(bones, scene, [](Jaw jaw) { return jaw != Jaw::other; })),
        bone_with_teeth_(first_of(bones, scene, has_incisors)) {
    if (!scene.anatomy)
      value.refuse("needs the axes of the head; give anatomy: {{landmarks: FILE}}");
    try {
      axes_ = require_axes(*scene.anatomy);
    } catch (const base::InputError& error) {
      value.refuse("needs the axes of the head: {}", error.what());
    }
  }

  RigidMotion read() const {
    const RigidMotion turned = rotation();
    return RigidMotion::translation(translation(turned)).after(turned);
  }

 private:
  double number(const char* name) const {
    const auto value = map_.find(name);
    return value ? value->number() : 0.0;
  }

  /// Where a landmark of the head was at first.
  Vec3 recorded(const std::string& name) const {
    try {
      return require_landmark(scene_.anatomy->landmarks, name, scene_.anatomy->file.string());
    } catch (const base::InputError& error) {
      map_.itself().refuse("needs a landmark: {}", error.what());
    }
  }

  /// Where it is now: with the bone that carries it, or else with the one that turns.
  Vec3 now(const std::string& name) const {
    return scene_.moves[carrying_bone(scene_, name).value_or(bone_)].apply(recorded(name));
  }

  Vec3 pivot() const {
    if (const auto place = map_.find("pivot")) {
      if (place->is_list()) return place->vector();
      const std::string name = standard_name(place->text());
      return now(name.empty() ? place->text() : name);
    }
    switch (jaw_of(scene_, bone_)) {
      case Jaw::upper:
        return now(upper_edge);
      case Jaw::lower:
        return now(lower_edge);
      case Jaw::chin:
        return now("pogonion_bone");
      case Jaw::other:
        break;
    }
    map_.itself().refuse(
        "turns a bone of which it is not known that it carries incisors or the chin; give pivot");
  }

  RigidMotion rotation() const {
    RigidMotion whole;
    if (const double angle = number("open"); angle != 0) {
      const Vec3 right = now("condyle_right_center"), left = now("condyle_left_center");
      whole = RigidMotion::rotation(left - right, (right + left) / 2, angle);
    }
    const double yaw = number("yaw"), roll = number("roll"), pitch = number("pitch");
    if (yaw == 0 && roll == 0 && pitch == 0) return whole;
    const Vec3 center = whole.apply(pivot());
    whole = RigidMotion::rotation(axes_.left, center, pitch).after(whole);
    whole = RigidMotion::rotation(-axes_.back, center, roll).after(whole);
    return RigidMotion::rotation(axes_.up, center, yaw).after(whole);
  }

  /// Where the edge of the other jaw's incisors is now. Refuses a `target` where the bone that
  /// carries it is unknown and may have moved, or moves along.
  Vec3 other_edge(const Value& target, const char* edge) const {
    if (const auto bone = carrying_bone(scene_, edge)) {
      if (std::find(bones_.begin(), bones_.end(), *bone) != bones_.end())
        target.refuse("cannot be reached by moving both jaws as one; move one of them");
      return scene_.moves[*bone].apply(recorded(edge));
    }
    for (std::size_t b = 0; b < scene_.bones.size(); ++b)
      if (b != bone_with_teeth_ && jaw_of(scene_, b) != Jaw::chin && !scene_.moves[b].is_identity())
        target.refuse(
            "needs to know whether '{}', which has moved, carries the landmark {}: cut jaws by a "
            "template or by planes, and call whole bones skull and mandible",
            scene_.bones[b].name, edge);
    return recorded(edge);
  }

  /// mm, the move along `direction` (a unit vector) that brings the distance of the upper incisors
  /// from the lower ones along it to `target`.
  double to_target(const char* name, const Vec3& direction, const RigidMotion& turned) const {
    const auto target = map_.find(name);
    const Jaw jaw = jaw_of(scene_, bone_with_teeth_);
    if (!has_incisors(jaw))
      target->refuse(
          "needs a jaw with incisors: a piece of le_fort_1, of sagittal_split or by planes, or a "
          "whole bone called maxilla or mandible");
    const bool upper = jaw == Jaw::upper;
    const Vec3 own = turned.apply(
        scene_.moves[bone_with_teeth_].apply(recorded(upper ? upper_edge : lower_edge)));
    const Vec3 fixed = other_edge(*target, upper ? lower_edge : upper_edge);
    const double distance = (upper ? own - fixed : fixed - own).dot(direction);
    return upper ? target->number() - distance : distance - target->number();
  }

  Vec3 translation(const RigidMotion& turned) const {
    exclude("overjet", {"advance", "set_back"});
    exclude("overbite", {"impaction", "lower"});
    double forward = number("advance") - number("set_back"),
           upward = number("impaction") - number("lower");
    if (map_.find("overjet")) forward = to_target("overjet", -axes_.back, turned);
    if (map_.find("overbite")) upward = -to_target("overbite", -axes_.up, turned);
    return -forward * axes_.back + upward * axes_.up + number("left") * axes_.left;
  }

  void exclude(const char* target, const std::vector<const char*>& others) const {
    if (!map_.find(target)) return;
    for (const char* other : others)
      if (const auto value = map_.find(other))
        value->refuse("and {} exclude each other; remove one of them", target);
  }

  Map map_;
  const Scene& scene_;
  const std::vector<std::size_t>& bones_;
  std::size_t bone_;  // carries pivot and condyles
  std::size_t bone_with_teeth_;
  HeadAxes axes_{};
};

}  // namespace

RigidMotion read_clinical_move(const Value& value, const Scene& scene,
                               const std::vector<std::size_t>& bones) {
  return ClinicalMove(value, scene, bones).read();
}

}  // namespace repose::scene
