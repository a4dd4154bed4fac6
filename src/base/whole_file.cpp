#include "repose/base/whole_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <mutex>
#include <set>

#include "repose/base/error.h"
#include "repose/base/text.h"

namespace repose::base {

namespace {

/// Files of this process by their absolute paths without links.
struct Files {
  std::mutex mutex;
  std::set<std::filesystem::path> read, written;
  std::map<std::filesystem::path, std::filesystem::path> reserved;  ///< to the names given
};

Files& files() {
  static Files of_process;
  return of_process;
}

std::filesystem::path real_path(const std::filesystem::path& file) {
  std::error_code error;
  std::filesystem::path path = std::filesystem::weakly_canonical(file, error);
  return error ? file : path;
}

[[noreturn]] void refuse_input(const std::filesystem::path& file) {
  refuse("{}: is an input of this run and would be replaced; choose another -output",
         file.string());
}

void require_no_input(const std::filesystem::path& file) {
  const std::lock_guard lock(files().mutex);
  if (files().read.contains(real_path(file))) refuse_input(file);
}

}  // namespace

void record_input(const std::filesystem::path& file) {
  std::filesystem::path path = real_path(file);
  const std::lock_guard lock(files().mutex);
  if (files().written.contains(path)) return;
  if (const auto output = files().reserved.find(path); output != files().reserved.end())
    refuse_input(output->second);
  files().read.insert(std::move(path));
}

std::string read_text_input(const std::filesystem::path& file, const TextLimits& limits) {
  const std::string name = file.string();
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error))
    refuse("{}: {}; {}", name,
           std::filesystem::is_directory(file, error) ? "is a folder" : "no such file",
           limits.advice);
  if (std::filesystem::file_size(file, error) > std::uintmax_t(limits.mebibytes) << 20)
    refuse("{}: too large for {} ({} MiB allowed); {}", name, limits.what, limits.mebibytes,
           limits.advice);
  std::ifstream stream(file, std::ios::binary);
  if (!stream) refuse("{}: cannot be read; check its permissions", name);
  record_input(file);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
    refuse("{}: is text in UTF-16; save it as UTF-8", name);
  if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
  return text;
}

void require_name(const std::string& name) {
  const auto is_control = [](unsigned char c) { return c < ' ' || c == 127; };
  const std::string last = std::filesystem::path(name).filename().string();
  if (last.empty() || last == "." || last == ".." || std::ranges::any_of(name, is_control))
    refuse("-output {}: is no name of files; give a path without ending such as plans/first",
           quote(name));
}

void reserve_output(const std::filesystem::path& file) {
  require_writable(file);
  const std::lock_guard lock(files().mutex);
  files().reserved.emplace(real_path(file), file);
}

std::filesystem::path folder_of(const std::filesystem::path& file) {
  return file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
}

std::filesystem::path begin_part(const std::filesystem::path& file) {
  require_no_input(file);
  for (int64_t number = getpid();; ++number) {
    std::filesystem::path part = fmt::format("{}.{}.part", file.string(), number);
    const int descriptor = open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor >= 0) {
      close(descriptor);
      const std::lock_guard lock(files().mutex);
      files().written.insert(real_path(file));
      return part;
    }
    if (errno != EEXIST)
      refuse("{}: cannot be written: {}; name a folder that exists and has room", file.string(),
             std::strerror(errno));
  }
}

void require_writable(const std::filesystem::path& file) {
  const std::filesystem::path folder = folder_of(file);
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error))
    refuse("{}: cannot be written: there is no folder {}; make it or choose another -output",
           file.string(), folder.string());
  if (access(folder.c_str(), W_OK | X_OK) != 0)
    refuse("{}: cannot be written: folder {}: {}; choose another -output", file.string(),
           folder.string(), std::strerror(errno));
  if (std::filesystem::is_directory(file, error))
    refuse("{}: is a folder; remove it or choose another -output", file.string());
  require_no_input(file);
}

void write_whole_file(const std::filesystem::path& file, std::string_view bytes) {
  const std::filesystem::path part = begin_part(file);
  std::ofstream out(part, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  std::error_code error;
  if (out) std::filesystem::rename(part, file, error);
  if (out && !error) return;
  const std::string reason = error ? error.message() : std::strerror(errno);
  std::filesystem::remove(part, error);
  refuse("{}: cannot be written: {}; name a folder that exists and has room", file.string(),
         reason);
}

}  // namespace repose::base
