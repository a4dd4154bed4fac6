#include "unfinished_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "repose/base/error.h"
#include "repose/base/whole_file.h"

namespace repose::results {

namespace {

void make_last(const std::filesystem::path& path) {
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool fine = descriptor >= 0 && fsync(descriptor) == 0;
  const int reason = errno;
  if (descriptor >= 0) close(descriptor);
  // Some file systems cannot fsync a folder and say EINVAL.
  if (!fine && reason != EINVAL)
    base::refuse("{}: cannot be written: {}", path.string(), std::strerror(reason));
}

}  // namespace

UnfinishedFile::UnfinishedFile(std::filesystem::path file) : file_(std::move(file)) {
  base::require_writable(file_);
  part_ = base::begin_part(file_);
}

UnfinishedFile::~UnfinishedFile() {
  std::error_code ignored;
  if (!committed_) std::filesystem::remove(part_, ignored);
}

void UnfinishedFile::write(const std::string& content) const {
  std::ofstream out(part_, std::ios::binary | std::ios::trunc);
  out << content << std::flush;
  if (!out)
    base::refuse("{}: cannot be written: {}; free space or choose another -output", file_.string(),
                 std::strerror(errno));
}

void UnfinishedFile::copy_file() const {
  std::error_code error;
  std::filesystem::copy_file(file_, part_, std::filesystem::copy_options::overwrite_existing,
                             error);
  if (error)
    base::refuse("{}: cannot be copied: {}; free space or choose another -output", file_.string(),
                 error.message());
}

void UnfinishedFile::reserve(int64_t bytes) const {
  std::error_code error;
  const auto left =
      static_cast<int64_t>(std::filesystem::space(base::folder_of(file_), error).available);
  bool lacking = !error && left < bytes;  // to try would fill the disk of all others for a while
  if (!lacking) {
    const int descriptor = open(part_.c_str(), O_WRONLY | O_CLOEXEC);
    const off_t end = lseek(descriptor, 0, SEEK_END);
    lacking = fallocate(descriptor, FALLOC_FL_KEEP_SIZE, end, bytes) != 0 &&
              (errno == ENOSPC || errno == EDQUOT);
    if (descriptor >= 0) close(descriptor);
  }
  if (lacking)
    base::refuse(
        "{}: needs {:.2f} MB more, its disk has {:.2f} MB left; free space or choose another "
        "-output",
        file_.string(), 1e-6 * static_cast<double>(bytes), 1e-6 * static_cast<double>(left));
}

void UnfinishedFile::commit() {
  std::error_code error;
  // Gives back what was reserved and not used.
  std::filesystem::resize_file(part_, std::filesystem::file_size(part_, error), error);
  make_last(part_);
  std::filesystem::rename(part_, file_, error);
  if (error) base::refuse("{}: cannot be replaced: {}", file_.string(), error.message());
  committed_ = true;
  make_last(base::folder_of(file_));
}

}  // namespace repose::results
