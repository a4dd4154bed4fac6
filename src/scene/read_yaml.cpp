#include "read_yaml.h"

#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <cctype>
#include <sstream>
#include <string>

#include "repose/base/error.h"
#include "repose/base/text.h"
#include "repose/base/whole_file.h"

namespace repose::scene {

namespace {

bool is_control(char c) {
  return (static_cast<unsigned char>(c) < ' ' && c != '\n' && c != '\r' && c != '\t') ||
         c == '\x7f';
}

std::string read_scene_text(const std::filesystem::path& file) {
  const std::string text =
      base::read_text_input(file, {1, "a scene file", "give a scene file (.yaml)"});
  const auto control = std::find_if(text.begin(), text.end(), is_control);
  if (control != text.end())
    base::refuse("{}:{}: not a text file; give a scene file (.yaml)", file.string(),
                 1 + std::count(text.begin(), control, '\n'));
  return text;
}

/// Notes where documents begin.
class Documents : public YAML::EventHandler {
 public:
  std::vector<int> lines;  // from 1
  void OnDocumentStart(const YAML::Mark& mark) override { lines.push_back(mark.line + 1); }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t,
                const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}
};

/// The line of the second document, 0 for none. YAML::LoadAll, which would tell, never ends
/// with some damaged files.
int second_document(const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  Documents documents;
  while (documents.lines.size() < 2 && parser.HandleNextDocument(documents)) {
  }
  return documents.lines.size() < 2 ? 0 : documents.lines[1];
}

std::string_view without_indentation(std::string_view line) {
  return line.substr(std::min(line.find_first_not_of(" \t"), line.size()));
}

bool is_indented_by_tab(std::string_view line) {
  return line.substr(0, line.size() - without_indentation(line).size()).find('\t') != line.npos;
}

/// `layers:4`, which YAML takes for a text.
bool lacks_blank_after_colon(std::string_view line) {
  line = without_indentation(line);
  if (line.starts_with("- ")) line = without_indentation(line.substr(2));
  const auto is_of_key = [](unsigned char c) { return std::isalpha(c) != 0 || c == '_'; };
  const auto key = static_cast<size_t>(std::ranges::find_if_not(line, is_of_key) - line.begin());
  return key > 0 && key + 1 < line.size() && line[key] == ':' && line[key + 1] > ' ';
}

/// `"C:\Users"`, where \U begins a code.
bool escapes_in_quotes(std::string_view line) {
  const size_t quote = line.find('"');
  return quote != line.npos && line.find('\\', quote) != line.npos;
}

/// Names the first line with a common mistake of which YAML's own message says nothing.
std::string remark_on(std::string_view text) {
  int number = 0;
  for (size_t position = 0; position < text.size();) {
    const std::string_view line = base::next_line(text, position);
    ++number;
    if (is_indented_by_tab(line))
      return fmt::format("; line {} is indented by a tab, use blanks", number);
    if (lacks_blank_after_colon(line))
      return fmt::format("; line {} lacks a blank after the colon", number);
    if (escapes_in_quotes(line))
      return fmt::format("; line {} has a \\ in quotes, write / between folders", number);
  }
  return "";
}

}  // namespace

YAML::Node read_yaml(const std::filesystem::path& file) {
  const std::string text = read_scene_text(file);
  try {
    const YAML::Node document = YAML::Load(text);
    if (document.IsNull())
      base::refuse("{}:1:1: the file is empty; a scene needs skin, bones and tissue",
                   file.string());
    if (const int second = second_document(text); second > 0)
      base::refuse("{}:{}:1: the file holds 2 documents or more; a scene is one", file.string(),
                   second);
    return document;
  } catch (const YAML::Exception& error) {
    std::string reason = base::quote(error.msg);
    base::refuse("{}:{}:{}: not valid YAML: {}{}", file.string(), error.mark.line + 1,
                 error.mark.column + 1, reason.substr(1, reason.size() - 2), remark_on(text));
  }
}

}  // namespace repose::scene
