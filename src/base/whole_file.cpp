#include "repose/base/whole_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>

#include "repose/base/error.h"

namespace repose::base {

void write_whole_file(const std::filesystem::path& file, std::string_view bytes) {
  const std::filesystem::path part = file.string() + ".part";
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
