#include "repose/results/name_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <regex>

#include "repose/base/error.h"
#include "repose/base/whole_file.h"

namespace repose::results {

namespace {

/// Whether the open file is still the one at `path`: a holder removes it when it is done.
bool is_at(const std::filesystem::path& path, int descriptor) {
  struct stat open_one = {}, there = {};
  return fstat(descriptor, &open_one) == 0 && stat(path.c_str(), &there) == 0 &&
         open_one.st_ino == there.st_ino && open_one.st_dev == there.st_dev;
}

/// Who holds the lock, as it wrote into the file.
std::string holder_of(int descriptor) {
  std::array<char, 200> text = {};
  const ssize_t length = pread(descriptor, text.data(), text.size(), 0);
  return length > 0 ? std::string(text.data(), length) : "another run";
}

void write_holder(int descriptor) {
  std::array<char, 100> host = {};
  gethostname(host.data(), host.size() - 1);
  const std::string text = fmt::format("process {} on {}", getpid(), host.data());
  // Who it is only helps a person: without the text it is "another run".
  if (ftruncate(descriptor, 0) != 0 || pwrite(descriptor, text.data(), text.size(), 0) < 0) return;
}

/// Whether what follows the name is that of a run's unfinished file, not of another run's.
bool is_ending(const std::string& rest) {
  static const std::regex endings(
      "(_checkpoint)?(\\.h5|_(tissue|springs|skin|bones)\\.xdmf)\\.[0-9]+\\.part");
  return std::regex_match(rest, endings);
}

}  // namespace

NameLock::NameLock(const std::filesystem::path& name)
    : name_(name), file_(name.string() + ".lock") {
  base::require_writable(name.string() + ".h5");
  while (!acquire()) {
  }
  write_holder(descriptor_);
  remove_leftovers();
}

NameLock::~NameLock() {
  std::error_code ignored;
  std::filesystem::remove(file_, ignored);
  close(descriptor_);
}

bool NameLock::acquire() {
  descriptor_ = open(file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor_ < 0)
    base::refuse("{}: cannot be written: {}; choose another -output", file_.string(),
                 std::strerror(errno));
  const bool held = flock(descriptor_, LOCK_EX | LOCK_NB) == 0;
  if (!held && errno == EWOULDBLOCK) {
    const std::string holder = holder_of(descriptor_);
    close(descriptor_);
    base::refuse("{}.h5: {} is at work on it; choose another -output or wait for its end",
                 name_.string(), holder);
  }
  if (!held || is_at(file_, descriptor_)) return true;
  close(descriptor_);
  return false;
}

void NameLock::remove_leftovers() const {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(base::folder_of(name_), error)) {
    const std::string file = entry.path().filename().string();
    const std::string name = name_.filename().string();
    if (file.starts_with(name) && is_ending(file.substr(name.size())))
      std::filesystem::remove(entry.path(), error);
  }
}

}  // namespace repose::results
