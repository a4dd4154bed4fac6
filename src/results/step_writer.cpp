#include "step_writer.h"

#include <cmath>

namespace repose::results {

namespace {

std::span<const double> numbers_of(const std::vector<Vec3>& vectors) {
  return {flat(vectors), 3 * vectors.size()};
}

}  // namespace

std::string group_of(size_t step) { return fmt::format("step/{:04}", step); }

void WriteAttribute::operator()(const char* name, double value) const {
  if (!std::isnan(value) || !model::is_optional(name)) write_attribute(group, name, value);
}

StepWriter::StepWriter(const SharedPart& part, StepViews& views, const model::ModelRows& slabs,
                       MergedBones bones, std::optional<model::PrescribedMotion> motion)
    : part_(part),
      views_(views),
      bones_(std::move(bones)),
      motion_(std::move(motion)),
      initial_(slabs.points.position),
      outward_(slabs.outward) {}

int64_t StepWriter::bytes(const model::StepRows& rows) const {
  const FileCounts& counts = views_.counts();
  int64_t point = 3 * 24 + 2 * 8;
  for (const model::PointField& field : rows.point_fields) point += field.vector ? 24 : 8;
  const auto descriptions = static_cast<int64_t>(64 + rows.point_fields.size()) << 10;
  return point * counts.points + 16 * counts.springs + 48 * counts.prisms +
         48 * counts.bone_points + descriptions;
}

void StepWriter::write_field(hid_t group, const model::PointField& field) {
  const FileCounts& counts = views_.counts();
  part_.write_dataset(group, field.name.c_str(), {counts.points, field.vector ? 3 : 0},
                      part_.slab(counts.points), field.values);
  part_.on_disk([&] {
    if (field.texts.empty() && field.flags.empty()) return;
    const base::Hdf5Dataset dataset(H5Dopen2(group, field.name.c_str(), H5P_DEFAULT));
    for (const auto& [name, text] : field.texts) write_attribute(dataset, name.c_str(), text);
    for (const auto& [name, flag] : field.flags)
      write_attribute(dataset, name.c_str(), static_cast<int64_t>(flag));
  });
  views_.note_field(field.name, field.vector, views_.loads().size());
}

void StepWriter::write_points(hid_t step, const model::StepRows& rows) {
  const FileCounts& counts = views_.counts();
  const base::Hdf5Group group = part_.create_group(step, "point");
  const base::Slab mine = part_.slab(counts.points);
  part_.write_dataset(group, "position", {counts.points, 3}, mine, numbers_of(rows.position));
  std::vector<Vec3> displacement(rows.position.size());
  for (size_t i = 0; i < displacement.size(); ++i) displacement[i] = rows.position[i] - initial_[i];
  part_.write_dataset(group, "displacement", {counts.points, 3}, mine, numbers_of(displacement));
  part_.write_dataset(group, "residual_force", {counts.points, 3}, mine,
                      numbers_of(rows.residual_force));
  model::PointField advance{"advance", false, std::vector<double>(displacement.size())};
  for (size_t i = 0; i < displacement.size(); ++i)
    advance.values[i] = displacement[i].dot(outward_[i]);
  if (counts.skin > 0) write_field(group, advance);
  if (base::on_any_rank(part_.comm(), !rows.discretization_error.empty()))
    write_field(group, {"discretisation_error", false, rows.discretization_error});
  for (const model::PointField& field : rows.point_fields) write_field(group, field);
}

void StepWriter::write_elements(hid_t step, const model::StepRows& rows) const {
  const FileCounts& counts = views_.counts();
  const base::Hdf5Group prism = part_.create_group(step, "prism");
  const base::Slab prisms = part_.slab(counts.prisms);
  part_.write_dataset(prism, "volume_ratio", {counts.prisms, 0}, prisms, rows.volume_ratio);
  if (counts.solid) {
    part_.write_dataset(prism, "pressure", {counts.prisms, 0}, prisms, rows.pressure);
    part_.write_dataset(prism, "von_mises", {counts.prisms, 0}, prisms, rows.von_mises);
    part_.write_dataset(prism, "principal_stretch", {counts.prisms, 3}, prisms,
                        numbers_of(rows.stretch));
  }
  if (counts.springs == 0) return;
  const base::Hdf5Group spring = part_.create_group(step, "spring");
  const base::Slab springs = part_.slab(counts.springs);
  part_.write_dataset(spring, "elongation", {counts.springs, 0}, springs, rows.elongation);
  part_.write_dataset(spring, "tension", {counts.springs, 0}, springs, rows.tension);
}

/// Writes the displacement of the bones and, if any has moved, where they are; returns whether any
/// has.
bool StepWriter::write_bones(hid_t step, double load) const {
  const FileCounts& counts = views_.counts();
  if (counts.bone_triangles == 0) return false;
  std::vector<Vec3> at_load;
  if (motion_) at_load = moved_points(bones_, *motion_, load);
  bool moved = !at_load.empty();
  base::broadcast(part_.comm(), moved);
  const base::Hdf5Group group = part_.create_group(step, "bone_surface");
  const base::Slab mine{0, std::ssize(bones_.points)};
  const std::vector<Vec3> displacement = displacements(bones_, at_load);
  part_.write_dataset(group, "displacement", {counts.bone_points, 3}, mine,
                      numbers_of(displacement));
  if (moved)
    part_.write_dataset(group, "points", {counts.bone_points, 3}, mine, numbers_of(at_load));
  return moved;
}

void StepWriter::write(const model::StepNumbers& numbers, const model::StepRows& rows) {
  const base::Hdf5Group step = part_.create_group(part_.id(), group_of(views_.loads().size()));
  part_.on_disk([&] { model::for_each_number(numbers, WriteAttribute{step}); });
  write_points(step, rows);
  write_elements(step, rows);
  views_.add(numbers.load, write_bones(step, numbers.load));
}

}  // namespace repose::results
