#include "read_yaml.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <string>

#include "repose/base/error.h"
#include "repose/base/text.h"

namespace repose::scene {

namespace {

bool is_control(char c) {
  return (static_cast<unsigned char>(c) < ' ' && c != '\n' && c != '\r' && c != '\t') ||
         c == '\x7f';
}

std::string read_text(const std::filesystem::path& file) {
  constexpr std::uintmax_t largest = 1 << 20;
  const std::string name = file.string();
  std::error_code error;
  if (std::filesystem::is_directory(file, error))
    base::refuse("{}: is a folder; give a scene file (.yaml)", name);
  if (!std::filesystem::is_regular_file(file, error))
    base::refuse("{}: no such file; give a scene file (.yaml)", name);
  if (std::filesystem::file_size(file, error) > largest)
    base::refuse("{}: too large for a scene file (1 MiB allowed); give a scene file (.yaml)", name);
  std::ifstream stream(file, std::ios::binary);
  if (!stream) base::refuse("{}: cannot be read; look at its permissions", name);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  const auto control = std::find_if(text.begin(), text.end(), is_control);
  if (control != text.end())
    base::refuse("{}:{}: not a text file; give a scene file (.yaml)", name,
                 1 + std::count(text.begin(), control, '\n'));
  return text;
}

}  // namespace

YAML::Node read_yaml(const std::filesystem::path& file) {
  const std::string text = read_text(file);
  try {
    const std::vector<YAML::Node> documents = YAML::LoadAll(text);
    if (documents.empty() || documents[0].IsNull())
      base::refuse("{}:1:1: the file is empty; a scene needs skin, bones and tissue",
                   file.string());
    if (documents.size() > 1)
      base::refuse("{}:{}:1: the file holds {} documents; a scene is one", file.string(),
                   documents[1].Mark().line + 1, documents.size());
    return documents[0];
  } catch (const YAML::Exception& error) {
    std::string reason = base::shown(error.msg);
    base::refuse("{}:{}:{}: not valid YAML: {}", file.string(), error.mark.line + 1,
                 error.mark.column + 1, reason.substr(1, reason.size() - 2));
  }
}

}  // namespace repose::scene
