#pragma once
#include <filesystem>
#include <string>

namespace repose::results {

/// A file being written as NAME.part: commit() makes it last on the disk and renames it to NAME;
/// destroyed before that, the .part is removed. For one process; not copied or moved.
class UnfinishedFile {
 public:
  explicit UnfinishedFile(std::filesystem::path file);
  ~UnfinishedFile();
  UnfinishedFile(const UnfinishedFile&) = delete;
  UnfinishedFile& operator=(const UnfinishedFile&) = delete;

  const std::filesystem::path& file() const { return file_; }
  const std::filesystem::path& part() const { return part_; }
  /// Writes the whole content. InputError if the disk refuses.
  void write(const std::string& content) const;
  /// Sets room for `bytes` more than the .part holds aside on the disk (the .part must exist), so
  /// that no write that many ranks take part in finds it full: MPI-IO hangs then. InputError where
  /// the disk has less. File systems that cannot reserve are asked for their free space instead.
  void reserve(int64_t bytes) const;
  /// fsync, rename, fsync of the folder. InputError if the disk refuses.
  void commit();

 private:
  std::filesystem::path file_, part_;
  bool committed_ = false;
};

/// Refuses, in one line, a path that cannot become a file: folder missing or not writable, a folder
/// in its place.
void require_writable(const std::filesystem::path& file);

}  // namespace repose::results
