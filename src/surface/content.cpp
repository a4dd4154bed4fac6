#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "repose/base/error.h"
#include "repose/base/text.h"
#include "repose/base/whole_file.h"
#include "soup.h"

namespace repose::surface {
namespace {

std::string first_word(const std::string& bytes) {
  size_t position = 0;
  while (position < bytes.size()) {
    const auto found = base::words(base::next_line(bytes, position));
    if (!found.empty() && found[0][0] != '#') return std::string(found[0]);
  }
  return {};
}

bool is_off_keyword(std::string word) {
  for (const char* prefix : {"ST", "C", "N", "4", "n"})
    if (word.starts_with(prefix)) word.erase(0, std::strlen(prefix));
  return word == "OFF";
}

bool is_obj_keyword(const std::string& word) {
  constexpr std::array known = {"v", "vn", "vt", "f", "o", "g", "s", "l", "mtllib", "usemtl"};
  return std::find(known.begin(), known.end(), word) != known.end();
}

}  // namespace

Content read_content(const std::filesystem::path& file) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status))
    base::refuse("{}: no such file; check the path of this surface", file.string());
  if (!std::filesystem::is_regular_file(status))
    base::refuse("{}: not a file; name a PLY, STL, OBJ or OFF file", file.string());
  std::ifstream in(file, std::ios::binary);
  if (!in) base::refuse("{}: cannot be opened: {}", file.string(), std::strerror(errno));
  base::record_input(file);
  Content content{file, {std::istreambuf_iterator<char>(in), {}}};
  if (in.bad()) base::refuse("{}: cannot be read: {}", file.string(), std::strerror(errno));
  if (content.bytes.starts_with("\xEF\xBB\xBF")) content.bytes.erase(0, 3);
  if (content.bytes.empty()) base::refuse("{}: the file is empty; export it again", file.string());
  return content;
}

size_t stl_size(const std::string& bytes) {
  if (bytes.size() < stl_header_bytes) return 0;
  uint32_t triangles = 0;
  std::memcpy(&triangles, bytes.data() + 80, sizeof triangles);
  return stl_header_bytes + stl_triangle_bytes * size_t{triangles};
}

Format recognize(const Content& content) {
  const std::string& bytes = content.bytes;
  if (bytes.starts_with("ply\n") || bytes.starts_with("ply\r")) return Format::ply;
  if (stl_size(bytes) == bytes.size()) return Format::stl_binary;
  const std::string word = first_word(bytes);
  if (is_off_keyword(word)) return Format::off;
  const bool binary = bytes.find('\0') != std::string::npos;
  if (base::lower(word) == "solid" && !binary) return Format::stl_text;
  const std::string ending = base::lower(content.file.extension().string());
  if (!binary && (ending == ".obj" || is_obj_keyword(word))) return Format::obj;
  if (ending == ".stl") return Format::stl_binary;
  base::refuse("{}: the content is none of PLY, STL, OBJ and OFF; convert the mesh to one of them",
               content.file.string());
}

}  // namespace repose::surface
