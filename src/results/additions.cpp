#include "repose/results/additions.h"

#include "reader.h"
#include "repose/base/error.h"
#include "repose/base/text.h"
#include "unfinished_file.h"
#include "writer.h"

namespace repose::results {
namespace {

/// Adds what `write` writes under a name to a copy of the file, which then takes its place.
template <class Write>
void add(const std::filesystem::path& file, const std::string& name, Write&& write) {
  UnfinishedFile whole(file);
  std::error_code error;
  std::filesystem::copy_file(file, whole.part(), std::filesystem::copy_options::overwrite_existing,
                             error);
  if (error)
    base::refuse("{}: cannot be copied: {}; free space or choose another -output", file.string(),
                 error.message());
  base::Hdf5File h5 = base::open_hdf5(whole.part(), MPI_COMM_SELF);
  if (base::hdf5_has(h5, "/" + name)) return;
  write(h5);
  h5.close();
  whole.commit();
}

}  // namespace

void add_given_skin(const std::filesystem::path& file, const GivenSkin& skin) {
  add(file, "given_skin", [&](hid_t h5) {
    const base::Hdf5Group group = base::create_hdf5_group(h5, "given_skin");
    write_array(group, "points", skin.points);
    write_array(group, "triangles", skin.triangles);
    write_array(group, "displacement", skin.displacement);
    write_array(group, "solved", skin.solved);
  });
}

void add_summary(const std::filesystem::path& file, const std::string& text) {
  std::vector<std::string> rows;
  for (size_t position = 0; position < text.size();)
    rows.emplace_back(base::next_line(text, position));
  add(file, "summary", [&](hid_t h5) { write_strings(h5, "summary", rows); });
}

void copy_summary(const std::filesystem::path& from, const std::filesystem::path& file) {
  const Reader reader(from);
  if (!reader.has("/summary")) return;
  add(file, "summary", [&](hid_t h5) { write_strings(h5, "summary", reader.names("/summary")); });
}

}  // namespace repose::results
