#include "repose/results/result_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <optional>

#include "model_write.h"
#include "reader.h"
#include "repose/base/agreement.h"
#include "repose/base/hdf5.h"
#include "repose/base/log.h"
#include "repose/base/program.h"
#include "repose/results/model_file.h"
#include "repose/results/run_files.h"
#include "unfinished_file.h"
#include "views.h"
#include "vtkhdf.h"
#include "writer.h"

namespace repose::results {

namespace {

std::filesystem::path with_ending(const std::filesystem::path& name, const std::string& ending) {
  return name.string() + ending;
}

/// Makes HDF5's failures the user's: the disk is full, or gone.
template <class Work>
void with_file_name(const std::filesystem::path& file, Work&& work) {
  try {
    work();
  } catch (const base::Hdf5Error& reason) {
    base::refuse("{}: cannot be written: {}; free space or choose another -output", file.string(),
                 reason.what());
  }
}

std::string group_of(size_t step) { return fmt::format("step/{:04}", step); }

PetscLogEvent write_event() {
  static const PetscLogEvent event = base::log_event("RpWrite");
  return event;
}

struct PackNumbers {
  std::vector<double> values;
  std::string text;
  void operator()(const char*, const std::string& value) { text += value + '\0'; }
  template <class Number>
  void operator()(const char*, Number value) {
    values.push_back(static_cast<double>(value));
  }
};

struct UnpackNumbers {
  const PackNumbers& packed;
  size_t value = 0, character = 0;
  void operator()(const char*, std::string& text) {
    text = packed.text.c_str() + character;
    character += text.size() + 1;
  }
  template <class Number>
  void operator()(const char*, Number& number) {
    number = static_cast<Number>(packed.values[value++]);
  }
};

/// Rank 0's numbers: attributes must be the same everywhere, and clocks are not.
model::StepNumbers of_first_rank(MPI_Comm comm, const model::StepNumbers& mine) {
  PackNumbers packed;
  model::for_each_number(mine, packed);
  base::broadcast(comm, packed.text, packed.values);
  model::StepNumbers numbers;
  model::for_each_number(numbers, UnpackNumbers{packed});
  return numbers;
}

/// The arrays of a step's points that other steps may be without, and whether they are vectors.
std::vector<std::pair<std::string, bool>> optional_fields(hid_t file, const std::string& group) {
  const base::Hdf5Group points(H5Gopen2(file, group.c_str(), H5P_DEFAULT));
  H5G_info_t info;
  base::check_hdf5(H5Gget_info(points, &info));
  std::vector<std::pair<std::string, bool>> fields;
  for (hsize_t k = 0; k < info.nlinks; ++k) {
    std::array<char, 200> text = {};
    base::check_hdf5(H5Lget_name_by_idx(points, ".", H5_INDEX_NAME, H5_ITER_INC, k, text.data(),
                                        text.size(), H5P_DEFAULT));
    const std::string name = text.data();
    if (name == "position" || name == "displacement" || name == "residual_force") continue;
    const base::Hdf5Dataset dataset(H5Dopen2(points, name.c_str(), H5P_DEFAULT));
    const base::Hdf5Space space(H5Dget_space(dataset));
    fields.emplace_back(name, base::check_hdf5(H5Sget_simple_extent_ndims(space)) > 1);
  }
  return fields;
}

struct WriteAttribute {
  hid_t group;
  void operator()(const char* name, bool value) const {
    write_attribute(group, name, static_cast<int64_t>(value));
  }
  void operator()(const char* name, double value) const {
    if (!std::isnan(value) || !model::is_optional(name)) write_attribute(group, name, value);
  }
  template <class Choice>
  requires std::is_enum_v<Choice>
  void operator()(const char* name, const Choice& value) const {
    write_attribute(group, name, std::string(word(value)));
  }
  template <class Value>
  void operator()(const char* name, const Value& value) const {
    write_attribute(group, name, value);
  }
};

}  // namespace

struct ResultFile::State {
  MPI_Comm comm;
  std::filesystem::path name;
  std::mutex mutex;                          // rank 0: held while what save() takes changes
  std::optional<UnfinishedFile> unfinished;  // rank 0; none once it is saved
  base::Hdf5File file;                       // open while a step is written
  FileCounts counts;
  MergedBones bones;                              // rank 0
  std::vector<NamedBone> named_bones;             // rank 0
  std::optional<model::PrescribedMotion> motion;  // rank 0
  std::vector<Vec3> initial;                      // this rank's slab of point/position
  std::vector<Vec3> outward;                      // likewise, of the skin's normals
  std::vector<OptionalField> fields;
  std::vector<double> loads;  // of the steps written
  std::vector<bool> moved;    // whether they hold bone surfaces
  bool savable = false;       // a result that is not committed
  bool is_whole = false;      // the part is closed, and nothing has failed
  bool save_pending = false;  // to be saved as soon as it holds a step
  bool provisional = false;   // the last of these steps is to be replaced
  bool marked = false;        // the last step reads as that of a run that ended there, …
  std::string reason;         // … and this is what it says otherwise

  base::Slab slab(int64_t rows) const {
    return base::slab(rows, base::rank(comm), base::size(comm));
  }
  std::string part;  // the file that is written until commit
  /// Work on the open file that all ranks do, and all fail if one does.
  void on_disk(const std::function<void()>& work) const {
    base::collective_try(comm, [&] { with_file_name(with_ending(name, ".h5"), work); });
  }
  /// Enough for a step, its descriptions included.
  int64_t step_bytes() const {
    return (88 + 24 * static_cast<int64_t>(fields.size())) * counts.points + 16 * counts.springs +
           48 * counts.prisms + 48 * counts.bone_points + (int64_t{1} << 16);
  }
  void name_bones(const model::Model& model);
  void create(const model::Model& model, const model::ModelRows& slabs, Kind kind);
  void require_rows(const model::StepRows& rows) const;
  base::Hdf5Group create_group(hid_t place, const std::string& group) const;
  /// Creates a dataset and writes this rank's rows of it. Collective.
  void write_dataset(hid_t group, const char* dataset, std::array<int64_t, 2> shape,
                     const base::Slab& mine, const double* values) const;
  void write_points(hid_t step, const model::StepRows& rows);
  void write_field(hid_t group, const model::PointField& field);
  void write_elements(hid_t step, const model::StepRows& rows) const;
  bool write_bones(hid_t step, double load) const;
  void note_field(const std::string& field, bool vector, size_t step);
  void continue_in_copy();
  void open_part(int64_t room);
  void close_part();
  void settle_last();
  void write_step(const model::StepNumbers& numbers, const model::StepRows& rows);
  void mark_last(bool as_end);
  void append(const model::StepNumbers& numbers, const model::StepRows& rows,
              bool provisional_step);
  void copy_steps(const std::filesystem::path& earlier, int64_t count);
  bool save();
  std::vector<XdmfBlock> views_of_steps() const;
  std::vector<std::unique_ptr<UnfinishedFile>> describe() const;
  void add_vtkhdf(const std::vector<XdmfBlock>& blocks) const;
  void publish();
};

void ResultFile::State::name_bones(const model::Model& model) {
  int64_t first = 0;
  for (size_t b = 0; b < model.bone_surfaces.size(); ++b) {
    const auto points = static_cast<int64_t>(model.bone_surfaces[b].points.size());
    named_bones.push_back({b < model.bones.size() ? model.bones[b] : fmt::format("bone {}", b),
                           first, points,
                           static_cast<int64_t>(model.bone_surfaces[b].triangles.size())});
    first += points;
  }
}

void ResultFile::State::create(const model::Model& model, const model::ModelRows& slabs,
                               Kind kind) {
  unfinished.emplace(with_ending(name, ".h5"));
  part = unfinished->part();
  bones = merge_bones(model.bone_surfaces);
  name_bones(model);
  motion.emplace(model);
  with_file_name(unfinished->file(), [&] {
    base::Hdf5File whole = base::create_hdf5(part);
    unfinished->reserve(model_bytes(model, slabs, bones));
    write_model(whole, model, slabs, bones);
    const base::Hdf5Group root(H5Gopen2(whole, "/", H5P_DEFAULT));
    for (const auto& [name, text] : base::this_run(comm)) write_attribute(root, name.c_str(), text);
    if (kind == Kind::checkpoint) write_attribute(root, "checkpoint", int64_t{1});
    base::create_hdf5_group(whole, "step");
    whole.close();
  });
  const model::Counts& of = slabs.counts;
  counts = {of.points,
            of.springs,
            of.prisms,
            static_cast<int64_t>(model.skin.size()),
            static_cast<int64_t>(bones.points.size()),
            static_cast<int64_t>(bones.triangles.size()),
            slabs.solid,
            slabs.solid};
}

void ResultFile::State::require_rows(const model::StepRows& rows) const {
  const auto agrees = [this](size_t given, int64_t all) {
    return static_cast<int64_t>(given) == slab(all).rows();
  };
  if (!agrees(rows.position.size(), counts.points) ||
      !agrees(rows.residual_force.size(), counts.points) ||
      !agrees(rows.volume_ratio.size(), counts.prisms) ||
      !(rows.pressure.empty() || agrees(rows.pressure.size(), counts.prisms)) ||
      !(rows.discretization_error.empty() ||
        agrees(rows.discretization_error.size(), counts.points)) ||
      !std::all_of(rows.point_fields.begin(), rows.point_fields.end(),
                   [&](const model::PointField& field) {
                     return agrees(field.values.size() / (field.vector ? 3 : 1), counts.points);
                   }) ||
      (counts.stress && !agrees(rows.stretch.size(), counts.prisms)) ||
      !agrees(rows.elongation.size(), counts.springs) ||
      !agrees(rows.tension.size(), counts.springs))
    throw base::InternalError("a step's rows are not this rank's slab");
}

base::Hdf5Group ResultFile::State::create_group(hid_t place, const std::string& group) const {
  base::Hdf5Group created;
  on_disk([&] { created = base::create_hdf5_group(place, group.c_str()); });
  return created;
}

void ResultFile::State::write_dataset(hid_t group, const char* dataset,
                                      std::array<int64_t, 2> shape, const base::Slab& mine,
                                      const double* values) const {
  base::Hdf5Dataset created;
  on_disk([&] { created = create_rows(group, dataset, shape[0], shape[1]); });
  on_disk([&] { write_rows(comm, created, mine, values); });
}

/// A step has an array that others may be without.
void ResultFile::State::note_field(const std::string& field, bool vector, size_t step) {
  auto known = std::find_if(fields.begin(), fields.end(),
                            [&](const OptionalField& other) { return other.name == field; });
  if (known == fields.end()) known = fields.insert(known, {field, vector, {}});
  known->in_step.resize(step + 1);
  known->in_step.back() = true;
}

/// A dataset that other steps may be without.
void ResultFile::State::write_field(hid_t group, const model::PointField& field) {
  write_dataset(group, field.name.c_str(), {counts.points, field.vector ? 3 : 0},
                slab(counts.points), field.values.data());
  on_disk([&] {
    if (field.texts.empty() && field.flags.empty()) return;
    const base::Hdf5Dataset dataset(H5Dopen2(group, field.name.c_str(), H5P_DEFAULT));
    for (const auto& [name, text] : field.texts) write_attribute(dataset, name.c_str(), text);
    for (const auto& [name, flag] : field.flags)
      write_attribute(dataset, name.c_str(), static_cast<int64_t>(flag));
  });
  note_field(field.name, field.vector, loads.size());
}

void ResultFile::State::write_points(hid_t step, const model::StepRows& rows) {
  const base::Hdf5Group group = create_group(step, "point");
  const base::Slab mine = slab(counts.points);
  std::vector<Vec3> displacement(rows.position.size());
  for (size_t i = 0; i < displacement.size(); ++i) displacement[i] = rows.position[i] - initial[i];
  write_dataset(group, "position", {counts.points, 3}, mine, flat(rows.position));
  write_dataset(group, "displacement", {counts.points, 3}, mine, flat(displacement));
  write_dataset(group, "residual_force", {counts.points, 3}, mine, flat(rows.residual_force));
  model::PointField advance{"advance", false, std::vector<double>(displacement.size())};
  for (size_t i = 0; i < displacement.size(); ++i)
    advance.values[i] = displacement[i].dot(outward[i]);
  if (counts.skin > 0) write_field(group, advance);
  if (base::on_any_rank(comm, !rows.discretization_error.empty()))
    write_field(group, {"discretisation_error", false, rows.discretization_error});
  for (const model::PointField& field : rows.point_fields) write_field(group, field);
}

void ResultFile::State::write_elements(hid_t step, const model::StepRows& rows) const {
  const base::Hdf5Group prism = create_group(step, "prism");
  const base::Slab prisms = slab(counts.prisms);
  write_dataset(prism, "volume_ratio", {counts.prisms, 0}, prisms, rows.volume_ratio.data());
  if (counts.pressure)
    write_dataset(prism, "pressure", {counts.prisms, 0}, prisms, rows.pressure.data());
  if (counts.stress) {
    write_dataset(prism, "von_mises", {counts.prisms, 0}, prisms, rows.von_mises.data());
    write_dataset(prism, "principal_stretch", {counts.prisms, 3}, prisms, flat(rows.stretch));
  }
  if (counts.springs == 0) return;
  const base::Hdf5Group spring = create_group(step, "spring");
  const base::Slab springs = slab(counts.springs);
  write_dataset(spring, "elongation", {counts.springs, 0}, springs, rows.elongation.data());
  write_dataset(spring, "tension", {counts.springs, 0}, springs, rows.tension.data());
}

/// Writes the displacement of the bones and, if any has moved, where they are; returns whether any
/// has.
bool ResultFile::State::write_bones(hid_t step, double load) const {
  if (counts.bone_triangles == 0) return false;
  std::vector<Vec3> at_load;
  if (motion) at_load = moved_points(bones, *motion, load);
  bool moved = !at_load.empty();
  base::broadcast(comm, moved);
  const base::Hdf5Group group = create_group(step, "bone_surface");
  const base::Slab mine{0, static_cast<int64_t>(bones.points.size())};
  const std::vector<Vec3> displacement = displacements(bones, at_load);
  write_dataset(group, "displacement", {counts.bone_points, 3}, mine, flat(displacement));
  if (moved) write_dataset(group, "points", {counts.bone_points, 3}, mine, flat(at_load));
  return moved;
}

/// The first block with a cell and the bones, for readers that open the file itself.
void ResultFile::State::add_vtkhdf(const std::vector<XdmfBlock>& blocks) const {
  std::vector<XdmfBlock> shown;
  for (const XdmfBlock& block : blocks)
    if (block.cells > 0 && (shown.empty() || block.name == "bones")) shown.push_back(block);
  if (shown.empty() || loads.empty()) return;
  unfinished->reserve(vtkhdf_bytes(shown, loads.size()));
  with_file_name(unfinished->file(), [&] {
    base::Hdf5File whole = base::open_hdf5(part, MPI_COMM_SELF);
    write_vtkhdf(whole, shown, loads);
    whole.close();
  });
}

/// The XDMF files of the steps that there are, unfinished; one of an earlier run that would
/// describe nothing is removed.
std::vector<std::unique_ptr<UnfinishedFile>> ResultFile::State::describe() const {
  std::vector<std::unique_ptr<UnfinishedFile>> documents;
  const std::string h5 = name.filename().string() + ".h5";
  const auto describe_as = [&](const std::string& view, bool requested, const auto& shown) {
    const std::filesystem::path document = with_ending(name, view_ending(view));
    if (!requested) {
      std::error_code ignored;
      std::filesystem::remove(document, ignored);
      return;
    }
    documents.push_back(std::make_unique<UnfinishedFile>(document));
    documents.back()->write(xdmf_document(shown, h5, loads));
  };
  const std::vector<XdmfBlock> all = views_of_steps();
  for (const XdmfBlock& block : all) describe_as(block.name, block.cells > 0, block);
  const std::vector<XdmfBlock> named = named_blocks(all, named_bones);
  describe_as(named_view, named.size() > 1, named);
  return documents;
}

std::vector<XdmfBlock> ResultFile::State::views_of_steps() const {
  std::vector<OptionalField> of_steps = fields;
  for (OptionalField& field : of_steps) field.in_step.resize(loads.size());
  return views(counts, of_steps, moved);
}

void ResultFile::State::publish() {
  add_vtkhdf(views_of_steps());
  const auto documents = describe();
  unfinished->commit();
  for (const auto& document : documents) document->commit();
}

/// On rank 0: what was saved is not touched any more.
void ResultFile::State::continue_in_copy() {
  if (unfinished) return;
  unfinished.emplace(with_ending(name, ".h5"));
  part = unfinished->part();
  std::error_code error;
  std::filesystem::copy_file(unfinished->file(), part,
                             std::filesystem::copy_options::overwrite_existing, error);
  if (error)
    base::refuse("{}: cannot be written: {}; free space or choose another -output",
                 unfinished->file().string(), error.message());
}

void ResultFile::State::open_part(int64_t room) {
  is_whole = false;
  base::on_root(comm, [&] {
    continue_in_copy();
    if (room > 0) unfinished->reserve(room);
  });
  base::broadcast(comm, part);
  on_disk([&] { file = base::open_hdf5(part, comm); });
}

void ResultFile::State::close_part() {
  on_disk([&] { file.close(); });
  is_whole = true;
}

/// Takes away what the next step replaces, or lets the last step say that the path went on.
void ResultFile::State::settle_last() {
  if (marked) mark_last(false);
  if (provisional) {
    const std::string last = group_of(loads.size() - 1);
    on_disk([&] { base::check_hdf5(H5Ldelete(file, last.c_str(), H5P_DEFAULT)); });
    loads.pop_back();
    moved.pop_back();
    for (OptionalField& field : fields) field.in_step.resize(loads.size());
    std::erase_if(fields, [](const OptionalField& field) {
      return std::find(field.in_step.begin(), field.in_step.end(), true) == field.in_step.end();
    });
  }
  provisional = false;
}

void ResultFile::State::write_step(const model::StepNumbers& numbers, const model::StepRows& rows) {
  const base::Hdf5Group step = create_group(file, group_of(loads.size()));
  on_disk([&] { model::for_each_number(numbers, WriteAttribute{step}); });
  counts.pressure = counts.stress;
  write_points(step, rows);
  write_elements(step, rows);
  moved.push_back(write_bones(step, numbers.load));
  loads.push_back(numbers.load);
}

/// Returns whether the last step, a rest position at a load below 1, reads as that of a run that
/// ended there.
void ResultFile::State::mark_last(bool as_end) {
  const base::Hdf5Group step(H5Gopen2(file, group_of(loads.size() - 1).c_str(), H5P_DEFAULT));
  on_disk([&] {
    for (const char* name : {"converged", "reason"}) base::check_hdf5(H5Adelete(step, name));
    const WriteAttribute write{step};
    write("converged", !as_end);
    write("reason", as_end ? std::string(stopped_at_rest) : reason);
  });
  marked = as_end;
}

void ResultFile::State::append(const model::StepNumbers& numbers, const model::StepRows& rows,
                               bool provisional_step) {
  const std::scoped_lock lock(mutex);
  base::collective_try(comm, [&] { require_rows(rows); });
  const model::StepNumbers same = of_first_rank(comm, numbers);
  open_part(step_bytes());
  settle_last();
  write_step(same, rows);
  provisional = provisional_step;
  reason = same.reason;
  if (savable && same.converged && same.load < 1) mark_last(true);
  close_part();
  if (save_pending) save();
}

/// On rank 0, under the lock.
bool ResultFile::State::save() {
  save_pending = savable && unfinished && loads.empty();
  if (!savable || !is_whole || !unfinished || loads.empty()) return false;
  const auto documents = describe();
  std::filesystem::rename(part, unfinished->file());
  unfinished.reset();
  for (const auto& document : documents) document->commit();
  return true;
}

/// On rank 0. Attributes are written again: HDF5 crashes where it copies strings of variable
/// length.
void ResultFile::State::copy_steps(const std::filesystem::path& earlier, int64_t count) {
  const Reader in(earlier);
  unfinished->reserve(static_cast<int64_t>(std::filesystem::file_size(earlier)));
  with_file_name(unfinished->file(), [&] {
    const base::Hdf5File source = base::open_hdf5(earlier);
    base::Hdf5File whole = base::open_hdf5(part, MPI_COMM_SELF);
    const base::Hdf5Properties without(H5Pcreate(H5P_OBJECT_COPY));
    base::check_hdf5(H5Pset_copy_object(without, H5O_COPY_WITHOUT_ATTR_FLAG));
    for (int64_t k = 0; k < count; ++k) {
      const std::string step = group_of(k);
      base::check_hdf5(H5Ocopy(source, step.c_str(), whole, step.c_str(), without, H5P_DEFAULT));
      const base::Hdf5Group copy(H5Gopen2(whole, step.c_str(), H5P_DEFAULT));
      const model::StepNumbers numbers = read_numbers(earlier, k);
      model::for_each_number(numbers, WriteAttribute{copy});
      loads.push_back(in.number(step, "load"));
      moved.push_back(in.has(step + "/bone_surface/points"));
      for (const auto& [field, vector] : optional_fields(whole, step + "/point"))
        note_field(field, vector, k);
    }
    whole.close();
  });
}

ResultFile::ResultFile(MPI_Comm comm, const std::filesystem::path& name,
                       const model::Model& global_metadata, const model::ModelRows& slabs,
                       Kind kind)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.comm = comm;
  // Absolute: MPI-IO takes what stands before a colon for the kind of file system.
  s.name = std::filesystem::absolute(name);
  base::on_root(comm, [&] { s.create(global_metadata, slabs, kind); });
  base::broadcast(comm, s.part, s.counts);
  s.on_disk([&] { s.file = base::open_hdf5(s.part, comm); });
  fill_model(comm, s.file, slabs, [&s](const auto& work) { s.on_disk(work); });
  s.close_part();
  s.initial = slabs.points.position;
  s.outward = slabs.outward;
  s.savable = kind == Kind::result;
}

ResultFile::~ResultFile() = default;

void ResultFile::append(const model::StepNumbers& numbers, const model::StepRows& rows) {
  const base::Logged logged(write_event());
  state_->append(numbers, rows, false);
}

void ResultFile::append_provisional(const model::StepNumbers& numbers,
                                    const model::StepRows& rows) {
  const base::Logged logged(write_event());
  state_->append(numbers, rows, true);
}

void ResultFile::keep(const std::filesystem::path& earlier, int64_t count) {
  State& s = *state_;
  const std::scoped_lock lock(s.mutex);
  base::on_root(s.comm, [&] { s.copy_steps(earlier, count); });
  base::broadcast(s.comm, s.loads);
  s.moved.resize(count);
}

bool ResultFile::save() noexcept {
  State& s = *state_;
  try {
    const std::scoped_lock lock(s.mutex);
    return s.save();
  } catch (const std::exception&) {
    return false;
  }
}

void ResultFile::commit() {
  const base::Logged logged(write_event());
  State& s = *state_;
  const std::scoped_lock lock(s.mutex);
  if (s.provisional || s.marked) {
    s.open_part(0);
    s.settle_last();
    s.close_part();
  }
  s.savable = false;
  base::on_root(s.comm, [&] {
    s.continue_in_copy();
    s.publish();
  });
}

}  // namespace repose::results
