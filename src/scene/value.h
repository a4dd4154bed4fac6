#pragma once
#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "repose/base/error.h"
#include "repose/base/geometry.h"
#include "repose/scene/keys.h"

namespace repose::scene {

/// A value in a scene file that knows where it stands and which key it belongs to, so that every
/// function below can check it against the table and refuse it in one line.
class Value {
 public:
  /// The whole file.
  Value(std::filesystem::path file, const YAML::Node& root);

  /// Throws InputError "file:line:column: key text".
  template <class... Args>
  [[noreturn]] void refuse(fmt::format_string<Args...> format, Args&&... args) const {
    refuse_at(mark_, fmt::format(format, std::forward<Args>(args)...));
  }

  /// As a person reads it: moves[1].landmark.
  const std::string& place() const { return place_; }

  bool is_map() const { return node_.IsMap(); }
  bool is_list() const { return node_.IsSequence(); }
  bool is_empty() const { return node_.IsNull(); }
  bool is_word(const std::string& word) const { return node_.IsScalar() && node_.Scalar() == word; }

  double number() const;
  int integer() const;
  std::string text() const;
  /// A text alone is a list of one.
  std::vector<std::pair<std::string, Value>> texts() const;
  /// Position in the key's choices.
  int choice() const;
  Vec3 vector() const;
  std::vector<double> numbers() const;
  /// Absolute path of a file that exists.
  std::filesystem::path file() const;
  /// Absolute path of a file or folder that exists.
  std::filesystem::path file_or_folder() const;

  /// Returns the value under another key of the table.
  Value as(std::string path) const { return {*this, node_, mark_, std::move(path), place_}; }

  /// The items of a list of maps, each under the key "path[]".
  std::vector<Value> items() const;
  /// The elements of a list, each under this value's own key.
  std::vector<Value> elements() const;
  /// A map with names of one's own: name and value, each under the key "path.*". Merge keys (<<)
  /// are expanded; a name given twice is refused.
  std::vector<std::pair<std::string, Value>> named() const;

 private:
  friend class Map;
  struct Entry {
    std::string name;
    YAML::Mark mark;
    YAML::Node value;
    bool merged;
  };

  Value(const Value& parent, const YAML::Node& node, const YAML::Mark& mark, std::string path,
        std::string place);
  std::vector<Value> list(const std::string& path) const;
  std::vector<Entry> entries() const;
  void add_entries(const YAML::Node& map, bool merged, int depth, std::vector<Entry>& found) const;
  void add_entry(Entry entry, std::vector<Entry>& found) const;
  [[noreturn]] void refuse_at(const YAML::Mark& mark, const std::string& text) const;
  [[noreturn]] void refuse_kind() const;
  std::filesystem::path absolute_path() const;
  std::string quote() const;
  std::string hint_of_map() const;
  double number_as(const std::string& expected) const;

  std::shared_ptr<const std::filesystem::path> file_;
  YAML::Node node_;
  YAML::Mark mark_;
  std::string path_;   // of the key in the table; empty for the whole file
  std::string place_;  // as a person reads it: bones[1].file
};

/// A map with known keys. Making one refuses a value that is no map, unknown keys (naming the
/// nearest known one), keys given twice or without a value, keys this version does not model, and
/// the lack of a required key.
class Map {
 public:
  explicit Map(const Value& value);
  std::optional<Value> find(const std::string& name) const;
  Value at(const std::string& name) const;
  /// Returns the one of these keys that is given. Refuses none and several; `advice` ends the
  /// message.
  std::string only(const std::vector<std::string>& names, std::string_view advice = {}) const;
  const Value& itself() const { return itself_; }

 private:
  void check_known(const Value::Entry& entry) const;
  [[noreturn]] void refuse_unknown(const Value::Entry& entry) const;

  Value itself_;
  std::vector<Value::Entry> entries_;
};

}  // namespace repose::scene
