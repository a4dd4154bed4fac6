#include "repose/results/result_file.h"

#include <mutex>

#include "model_write.h"
#include "reader.h"
#include "repose/base/log.h"
#include "repose/base/program.h"
#include "repose/results/model_file.h"
#include "repose/results/run_files.h"
#include "step_writer.h"
#include "vtkhdf.h"

namespace repose::results {

namespace {

PetscLogEvent write_event() {
  static const PetscLogEvent event = base::log_event("RpWrite");
  return event;
}

/// Rank 0's numbers: attributes must be the same everywhere, and clocks are not.
model::StepNumbers of_first_rank(MPI_Comm comm, model::StepNumbers numbers) {
  model::for_each_number(numbers, [&](const char*, auto& value) { base::broadcast(comm, value); });
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

std::vector<NamedBone> name_bones(const model::Model& model) {
  std::vector<NamedBone> named;
  int64_t first = 0;
  for (size_t b = 0; b < model.bone_surfaces.size(); ++b) {
    const auto points = std::ssize(model.bone_surfaces[b].points);
    named.push_back({b < model.bones.size() ? model.bones[b] : fmt::format("bone {}", b), first,
                     points, std::ssize(model.bone_surfaces[b].triangles)});
    first += points;
  }
  return named;
}

FileCounts counts_of(const model::Model& model, const model::ModelRows& slabs,
                     const MergedBones& bones) {
  const model::Counts& of = slabs.counts;
  return {of.points,
          of.springs,
          of.prisms,
          std::ssize(model.skin),
          std::ssize(bones.points),
          std::ssize(bones.triangles),
          slabs.solid};
}

}  // namespace

struct ResultFile::State {
  std::filesystem::path name;
  SharedPart part;
  StepViews views;
  std::optional<StepWriter> writer;
  std::mutex mutex;           // rank 0: held while what save() takes changes
  bool savable = false;       // a result that is not committed
  bool save_pending = false;  // to be saved as soon as it holds a step
  bool provisional = false;   // the last of these steps is to be replaced
  bool marked = false;        // the last step reads as that of a run that ended there, …
  std::string reason;         // … and this is what it says otherwise

  // Absolute: MPI-IO takes what stands before a colon for the kind of file system.
  State(MPI_Comm comm, const std::filesystem::path& of)
      : name(std::filesystem::absolute(of)), part(comm, name.string() + ".h5") {}
  void create(const model::Model& model, const model::ModelRows& slabs, Kind kind);
  void settle_last();
  void mark_last(bool as_end);
  void append(const model::StepNumbers& numbers, const model::StepRows& rows,
              bool provisional_step);
  void copy_steps(const std::filesystem::path& earlier, int64_t count);
  bool save();
  void add_vtkhdf();
};

/// Creates the file with its model. Collective.
void ResultFile::State::create(const model::Model& model, const model::ModelRows& slabs,
                               Kind kind) {
  MergedBones bones;
  std::optional<model::PrescribedMotion> motion;
  base::on_root(part.comm(), [&] {
    bones = merge_bones(model.bone_surfaces);
    views = StepViews(counts_of(model, slabs, bones), name_bones(model));
    motion.emplace(model);
    part.create([&](hid_t file) {
      part.reserve(model_bytes(model, slabs, bones));
      write_model(file, model, slabs, bones);
      const base::Hdf5Group root(H5Gopen2(file, "/", H5P_DEFAULT));
      for (const auto& [name, text] : base::this_run(part.comm()))
        write_attribute(root, name.c_str(), text);
      if (kind == Kind::checkpoint) write_attribute(root, "checkpoint", int64_t{1});
      base::create_hdf5_group(file, "step");
    });
  });
  base::broadcast(part.comm(), views.counts());
  part.open();
  fill_model(part.comm(), part.id(), slabs, [this](const auto& work) { part.on_disk(work); });
  part.close();
  writer.emplace(part, views, slabs, std::move(bones), std::move(motion));
}

/// For readers that open the file itself. On rank 0.
void ResultFile::State::add_vtkhdf() {
  const std::vector<XdmfBlock> shown = views.principal_blocks();
  if (shown.empty() || views.loads().empty()) return;
  part.reserve(vtkhdf_bytes(shown, views.loads().size()));
  part.edit([&](hid_t file) { write_vtkhdf(file, shown, views.loads()); });
}

/// Takes away what the next step replaces, or lets the last step say that the path went on.
void ResultFile::State::settle_last() {
  if (marked) mark_last(false);
  if (provisional) {
    const std::string last = group_of(views.loads().size() - 1);
    part.on_disk([&] { base::check_hdf5(H5Ldelete(part.id(), last.c_str(), H5P_DEFAULT)); });
    views.remove_last();
  }
  provisional = false;
}

/// Lets the last step, a rest position at a load below 1, read as that of a run that ended there,
/// or as it is.
void ResultFile::State::mark_last(bool as_end) {
  const std::string last = group_of(views.loads().size() - 1);
  const base::Hdf5Group step(H5Gopen2(part.id(), last.c_str(), H5P_DEFAULT));
  part.on_disk([&] {
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
  const model::StepNumbers same = of_first_rank(part.comm(), numbers);
  part.open(writer->bytes(rows));
  settle_last();
  writer->write(same, rows);
  provisional = provisional_step;
  reason = same.reason;
  if (savable && same.converged && same.load < 1) mark_last(true);
  part.close();
  if (save_pending) save();
}

/// On rank 0, under the lock.
bool ResultFile::State::save() {
  save_pending = savable && part.is_unsaved() && views.loads().empty();
  if (!savable || !part.can_be_saved() || views.loads().empty()) return false;
  const auto documents = views.describe(name);
  part.save();
  for (const auto& document : documents) document->commit();
  return true;
}

/// On rank 0. Attributes are written again: HDF5 crashes where it copies strings of variable
/// length.
void ResultFile::State::copy_steps(const std::filesystem::path& earlier, int64_t count) {
  const Reader in(earlier);
  part.reserve(static_cast<int64_t>(std::filesystem::file_size(earlier)));
  part.edit([&](hid_t whole) {
    const base::Hdf5File source = base::open_hdf5(earlier);
    const base::Hdf5Properties without(H5Pcreate(H5P_OBJECT_COPY));
    base::check_hdf5(H5Pset_copy_object(without, H5O_COPY_WITHOUT_ATTR_FLAG));
    for (int64_t k = 0; k < count; ++k) {
      const std::string step = group_of(k);
      base::check_hdf5(H5Ocopy(source, step.c_str(), whole, step.c_str(), without, H5P_DEFAULT));
      const base::Hdf5Group copy(H5Gopen2(whole, step.c_str(), H5P_DEFAULT));
      const model::StepNumbers numbers = read_numbers(earlier, k);
      model::for_each_number(numbers, WriteAttribute{copy});
      views.add(in.number(step, "load"), in.has(step + "/bone_surface/points"));
      for (const auto& [field, vector] : optional_fields(whole, step + "/point"))
        views.note_field(field, vector, k);
    }
  });
}

ResultFile::ResultFile(MPI_Comm comm, const std::filesystem::path& name,
                       const model::Model& global_metadata, const model::ModelRows& slabs,
                       Kind kind)
    : state_(std::make_unique<State>(comm, name)) {
  state_->create(global_metadata, slabs, kind);
  state_->savable = kind == Kind::result;
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
  base::on_root(s.part.comm(), [&] { s.copy_steps(earlier, count); });
  std::vector<double> loads = s.views.loads();
  base::broadcast(s.part.comm(), loads);
  if (base::rank(s.part.comm()) > 0)
    for (const double load : loads) s.views.add(load, false);  // bones are rank 0's
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
  if (s.provisional) {
    s.part.open();
    s.settle_last();
    s.part.close();
  }
  s.savable = false;
  base::on_root(s.part.comm(), [&] {
    s.part.continue_in_copy();
    s.add_vtkhdf();
    const auto documents = s.views.describe(s.name);
    std::error_code absent;
    std::filesystem::remove(s.name.string() + given_skin_ending, absent);
    s.part.commit();
    for (const auto& document : documents) document->commit();
  });
}

}  // namespace repose::results
