#include "value.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "repose/base/text.h"

namespace repose::scene {

namespace {

// Of vectors and matrices, in mm, N, N/kg or none; no energy of such numbers overflows.
constexpr double largest_component = 1e7;

std::string joined(const std::string& above, const std::string& name) {
  return above.empty() ? name : fmt::format("{}.{}", above, name);
}

/// Why a path that leads to no file may do so: folders as Windows writes them, or a name in other
/// case; else empty.
std::string remark_on_path(const std::filesystem::path& path) {
  if (path.string().find('\\') != std::string::npos) return "; write / between folders, not \\";
  std::error_code error;
  for (std::filesystem::directory_iterator entry(path.parent_path(), error), end;
       !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (base::lower(name) == base::lower(path.filename().string()))
      return fmt::format("; its folder holds {}", base::quote(name));
  }
  return "";
}

}  // namespace

Value::Value(std::filesystem::path file, const YAML::Node& root)
    : file_(std::make_shared<const std::filesystem::path>(std::move(file))),
      node_(root),
      mark_(root.Mark()) {}

Value::Value(const Value& parent, const YAML::Node& node, const YAML::Mark& mark, std::string path,
             std::string place)
    : file_(parent.file_),
      node_(node),
      mark_(mark),
      path_(std::move(path)),
      place_(std::move(place)) {}

void Value::refuse_at(const YAML::Mark& mark, const std::string& text) const {
  const std::string at =
      mark.is_null() ? "" : fmt::format(":{}:{}", mark.line + 1, mark.column + 1);
  base::refuse("{}{}: {} {}", file_->string(), at, place_.empty() ? "the scene" : place_, text);
}

void Value::refuse_kind() const {
  refuse("must be {}, it is {}", expected(find_key(path_)), quote());
}

double Value::number_as(const std::string& expected) const {
  const auto value = node_.IsScalar() ? base::parse_number(node_.Scalar()) : std::nullopt;
  const Key& key = find_key(path_);
  if (!value || !key.range.contains(*value)) {
    const double turned = value && std::isfinite(*value) ? std::remainder(*value, 360.0) : NAN;
    const bool turns = key.unit == "degrees" && key.range.contains(turned);
    refuse("must be {}, it is {}{}", expected, quote(),
           turns ? fmt::format("; write {:g}, which ends in the same place", turned) : "");
  }
  return *value;
}

std::string Value::quote() const {
  if (is_map()) return "a map";
  if (is_list()) return "a list";
  return node_.IsScalar() ? base::quote(node_.Scalar()) : "empty";
}

double Value::number() const { return number_as(expected(find_key(path_))); }

int Value::integer() const {
  const auto value = node_.IsScalar() ? base::parse_integer(node_.Scalar()) : std::nullopt;
  if (!value || !find_key(path_).range.contains(static_cast<double>(*value))) refuse_kind();
  return static_cast<int>(*value);
}

std::string Value::text() const {
  if (!node_.IsScalar() || node_.Scalar().empty()) refuse_kind();
  return node_.Scalar();
}

std::vector<std::pair<std::string, Value>> Value::texts() const {
  std::vector<std::pair<std::string, Value>> result;
  if (!is_list()) return {{text(), *this}};
  for (const Value& element : elements()) result.push_back({element.text(), element});
  if (result.empty()) refuse_kind();
  return result;
}

int Value::choice() const {
  const auto& [choices, removed] = std::tie(find_key(path_).choices, find_key(path_).removed);
  const std::string word = node_.IsScalar() ? node_.Scalar() : std::string{};
  if (const auto old = removed.find(word); old != removed.end())
    refuse("no longer takes {}; {}", word, old->second);
  const auto found = std::find(choices.begin(), choices.end(), word);
  if (found == choices.end())
    refuse("must be {}, it is {}; the nearest is {}", expected(find_key(path_)), quote(),
           base::nearest(word, choices));
  return static_cast<int>(found - choices.begin());
}

Vec3 Value::vector() const {
  if (!is_list() || node_.size() != 3) refuse_kind();
  const std::vector<double> xyz = numbers();
  return {xyz[0], xyz[1], xyz[2]};
}

std::vector<double> Value::numbers() const {
  const Key& key = find_key(path_);
  const std::string expected = base::expected_number(false, key.unit, key.range, {});
  std::vector<double> result;
  for (const Value& element : elements()) {
    result.push_back(element.number_as(expected));
    if (std::abs(result.back()) > largest_component)
      refuse("must be {} of no more than {:g}, one is {}", expected, largest_component,
             element.quote());
  }
  return result;
}

std::filesystem::path Value::absolute_path() const {
  return std::filesystem::absolute(std::filesystem::absolute(*file_).parent_path() / text())
      .lexically_normal();
}

std::filesystem::path Value::file() const {
  auto path = absolute_path();
  std::error_code error;
  if (std::filesystem::is_directory(path, error))
    refuse("names the folder {}; a file is needed", quote());
  if (!std::filesystem::is_regular_file(path, error))
    refuse("names {}, which is no file (paths are relative to the scene's folder){}", quote(),
           remark_on_path(path));
  return path;
}

std::filesystem::path Value::file_or_folder() const {
  auto path = absolute_path();
  std::error_code error;
  if (!std::filesystem::exists(path, error))
    refuse("names {}, which is no file or folder (paths are relative to the scene's folder){}",
           quote(), remark_on_path(path));
  return path;
}

std::vector<Value> Value::list(const std::string& path) const {
  if (!is_list()) refuse_kind();
  std::vector<Value> result;
  for (std::size_t i = 0; i < node_.size(); ++i)
    result.push_back({*this, node_[i], node_[i].Mark(), path, fmt::format("{}[{}]", place_, i)});
  return result;
}

std::vector<Value> Value::items() const { return list(path_ + "[]"); }

std::vector<Value> Value::elements() const { return list(path_); }

std::vector<std::pair<std::string, Value>> Value::named() const {
  std::vector<std::pair<std::string, Value>> result;
  for (const Entry& entry : entries())
    result.push_back({entry.name, Value(*this, entry.value, entry.mark, joined(path_, "*"),
                                        fmt::format("{} \"{}\"", place_, entry.name))});
  return result;
}

/// The map that a word seems to stand for: that of the key among whose choices the word is.
std::string Value::hint_of_map() const {
  if (!node_.IsScalar()) return "";
  for (const Key* key : keys_below(path_))
    if (std::ranges::find(key->choices, node_.Scalar()) != key->choices.end())
      return fmt::format("; write {}: {{{}: {}}}", last_word(path_), last_word(key->path),
                         node_.Scalar());
  return "";
}

std::vector<Value::Entry> Value::entries() const {
  std::vector<Entry> found;
  if (!is_map()) refuse("must be a map, it is {}{}", quote(), hint_of_map());
  add_entries(node_, false, 0, found);
  return found;
}

void Value::add_entries(const YAML::Node& map, bool merged, int depth,
                        std::vector<Entry>& found) const {
  constexpr int deepest = 8;
  if (depth > deepest) refuse("merges (<<) more than {} deep, or itself", deepest);
  for (const auto& pair : map) {
    if (!pair.first.IsScalar()) refuse_at(pair.first.Mark(), "has a key that is not a text");
    const std::string& name = pair.first.Scalar();
    if (name != "<<") {
      add_entry({name, pair.first.Mark(), pair.second, merged}, found);
    } else if (pair.second.IsMap()) {
      add_entries(pair.second, true, depth + 1, found);
    } else if (pair.second.IsSequence()) {
      for (const auto& part : pair.second) add_entries(part, true, depth + 1, found);
    } else {
      refuse_at(pair.first.Mark(), "merges (<<) what is not a map");
    }
  }
}

/// Adds an entry: those of the map itself override merged ones, and an earlier merge a later one.
void Value::add_entry(Entry entry, std::vector<Entry>& found) const {
  const auto same = std::find_if(found.begin(), found.end(),
                                 [&](const Entry& other) { return other.name == entry.name; });
  if (same == found.end())
    found.push_back(std::move(entry));
  else if (!entry.merged && !same->merged)
    refuse_at(entry.mark, fmt::format("has the key {} twice (first in line {}); remove one",
                                      base::quote(entry.name), same->mark.line + 1));
  else if (!entry.merged)
    *same = std::move(entry);
}

Map::Map(const Value& value) : itself_(value), entries_(value.entries()) {
  for (const Value::Entry& entry : entries_) check_known(entry);
  for (const Key* key : keys_below(itself_.path_)) {
    if (key->required()) at(last_word(key->path));
    const auto given = key->kind == KeyKind::choice ? find(last_word(key->path)) : std::nullopt;
    if (given) given->choice();
  }
}

void Map::check_known(const Value::Entry& entry) const {
  for (const Key* key : keys_below(itself_.path_)) {
    if (last_word(key->path) != entry.name) continue;
    if (!entry.value.IsNull() || key->path == "bones") return;
    itself_.refuse_at(entry.mark, fmt::format("has no value for '{}': give {}, or remove the key",
                                              entry.name, expected(*key)));
  }
  refuse_unknown(entry);
}

namespace {

/// In quotes the known key of such a name, but for a letter, with the shortest path; empty for
/// none.
std::string key_elsewhere(const std::string& name) {
  const auto rank = [&](const Key& key) {
    return std::pair(base::edit_distance(name, last_word(key.path)),
                     std::count(key.path.begin(), key.path.end(), '.'));
  };
  const Key* best = nullptr;
  for (const Key& key : all_keys())
    if (rank(key).first <= 1 && (!best || rank(key) < rank(*best))) best = &key;
  if (!best) return "";
  const bool at_top = best->path.find('.') == std::string::npos;
  return fmt::format("'{}'{}", best->path, at_top ? " at the top of the scene" : "");
}

}  // namespace

void Map::refuse_unknown(const Value::Entry& entry) const {
  if (base::parse_number(entry.name))
    itself_.refuse_at(entry.mark,
                      fmt::format("has the number {} in place of a key; decimals follow "
                                  "a point, not a comma",
                                  base::quote(entry.name)));
  std::vector<std::string> siblings;
  for (const Key* key : keys_below(itself_.path_)) siblings.push_back(last_word(key->path));
  const std::string sibling = base::nearest(entry.name, siblings);
  // A known key in the wrong place is likelier than a sibling with most of its letters wrong.
  std::string best;
  if (base::edit_distance(entry.name, sibling) > 2) best = key_elsewhere(entry.name);
  if (best.empty()) best = fmt::format("'{}'", sibling);
  itself_.refuse_at(entry.mark, fmt::format("has an unknown key {}; the nearest known one is {}",
                                            base::quote(entry.name), best));
}

std::optional<Value> Map::find(const std::string& name) const {
  for (const Value::Entry& entry : entries_)
    if (entry.name == name)
      return Value(itself_, entry.value, entry.value.Mark(), joined(itself_.path_, name),
                   joined(itself_.place_, name));
  return std::nullopt;
}

Value Map::at(const std::string& name) const {
  if (auto value = find(name)) return *value;
  itself_.refuse("lacks the key '{}': {}", name, expected(find_key(joined(itself_.path_, name))));
}

std::string Map::only(const std::vector<std::string>& names, std::string_view advice) const {
  std::vector<std::string> given;
  for (const std::string& name : names)
    if (find(name)) given.push_back(name);
  if (given.size() == 1) return given.front();
  itself_.refuse("must hold exactly one of {}{}", fmt::join(names, ", "), advice);
}

}  // namespace repose::scene
