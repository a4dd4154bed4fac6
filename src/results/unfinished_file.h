#pragma once
#include <filesystem>
#include <string>

namespace repose::results {

/// A file being written beside its place under a name of its own (base::begin_part): commit() makes
/// it last on the disk and renames it; destroyed before that, the part is removed. For one process;
/// not copied or moved.
class UnfinishedFile {
 public:
  explicit UnfinishedFile(std::filesystem::path file);  ///< InputError where it cannot be made
  ~UnfinishedFile();
  UnfinishedFile(UnfinishedFile&&) = delete;

  const std::filesystem::path& part() const { return part_; }
  /// Writes the whole content. InputError if the disk refuses.
  void write(const std::string& content) const;
  /// Begins with what the file holds. InputError if the disk refuses.
  void copy_file() const;
  /// Sets room for `bytes` more than the part holds aside on the disk, so that no write that
  /// many ranks take part in finds it full: MPI-IO hangs then. InputError where the disk has less.
  /// On file systems that cannot reserve, the free space alone decides.
  void reserve(int64_t bytes) const;
  /// fsync, rename, fsync of the folder. InputError if the disk refuses.
  void commit();

 private:
  std::filesystem::path file_, part_;
  bool committed_ = false;
};

}  // namespace repose::results
