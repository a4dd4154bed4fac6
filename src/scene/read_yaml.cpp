#include "read_yaml.h"

#include <yaml-cpp/eventhandler.h>
#include <algorithm>

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

/// Names the first line that a tab indents, of which YAML's own message says nothing.
std::string remark_on_tabs(std::string_view text) {
  int number = 0;
  for (size_t position = 0; position < text.size();) {
    const std::string_view line = base::next_line(text, position);
    ++number;
    const size_t indentation = std::min(line.find_first_not_of(" \t"), line.size());
    if (line.substr(0, indentation).find('\t') != line.npos)
      return fmt::format("; line {} is indented by a tab, use blanks", number);
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
                 error.mark.column + 1, reason.substr(1, reason.size() - 2), remark_on_tabs(text));
  }
}

}  // namespace repose::scene
