#include "repose/results/additions.h"

#include <algorithm>

#include "reader.h"
#include "repose/base/error.h"
#include "repose/base/text.h"
#include "unfinished_file.h"
#include "writer.h"

namespace repose::results {
namespace {

/// Adds what `write` writes under a name, `bytes` of data, to a copy of the file, which then takes
/// its place.
template <class Write>
void add(const std::filesystem::path& file, const std::string& name, size_t bytes, Write&& write) {
  constexpr size_t of_format = 1 << 16;  // bytes, at most, beside data
  UnfinishedFile whole(file);
  whole.copy_file();
  whole.reserve(static_cast<int64_t>(bytes + of_format));
  base::Hdf5File h5 = base::open_hdf5(whole.part(), MPI_COMM_SELF);
  if (base::hdf5_has(h5, "/" + name)) return;
  write(h5);
  h5.close();
  whole.commit();
}

/// Strings of a data set have the length of the longest.
void add_rows(const std::filesystem::path& file, const std::vector<std::string>& rows) {
  size_t longest = 0;
  for (const std::string& row : rows) longest = std::max(longest, row.size() + 1);
  add(file, "summary", rows.size() * longest,
      [&](hid_t h5) { write_strings(h5, "summary", rows); });
}

}  // namespace

void add_given_skin(const std::filesystem::path& file, const GivenSkin& skin) {
  const size_t bytes = skin.points.size() * (2 * sizeof(Vec3) + sizeof(double)) +
                       skin.triangles.size() * sizeof(Triangle);
  add(file, "given_skin", bytes, [&](hid_t h5) {
    const base::Hdf5Group group = base::create_hdf5_group(h5, "given_skin");
    write_array(group, "points", skin.points);
    write_array(group, "triangles", skin.triangles);
    write_array(group, "displacement", skin.displacement);
    write_array(group, "solved", skin.solved);
  });
}

std::string add_summary(const std::filesystem::path& file, const std::string& text) {
  std::vector<std::string> rows;
  for (size_t position = 0; position < text.size();)
    rows.emplace_back(base::next_line(text, position));
  try {
    add_rows(file, rows);
  } catch (const base::InputError& error) {
    return fmt::format("{} (the result is whole, but without its summary)", error.what());
  }
  return "";
}

void copy_summary(const std::filesystem::path& from, const std::filesystem::path& file) {
  const Reader reader(from);
  if (!reader.has("/summary")) return;
  add_rows(file, reader.names("/summary"));
}

}  // namespace repose::results
