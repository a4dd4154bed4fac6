#include "readers.h"

#include "bone_names.h"
#include "clinical_move.h"
#include "repose/base/text.h"
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

/// Reads the forms of a move, of one bone or of several as one rigid body.
class Forms {
 public:
  Forms(const std::map<std::string, Vec3>& landmarks, std::vector<std::string>& remarks)
      : landmarks_(landmarks), remarks_(remarks) {}

  /// Returns the motion of an entry that follows the motion `before` of its first bone; `clinical`
  /// reads that form.
  template <class Clinical>
  RigidMotion read_entry(const Map& entry, const RigidMotion& before, const Clinical& clinical) {
    const std::string kind =
        entry.only({"translate", "rotate", "landmark", "transform", "clinical"}, several_advice);
    const Value form = entry.at(kind);
    if (kind == "translate") return read_translations(form);
    if (kind == "rotate") return read_rotations(form);
    if (kind == "landmark") return read_landmark(form, before);
    if (kind == "clinical") return clinical(form);
    const bool several = form.is_list() && !is_matrix(form);
    if (!several) return read_matrix_or_file(form);
    return in_order(form, form.items(), [&](const Value& one, const RigidMotion& so_far) {
      return read_item(one, so_far.after(before));
    });
  }

 private:
  /// Each of several by `read`, the first applied first.
  template <class Read>
  static RigidMotion in_order(const Value& list, const std::vector<Value>& several,
                              const Read& read) {
    if (several.empty()) list.refuse("is an empty list; give a form, or remove the entry");
    RigidMotion whole;
    for (const Value& one : several) whole = read(one, whole).after(whole);
    return whole;
  }

  static RigidMotion read_translation(const Value& value) {
    return RigidMotion::translation(value.vector());
  }

  static RigidMotion read_translations(const Value& value) {
    const std::vector<Value> parts = value.is_list() ? value.elements() : std::vector<Value>{};
    if (parts.empty() || !parts[0].is_list()) return read_translation(value);
    return in_order(value, parts, [](const Value& one, auto&) { return read_translation(one); });
  }

  static RigidMotion read_rotations(const Value& value) {
    if (!value.is_list()) return read_rotation(value);
    return in_order(value, value.elements(),
                    [](const Value& one, auto&) { return read_rotation(one); });
  }

  static RigidMotion read_matrix_or_file(const Value& value) {
    if (is_matrix(value)) return read_matrix(value);
    const std::filesystem::path file = value.file();
    return located(value, [&] { return read_transform(file); });
  }

  RigidMotion read_item(const Value& value, const RigidMotion& before) {
    if (!value.is_map()) return read_matrix_or_file(value);
    const Map map(value);
    const std::string kind = map.only({"translate", "rotate", "landmark"}, several_advice);
    const Value form = map.at(kind);
    if (kind == "translate") return read_translation(form);
    return kind == "rotate" ? read_rotation(form) : read_landmark(form, before);
  }

  RigidMotion read_landmark(const Value& value, const RigidMotion& before) {
    std::vector<Vec3> from, to;
    const std::vector<Value> pairs = value.is_list() ? value.elements() : std::vector{value};
    if (pairs.empty()) value.refuse("is an empty list; give a pair, or remove the entry");
    for (const Value& pair : pairs) {
      const Map map(pair);
      from.push_back(before.apply(read_place(map.at("from"))));
      to.push_back(read_place(map.at("to")));
    }
    return located(value, [&] {
      const RigidFit fit = fit_landmarks(from, to);
      if (fit.residual > residual_worth_saying)
        remarks_.push_back(
            fmt::format("{}: a rigid motion brings the landmarks within {:.2f} mm of their places",
                        value.place(), fit.residual));
      return fit.motion;
    });
  }

  Vec3 read_place(const Value& value) const {
    if (value.is_list()) return value.vector();
    const std::string name = value.text();
    if (const auto found = landmarks_.find(name); found != landmarks_.end()) return found->second;
    if (landmarks_.empty())
      value.refuse("names landmark {}, but the scene has none; give landmarks: FILE or [x, y, z]",
                   base::quote(name));
    std::vector<std::string> known;
    for (const auto& [other, position] : landmarks_) known.push_back(other);
    value.refuse("{} is no landmark of the scene; the nearest is '{}'", base::quote(name),
                 base::nearest(name, known));
  }

  static constexpr double residual_worth_saying = 0.05;  // mm
  static constexpr const char* several_advice =
      "; for several give several entries, or a list: transform: [{rotate: ...}, {translate: ...}]";
  const std::map<std::string, Vec3>& landmarks_;
  std::vector<std::string>& remarks_;
};

}  // namespace

void read_moves(const Value& list, const std::map<std::string, Vec3>& landmarks, Scene& scene) {
  scene.moves.assign(scene.bones.size(), {});
  Forms forms(landmarks, scene.remarks);
  for (const Value& item : list.items()) {
    const Map entry(item);
    std::vector<std::size_t> bones;
    for (const auto& [name, value] : entry.at("bone").texts())
      bones.push_back(find_bone(name, value, scene.bones));
    const RigidMotion motion =
        forms.read_entry(entry, scene.moves[bones.front()],
                         [&](const Value& form) { return read_clinical_move(form, scene, bones); });
    for (const std::size_t bone : bones) scene.moves[bone] = motion.after(scene.moves[bone]);
  }
}

}  // namespace repose::scene
