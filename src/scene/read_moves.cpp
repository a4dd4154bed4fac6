#include "read_moves.h"

#include <algorithm>

#include "repose/base/nearest.h"
#include "repose/scene/transform_file.h"

namespace repose::scene {

namespace {

/// Puts the place in front of what a motion or a transform file refuses.
template <class Make>
RigidMotion located(const Value& place, const Make& make) {
  try {
    return make();
  } catch (const base::InputError& error) {
    place.refuse("is refused: {}", error.what());
  }
}

RigidMotion read_rotation(const Value& value) {
  const Map map(value);
  const Vec3 axis = map.at("axis").vector(), center = map.at("center").vector();
  const double angle = map.at("angle").number();
  return located(map.at("axis"), [&] { return RigidMotion::rotation(axis, center, angle); });
}

/// Four rows of four numbers.
bool is_matrix(const Value& value) {
  if (!value.is_list()) return false;
  const std::vector<Value> rows = value.elements();
  if (rows.empty() || !rows[0].is_list()) return false;
  const std::vector<Value> first = rows[0].elements();
  return first.empty() || !first[0].is_list();
}

RigidMotion read_matrix(const Value& value) {
  const std::vector<Value> rows = value.elements();
  if (rows.size() != 4) value.refuse("must be a 4×4 matrix, it has {} rows", rows.size());
  Mat4 matrix;
  for (int i = 0; i < 4; ++i) {
    if (!rows[i].is_list()) rows[i].refuse("must be a row of four numbers");
    const std::vector<double> row = rows[i].numbers();
    if (row.size() != 4) rows[i].refuse("must be a row of four numbers, it has {}", row.size());
    matrix.row(i) = Eigen::Map<const Eigen::RowVector4d>(row.data());
  }
  return located(value, [&] { return RigidMotion::from_matrix(matrix); });
}

/// Each of several by `read`, the first applied first.
template <class Read>
RigidMotion in_order(const Value& list, const std::vector<Value>& several, const Read& read) {
  if (several.empty()) list.refuse("is an empty list; give a form, or remove the entry");
  RigidMotion whole;
  for (const Value& one : several) whole = read(one).after(whole);
  return whole;
}

RigidMotion read_translation(const Value& value) {
  return RigidMotion::translation(value.vector());
}

RigidMotion read_matrix_or_file(const Value& value) {
  if (is_matrix(value)) return read_matrix(value);
  const std::filesystem::path file = value.file();
  return located(value, [&] { return read_transform(file); });
}

RigidMotion read_transform_item(const Value& value) {
  if (!value.is_map()) return read_matrix_or_file(value);
  const Map map(value);
  const auto translate = map.find("translate"), rotate = map.find("rotate");
  if (translate.has_value() == rotate.has_value())
    value.refuse("must hold one form, translate or rotate; give each its own item of the list");
  return translate ? read_translation(*translate) : read_rotation(*rotate);
}

RigidMotion read_translations(const Value& value) {
  const std::vector<Value> parts = value.is_list() ? value.elements() : std::vector<Value>{};
  const bool several = !parts.empty() && parts[0].is_list();
  return several ? in_order(value, parts, read_translation) : read_translation(value);
}

RigidMotion read_rotations(const Value& value) {
  return value.is_list() ? in_order(value, value.elements(), read_rotation) : read_rotation(value);
}

RigidMotion read_transforms(const Value& value) {
  const bool several = value.is_list() && !is_matrix(value);
  return several ? in_order(value, value.items(), read_transform_item) : read_matrix_or_file(value);
}

RigidMotion read_entry(const Map& entry) {
  const auto translate = entry.find("translate"), rotate = entry.find("rotate"),
             transform = entry.find("transform");
  if (translate.has_value() + rotate.has_value() + transform.has_value() != 1)
    entry.itself().refuse(
        "must hold exactly one of translate, rotate, transform; for several give several entries, "
        "or a list: transform: [{{rotate: ...}}, {{translate: ...}}]");
  if (translate) return read_translations(*translate);
  return rotate ? read_rotations(*rotate) : read_transforms(*transform);
}

std::size_t find_bone(const Value& value, const std::vector<BoneEntry>& bones) {
  const std::string name = value.text();
  const auto found = std::find_if(bones.begin(), bones.end(),
                                  [&](const BoneEntry& bone) { return bone.name == name; });
  if (found != bones.end()) return static_cast<std::size_t>(found - bones.begin());
  if (bones.empty()) value.refuse("{} is no bone; the scene has none", base::shown(name));
  std::vector<std::string> names;
  for (const BoneEntry& bone : bones) names.push_back(bone.name);
  value.refuse("{} is no bone of the scene; the nearest is '{}'", base::shown(name),
               base::nearest(name, names));
}

}  // namespace

std::vector<RigidMotion> read_moves(const Value& moves, const std::vector<BoneEntry>& bones) {
  std::vector<RigidMotion> whole(bones.size());
  for (const Value& item : moves.items()) {
    const Map entry(item);
    RigidMotion& motion = whole[find_bone(entry.at("bone"), bones)];
    motion = read_entry(entry).after(motion);
  }
  return whole;
}

}  // namespace repose::scene
