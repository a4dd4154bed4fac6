#include "repose/results/model_file.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "reader.h"

namespace repose::results {

namespace {

void require_format(const Reader& in) {
  const std::string format = in.text("/", "format");
  if (format != "tissue-model")
    in.refuse("/ attribute format", "is \"{}\", expected \"tissue-model\"", format);
  const int64_t version = in.integer("/", "version");
  if (version != 1)
    in.refuse("/ attribute version", "is {}, this program reads version 1", version);
}

/// Reads the arrays of a group, but for the sides of cuts all of as many rows as the first. The
/// `optional` ones may be absent.
template <class Group>
void read_arrays(const Reader& in, const std::string& group, Group& of,
                 std::initializer_list<std::string_view> optional = {}) {
  int64_t rows = Shape::any;
  model::for_each_array(of, [&](const char* name, auto& values) {
    const std::string path = fmt::format("{}/{}", group, name);
    const bool may_lack = std::find(optional.begin(), optional.end(), name) != optional.end();
    if (may_lack && !in.has(path)) return;
    in.read(path, rows, values);
    if constexpr (!std::is_same_v<Group, model::CutFaces>) rows = in.rows(path);
  });
}

model::Points read_points(const Reader& in) {
  model::Points points;
  read_arrays(in, "/model/point", points, {"mass", "external_force"});
  points.mass.resize(points.position.size());
  points.external_force.resize(points.position.size(), Vec3::Zero());
  return points;
}

model::Prisms read_prisms(const Reader& in) {
  model::Prisms prisms;
  if (!in.has("/model/prism")) return prisms;
  const bool solid = in.has("/model/edge");
  // Arrays of one row stand for those that the file has.
  prisms.modulus.resize(solid);
  prisms.nodal_modulus.resize(solid && in.has("/model/prism/nodal_modulus"));
  read_arrays(in, "/model/prism", prisms);
  return prisms;
}

std::vector<model::TermElements> read_elements(const Reader& in) {
  std::vector<model::TermElements> all;
  if (!in.has("/model/element")) return all;
  for (int64_t k = 0; k < in.links("/model/element"); ++k) {
    const std::string group = fmt::format("/model/element/{}", k);
    model::TermElements& of = all.emplace_back();
    of.term = in.text(group, "term");
    of.points_each = in.integer(group, "points_each");
    of.numbers_each = in.integer(group, "numbers_each");
    if (in.has_attribute(group, "bone_number")) of.bone_number = in.integer(group, "bone_number");
    of.points = in.integers<int64_t>(group + "/points", Shape::any);
    of.numbers = in.numbers(group + "/numbers", {Shape::any, {}});
  }
  return all;
}

constexpr int8_t bone_kind = 0, mesh_kind = 5;

void require_kind(const Reader& in, int64_t k, int8_t kind, int32_t bone) {
  if (kind < bone_kind || kind > mesh_kind)
    in.refuse("/model/contact/body_kind", "row {} is {}, expected {} to {}", k, kind, bone_kind,
              mesh_kind);
  if ((kind == bone_kind) != (bone >= 0))
    in.refuse("/model/contact/body_kind",
              "row {} is {}, but body_bone is {}; a body of kind 0 names its bone, "
              "another has -1",
              k, kind, bone);
}

model::Body::Shape read_shape(const Reader& in, int64_t k, int8_t kind, const double* of) {
  const auto vector = [&](int first) { return Vec3(of[first], of[first + 1], of[first + 2]); };
  if (kind == 1) return scene::Sphere{vector(0), of[3]};
  if (kind == 2) return scene::Capsule{vector(0), vector(3), of[6]};
  if (kind == 3) return scene::Box{vector(0), vector(3)};
  if (kind == 4) return scene::HalfSpace{vector(0), vector(3)};
  surface::Surface mesh;
  if (kind == bone_kind) return mesh;
  const std::string group = fmt::format("/model/contact/body_mesh/{}", k);
  mesh.name = group;
  mesh.points = in.vectors(group + "/points", Shape::any);
  mesh.triangles = in.tuples<3>(group + "/triangles", Shape::any);
  return mesh;
}

model::Contact read_contact(const Reader& in) {
  const std::string group = "/model/contact";
  model::Contact contact;
  contact.stiffness = in.number(group, "stiffness");
  contact.spacing = in.number(group, "grid");
  const std::vector<std::string> names = in.names(group + "/body");
  const auto bodies = std::ssize(names);
  const auto bone = in.integers<int32_t>(group + "/body_bone", bodies);
  const auto kind = in.integers<int8_t>(group + "/body_kind", bodies);
  const auto push = in.vectors(group + "/body_push", bodies);
  const auto shape = in.numbers(group + "/body_shape", {bodies, {model::shape_numbers}});
  for (int64_t k = 0; k < bodies; ++k) {
    require_kind(in, k, kind[k], bone[k]);
    contact.bodies.push_back({names[k], bone[k],
                              read_shape(in, k, kind[k], shape.data() + model::shape_numbers * k),
                              push[k]});
  }
  read_arrays(in, group, contact.pairs);
  if (in.has(group + "/wall")) read_arrays(in, group + "/wall", contact.cut_faces);
  return contact;
}

model::AdhesionRule read_adhesion(const Reader& in) {
  const std::string group = "/model/adhesion";
  model::AdhesionRule rule;
  rule.tension = in.number(group, "tension");
  rule.range = in.number(group, "range");
  const std::vector<Vec3> axes = in.vectors(group + "/axes", 3);
  for (int k = 0; k < 3; ++k) rule.axes.row(k) = axes[k];
  const std::vector<Vec3> line = in.vectors(group + "/lip_line", 3);
  std::ranges::copy(line, rule.lip_line.begin());
  const auto bone = in.integers<int32_t>(group + "/bone", Shape::any);
  const auto jaws = std::ssize(bone);
  const auto upper = in.integers<int8_t>(group + "/upper", jaws);
  const auto box = in.numbers(group + "/box", {jaws, {6}});
  const auto reach = in.numbers(group + "/reach", {jaws, {}});
  for (int64_t k = 0; k < jaws; ++k)
    if (upper[k] != 0 && upper[k] != 1)
      in.refuse(group + "/upper", "row {} is {}, expected 0 or 1", k, upper[k]);
  for (int64_t k = 0; k < jaws; ++k)
    rule.jaws.push_back({bone[k], upper[k] != 0, Vec3::Map(box.data() + 6 * k),
                         Vec3::Map(box.data() + 6 * k + 3), reach[k]});
  rule.cut_columns = in.integers<int64_t>(group + "/cut_column", Shape::any);
  return rule;
}

std::vector<Mat4> read_transforms(const Reader& in, int64_t bones) {
  const std::vector<double> flat = in.numbers("/model/bone_transform", {bones, {4, 4}});
  std::vector<Mat4> transforms(bones);
  for (int64_t b = 0; b < bones; ++b)
    transforms[b] = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>::Map(flat.data() + 16 * b);
  return transforms;
}

std::vector<surface::Surface> read_bone_surfaces(const Reader& in,
                                                 const std::vector<std::string>& bones) {
  std::vector<surface::Surface> surfaces(bones.size());
  for (size_t b = 0; b < bones.size(); ++b) {
    surfaces[b].name = bones[b];
    const std::string group = fmt::format("/model/bone_surface/{}", b);
    if (!in.has(group)) continue;
    surfaces[b].points = in.vectors(group + "/points", Shape::any);
    surfaces[b].triangles = in.tuples<3>(group + "/triangles", Shape::any);
  }
  return surfaces;
}

/// Reads points, springs, prisms and edges.
void read_rows(const Reader& in, model::Model& model) {
  model.points = read_points(in);
  if (in.has("/model/spring")) read_arrays(in, "/model/spring", model.springs);
  model.prisms = read_prisms(in);
  if (in.has("/model/edge")) read_arrays(in, "/model/edge", model.edges);
}

/// Reads all else but gravity.
void read_metadata(const Reader& in, model::Model& model) {
  model.elements = read_elements(in);
  if (in.has("/model/spring") || in.has("/model/spring_set"))
    model.spring_sets = in.names("/model/spring_set");
  if (in.has("/model/skin/points")) model.skin = in.tuples<3>("/model/skin/points", Shape::any);
  if (in.has("/model/bone")) model.bones = in.names("/model/bone");
  if (in.has("/model/bone_transform"))
    model.bone_transform = read_transforms(in, std::ssize(model.bones));
  if (in.has("/model/bone_surface")) model.bone_surfaces = read_bone_surfaces(in, model.bones);
  if (in.has("/model/adhesion")) model.adhesion = read_adhesion(in);
  if (in.has("/model/contact")) model.contact = read_contact(in);
}

}  // namespace

model::Model read_model_rows(const std::filesystem::path& file, int rank, int ranks) {
  if (!std::filesystem::is_directory(file) && std::filesystem::exists(file) && !base::is_hdf5(file))
    base::refuse("{}: is not an HDF5 file; give a model or result file (.h5)", file.string());
  const Reader in(file), slabs(file, rank, ranks);
  require_format(in);
  model::Model model;
  model.gravity = in.vector("/model", "gravity");
  read_rows(slabs, model);
  if (rank == 0) read_metadata(in, model);
  return model;
}

model::Model read_model(const std::filesystem::path& file) {
  model::Model model = read_model_rows(file, 0, 1);
  model::validate(model, file.string());
  return model;
}

bool is_checkpoint(const std::filesystem::path& file) {
  const Reader in(file);
  return in.has_attribute("/", "checkpoint") && in.integer("/", "checkpoint") != 0;
}

int64_t step_count(const std::filesystem::path& file) {
  const Reader in(file);
  if (!in.has("/step")) return 0;
  const int64_t count = in.links("/step");
  for (int64_t step = 0; step < count; ++step)
    if (!in.has(fmt::format("/step/{:04}", step)))
      in.refuse("/step", "has {} groups, but {:04} is missing", count, step);
  return count;
}

std::optional<double> last_bulk_modulus(const std::filesystem::path& file) {
  const int64_t steps = step_count(file);
  const std::string group = fmt::format("/step/{:04}", steps - 1);
  const Reader in(file);
  if (steps == 0 || !in.has_attribute(group, "bulk_modulus")) return {};
  const double stored = in.number(group, "bulk_modulus");
  return stored > 0 ? std::optional(stored) : std::nullopt;
}

namespace {

struct ReadAttribute {
  const Reader& in;
  const std::string& group;
  void operator()(const char* name, double& value) const {
    if (model::is_optional(name) && !in.has_attribute(group, name)) return;
    const bool maybe_infinite = std::string_view(name) == "displacement_error";  // at no minimum
    value = maybe_infinite ? in.number_or_infinity(group, name) : in.number(group, name);
  }
  void operator()(const char* name, int64_t& value) const { value = in.integer(group, name); }
  void operator()(const char* name, std::string& value) const { value = in.text(group, name); }
  template <class Choice>
  requires std::is_enum_v<Choice>
  void operator()(const char* name, Choice& value) const {
    const auto known = words(value);
    const std::string text = in.text(group, name);
    const auto found = std::find(known.begin(), known.end(), text);
    if (found == known.end())
      in.refuse(fmt::format("{} attribute {}", group, name), "is \"{}\", expected one of {}", text,
                fmt::join(known, ", "));
    value = static_cast<Choice>(found - known.begin());
  }
  void operator()(const char* name, bool& value) const { value = in.integer(group, name) != 0; }
};

std::string require_step(const Reader& in, int64_t step) {
  const std::string group = fmt::format("/step/{:04}", step);
  if (!in.has(group)) in.refuse(group, "is missing");
  return group;
}

}  // namespace

model::StepNumbers read_numbers(const std::filesystem::path& file, int64_t step) {
  const Reader in(file);
  const std::string group = require_step(in, step);
  model::StepNumbers numbers;
  model::for_each_number(numbers, ReadAttribute{in, group});
  return numbers;
}

StoredStep read_step(const std::filesystem::path& file, int64_t step, const model::Model& model) {
  const Reader in(file);
  const std::string group = require_step(in, step);
  const model::Counts counts = model::count(model);
  StoredStep stored;
  stored.numbers = read_numbers(file, step);
  const auto read = [&](const char* name, int64_t rows, auto& values) {
    in.read(group + name, rows, values);
  };
  const auto read_if_there = [&](const char* name, int64_t rows, auto& values) {
    if (in.has(group + name)) read(name, rows, values);
  };
  model::StepRows& rows = stored.rows;
  read("/point/position", counts.points, rows.position);
  read("/point/displacement", counts.points, stored.displacement);
  read("/point/residual_force", counts.points, rows.residual_force);
  if (!model.skin.empty()) read("/point/advance", counts.points, stored.advance);
  for (const std::string name : {"contact_gap", "contact_pressure"})
    if (const std::string path = group + "/point/" + name; in.has(path))
      rows.point_fields.push_back({name, false, in.numbers(path, {counts.points, {}})});
  if (const std::string path = group + "/point/contact_force"; in.has(path))
    rows.point_fields.push_back({"contact_force", true, in.numbers(path, {counts.points, {3}})});
  if (in.has(group + "/spring") || counts.springs > 0) {
    read("/spring/elongation", counts.springs, rows.elongation);
    read("/spring/tension", counts.springs, rows.tension);
  }
  if (in.has(group + "/prism/volume_ratio") || counts.prisms > 0)
    read("/prism/volume_ratio", counts.prisms, rows.volume_ratio);
  read_if_there("/prism/pressure", counts.prisms, rows.pressure);
  read_if_there("/prism/von_mises", counts.prisms, rows.von_mises);
  if (!rows.von_mises.empty()) read("/prism/principal_stretch", counts.prisms, rows.stretch);
  read_if_there("/bone_surface/points", Shape::any, stored.bone_points);
  read_if_there("/bone_surface/displacement", Shape::any, stored.bone_displacement);
  return stored;
}

}  // namespace repose::results
