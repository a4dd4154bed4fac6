#pragma once
#include <array>
#include <functional>
#include <optional>
#include <span>

#include "repose/base/agreement.h"
#include "repose/base/hdf5.h"
#include "unfinished_file.h"

namespace repose::results {

/// The unfinished part of an HDF5 file that all ranks write. Between two calls of open() it is
/// closed, complete and readable. Once it has the file's name, what is written goes to a copy.
/// Failures are an InputError on all ranks that names the file: the disk is full, or gone.
class SharedPart {
 public:
  /// `file` is absolute: MPI-IO takes what stands before a colon for the kind of file system.
  SharedPart(MPI_Comm comm, std::filesystem::path file) : comm_(comm), file_(std::move(file)) {}

  MPI_Comm comm() const { return comm_; }
  /// This rank's slab of so many rows.
  base::Slab slab(int64_t rows) const;

  /// Creates the part, or opens it, for work of rank 0 alone. Not collective.
  void create(const std::function<void(hid_t)>& work);
  void edit(const std::function<void(hid_t)>& work) const;
  /// Sets aside room on the disk for `bytes` more. On rank 0.
  void reserve(int64_t bytes) const { unfinished_->reserve(bytes); }

  /// Opens the part on all ranks, with room for `bytes` more. Collective.
  void open(int64_t bytes = 0);
  void close();
  hid_t id() const { return h5_; }  ///< while it is open
  /// Work on the open part that all ranks do, and all fail if one does.
  void on_disk(const std::function<void()>& work) const;
  base::Hdf5Group create_group(hid_t place, const std::string& group) const;
  /// Creates a dataset and writes this rank's rows of it; InternalError where `values` are not
  /// these. Collective.
  void write_dataset(hid_t group, const char* dataset, std::array<int64_t, 2> shape,
                     const base::Slab& mine, std::span<const double> values) const;

  /// Goes on in a copy if the part is saved: what has the file's name is not touched any more.
  void continue_in_copy();
  bool is_unsaved() const { return unfinished_.has_value(); }  ///< it has no name yet; on rank 0
  /// Returns whether it is unsaved, closed and has not failed. On rank 0.
  bool can_be_saved() const { return is_whole_ && unfinished_; }
  /// Gives the closed part the file's name at once, or makes it last on the disk first. On rank 0.
  void save();
  void commit();

 private:
  MPI_Comm comm_;
  std::filesystem::path file_;
  std::optional<UnfinishedFile> unfinished_;  // rank 0; none once it is saved
  std::string part_;                          // its path, on all ranks
  base::Hdf5File h5_;                         // while it is open on all ranks
  bool is_whole_ = false;                     // the part is closed, and nothing has failed
};

}  // namespace repose::results
