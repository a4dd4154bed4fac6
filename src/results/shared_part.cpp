#include "shared_part.h"

#include <algorithm>

#include "writer.h"

namespace repose::results {

namespace {

/// Makes HDF5's failures the user's.
template <class Work>
void with_file_name(const std::filesystem::path& file, Work&& work) {
  try {
    work();
  } catch (const base::Hdf5Error& reason) {
    base::refuse("{}: cannot be written: {}; free space or choose another -output", file.string(),
                 reason.what());
  }
}

}  // namespace

base::Slab SharedPart::slab(int64_t rows) const {
  return base::slab(rows, base::rank(comm_), base::size(comm_));
}

void SharedPart::create(const std::function<void(hid_t)>& work) {
  unfinished_.emplace(file_);
  part_ = unfinished_->part();
  with_file_name(file_, [&] {
    base::Hdf5File whole = base::create_hdf5(part_);
    work(whole);
    whole.close();
  });
}

void SharedPart::edit(const std::function<void(hid_t)>& work) const {
  with_file_name(file_, [&] {
    base::Hdf5File whole = base::open_hdf5(part_, MPI_COMM_SELF);
    work(whole);
    whole.close();
  });
}

void SharedPart::continue_in_copy() {
  if (unfinished_) return;
  unfinished_.emplace(file_);
  part_ = unfinished_->part();
  unfinished_->copy_file();
}

void SharedPart::open(int64_t bytes) {
  is_whole_ = false;
  base::on_root(comm_, [&] {
    continue_in_copy();
    if (bytes > 0) reserve(bytes);
  });
  base::broadcast(comm_, part_);
  on_disk([&] { h5_ = base::open_hdf5(part_, comm_); });
}

void SharedPart::close() {
  on_disk([&] { h5_.close(); });
  is_whole_ = true;
}

void SharedPart::on_disk(const std::function<void()>& work) const {
  base::collective_try(comm_, [&] { with_file_name(file_, work); });
}

base::Hdf5Group SharedPart::create_group(hid_t place, const std::string& group) const {
  base::Hdf5Group created;
  on_disk([&] { created = base::create_hdf5_group(place, group.c_str()); });
  return created;
}

void SharedPart::write_dataset(hid_t group, const char* dataset, std::array<int64_t, 2> shape,
                               const base::Slab& mine, std::span<const double> values) const {
  base::Hdf5Dataset created;
  on_disk([&] {
    if (std::ssize(values) != mine.rows() * std::max<int64_t>(shape[1], 1))
      throw base::InternalError(fmt::format("{}: values are not this rank's slab", dataset));
    created = create_rows(group, dataset, shape[0], shape[1]);
  });
  on_disk([&] { write_rows(comm_, created, mine, values.data()); });
}

void SharedPart::save() {
  std::filesystem::rename(part_, file_);
  unfinished_.reset();
}

void SharedPart::commit() { unfinished_->commit(); }

}  // namespace repose::results
