#include "repose/results/name_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <regex>
#include <sstream>

#include "repose/base/error.h"
#include "repose/base/whole_file.h"
#include "repose/results/run_files.h"

namespace repose::results {

namespace {

/// Returns whether the open file is still the one at `path`: a holder removes it when it is done.
bool is_at(const std::filesystem::path& path, int descriptor) {
  struct stat open_one = {}, there = {};
  return fstat(descriptor, &open_one) == 0 && stat(path.c_str(), &there) == 0 &&
         open_one.st_ino == there.st_ino && open_one.st_dev == there.st_dev;
}

/// Who holds the lock, as it wrote into the file, or empty.
std::string lock_owner(int descriptor) {
  std::array<char, 200> text = {};
  const ssize_t length = pread(descriptor, text.data(), text.size(), 0);
  return {text.data(), static_cast<size_t>(std::max<ssize_t>(length, 0))};
}

std::string this_host() {
  std::array<char, 100> host = {};
  gethostname(host.data(), host.size() - 1);
  return host.data();
}

/// When a process began, in clock ticks since the system did (proc(5)), or empty: there is none.
std::string start_of(const std::string& process) {
  std::ifstream stream("/proc/" + process + "/stat");
  std::string text, field;
  std::getline(stream, text);
  const auto name_end = text.rfind(')');
  if (name_end == std::string::npos) return "";
  std::istringstream fields(text.substr(name_end + 1));
  constexpr int start = 22, after_name = 2;  // fields are counted from 1
  for (int k = after_name; k < start; ++k) fields >> field;
  return field;
}

void write_holder(int descriptor) {
  const std::string process = std::to_string(getpid());
  const std::string text =
      fmt::format("process {} on {} since tick {}", process, this_host(), start_of(process));
  // Who it is only helps a person: without the text it is "another run".
  if (ftruncate(descriptor, 0) != 0 || pwrite(descriptor, text.data(), text.size(), 0) < 0) return;
}

/// Returns whether what follows the name is that of a run's unfinished file, not of another run's.
bool is_ending(const std::string& rest) {
  static const std::regex unfinished("\\.[0-9]+\\.part");
  return std::ranges::any_of(run_file_endings(), [&](const std::string& ending) {
    return rest.starts_with(ending) && std::regex_match(rest.substr(ending.size()), unfinished);
  });
}

}  // namespace

bool may_be_running(const std::string& holder) {
  static const std::regex words("process ([0-9]+) on (\\S+) since tick ([0-9]+)");
  std::smatch found;
  if (!std::regex_match(holder, found, words) || found[2] != this_host()) return true;
  return start_of(found[1]) == found[3];
}

NameLock::NameLock(const std::filesystem::path& name)
    : name_(name), file_(name.string() + ".lock") {
  base::require_name(name.string());
  base::require_writable(name.string() + ".h5");
  while (!acquire()) {
  }
  on_signal_.emplace(file_);
  write_holder(descriptor_);
  remove_leftovers();
}

NameLock::~NameLock() {
  on_signal_.reset();
  std::error_code ignored;
  std::filesystem::remove(file_, ignored);
  close(descriptor_);
}

bool NameLock::acquire() {
  descriptor_ = open(file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor_ < 0)
    base::refuse("{}: cannot be written: {}; choose another -output", file_.string(),
                 std::strerror(errno));
  const bool held = flock(descriptor_, LOCK_EX | LOCK_NB) == 0, knows_locks = errno == EWOULDBLOCK;
  const std::string holder = lock_owner(descriptor_);
  // Where the file system has no locks, the file's text has to do.
  if (!held && (knows_locks || (!holder.empty() && may_be_running(holder)))) {
    close(descriptor_);
    base::refuse(
        "{}.h5: {} is at work on it; choose another -output or wait for its end; where that "
        "process has ended, delete {}",
        name_.string(), holder.empty() ? "another run" : holder, file_.string());
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
