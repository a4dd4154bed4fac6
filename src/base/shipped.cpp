#include "repose/base/shipped.h"

namespace repose::base {

std::filesystem::path shipped_folder(const std::string& name) {
  std::error_code error;
  const std::filesystem::path bin =
      std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  for (const std::filesystem::path& place :
       {std::filesystem::path(name), bin / "../share/repose" / name, bin / "../.." / name})
    if (std::filesystem::is_directory(place, error)) return place.lexically_normal();
  return name;
}

}  // namespace repose::base
