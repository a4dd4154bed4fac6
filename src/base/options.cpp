#include "repose/base/options.h"

#include <petscsys.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "petsc_option_names.h"
#include "repose/base/error.h"
#include "repose/base/petsc.h"
#include "repose/base/text.h"

namespace repose::base {

namespace {

std::optional<bool> parse_flag(std::string_view text) {
  for (const char* word : {"true", "yes", "on", "1"})
    if (text == word) return true;
  for (const char* word : {"false", "no", "off", "0"})
    if (text == word) return false;
  return std::nullopt;
}

/// The name behind one or two dashes, or empty where the token is a value.
std::string name_of(const std::string& token) {
  const std::size_t dashes = token.starts_with("--") ? 2 : 1;
  if (token.size() <= dashes || token[0] != '-') return {};
  const bool letter = std::isalpha(static_cast<unsigned char>(token[dashes])) != 0;
  const bool infinite = token == "-inf" || token == "-nan";
  return letter && !infinite ? token.substr(dashes) : std::string{};
}

/// `-log_view scene.yaml`: what PETSc takes for these is a viewer (ascii:log.txt), never a bare
/// path, so a path behind one of them is an argument of the program.
bool is_argument_behind(const std::string& petsc_option, const std::string& token) {
  const auto ends = [&](const char* end) { return petsc_option.ends_with(end); };
  const bool viewer =
      ends("_view") || ends("_monitor") || ends("_reason") || petsc_option == "info";
  return viewer && token.find_first_of("./") != std::string::npos &&
         token.find(':') == std::string::npos;
}

bool is_value(const std::vector<std::string>& tokens, int position) {
  return position < static_cast<int>(tokens.size()) && name_of(tokens[position]).empty();
}

std::string expected(const Option& option) {
  switch (option.kind) {
    case OptionKind::flag:
      return "true or false";
    case OptionKind::choice:
      return fmt::format("one of {}", fmt::join(option.choices, ", "));
    case OptionKind::text:
    case OptionKind::path:
      return option.kind == OptionKind::path ? "a path" : "a text";
    case OptionKind::number:
    case OptionKind::integer:
      break;
  }
  return expected_number(option.kind == OptionKind::integer, option.unit, option.range,
                         option.choices);
}

bool is_word(const Option& option, const std::string& value) {
  return std::find(option.choices.begin(), option.choices.end(), value) != option.choices.end();
}

bool is_valid(const Option& option, const std::string& value) {
  if (is_word(option, value)) return true;
  switch (option.kind) {
    case OptionKind::flag:
      return parse_flag(value).has_value();
    case OptionKind::number: {
      const auto number = parse_number(value);
      return number && option.range.contains(*number);
    }
    case OptionKind::integer: {
      const auto number = parse_integer(value);
      return number && option.range.contains(static_cast<double>(*number));
    }
    case OptionKind::choice:
      return false;
    case OptionKind::text:
    case OptionKind::path:
      return !value.empty();
  }
  return false;
}

/// Returns the placeholder for a value in the help, e.g. "MM", "N|auto", "energy|force".
std::string placeholder(const Option& option) {
  switch (option.kind) {
    case OptionKind::flag:
      return "";
    case OptionKind::choice:
      return fmt::format("{}", fmt::join(option.choices, "|"));
    case OptionKind::text:
      return "TEXT";
    case OptionKind::path:
      return "FILE";
    case OptionKind::number:
    case OptionKind::integer:
      break;
  }
  std::string text = option.unit.empty() ? "N" : option.unit;
  for (const std::string& word : option.choices) text += "|" + word;
  return text;
}

std::string help_line(const Option& option) {
  std::string left = fmt::format("-{}", option.name);
  for (int i = 0; i < option.values; ++i)
    if (option.kind != OptionKind::flag) left.append(" ").append(placeholder(option));
  std::string notes = option.range.text();
  const std::string& otherwise =
      option.default_text.empty() ? option.default_note : option.default_text;
  if (!otherwise.empty() && option.kind != OptionKind::flag)
    notes += fmt::format("{}default {}", notes.empty() ? "" : "; ", otherwise);
  return fmt::format("  {:<34} {}{}\n", left, option.help,
                     notes.empty() ? "" : fmt::format(" [{}]", notes));
}

/// Returns whether PETSc takes each value of the option, not the last alone.
bool is_cumulative(const std::string& name) {
  return name.starts_with("options_file") || name.starts_with("prefix_");
}

/// Puts files of options before other options: PETSc takes them in their order, and what the
/// command line gives beats a file. Behind a prefix (-prefix_push) all stay where they are.
std::vector<std::string> files_first(const std::vector<std::string>& tokens) {
  if (std::ranges::find(tokens, "-prefix_push") != tokens.end()) return tokens;
  std::vector<std::string> files{tokens.front()}, others;
  bool of_file = false;
  for (size_t i = 1; i < tokens.size(); ++i) {
    if (const std::string name = name_of(tokens[i]); !name.empty())
      of_file = name.starts_with("options_file");
    (of_file ? files : others).push_back(tokens[i]);
  }
  files.insert(files.end(), others.begin(), others.end());
  return files;
}

/// Returns whether PETSc reads the option only in PetscFinalize.
bool is_read_at_finalize(const std::string& name) {
  return name == "options_left" || name == "options_view" || name == "objects_dump" ||
         name == "malloc_dump" || name == "mpidump";
}

/// The names in PETSc's database that nobody has requested so far.
std::vector<std::string> left_in_database() {
  PetscInt count = 0;
  char **names = nullptr, **values = nullptr;
  base::check(PetscOptionsLeftGet(nullptr, &count, &names, &values));
  std::vector<std::string> result(names, names + count);
  base::check(PetscOptionsLeftRestore(nullptr, &count, &names, &values));
  return result;
}

/// Returns whether PETSC_OPTIONS, which is meant for any program that uses PETSc, holds the option.
bool is_in_environment(const std::string& name) {
  const char* text = std::getenv("PETSC_OPTIONS");
  std::istringstream words(text ? text : "");
  for (std::string word; words >> word;)
    if (name_of(word) == name) return true;
  return false;
}

/// Refuses a viewer, `type:file:format`, that PETSc could not open: it would say so at the end of a
/// run, on one rank.
void check_viewer(const std::string& name, const std::string& value) {
  constexpr std::array types{"",    "ascii", "binary", "draw",   "socket",  "hdf5",
                             "vtk", "saws",  "glvis",  "matlab", "exodusii"};
  const auto ends = [&](const char* end) { return name.ends_with(end); };
  const std::size_t colon = value.find(':');
  if (!(ends("_view") || ends("_monitor") || ends("_reason")) || colon == std::string::npos) return;
  const std::string type = value.substr(0, colon), rest = value.substr(colon + 1);
  if (std::find(types.begin(), types.end(), type) == types.end())
    refuse("-{} {}: viewer {} must be one of {}", name, value, type, fmt::join(types, " "));
  const std::filesystem::path file = rest.substr(0, rest.find(':'));
  std::error_code error;
  if (file.has_parent_path() && !std::filesystem::is_directory(file.parent_path(), error))
    refuse("-{} {}: there is no folder {}; make it first", name, value,
           file.parent_path().string());
}

}  // namespace

std::vector<std::pair<std::string, std::string>> petsc_options() {
  char* text = nullptr;
  base::check(PetscOptionsGetAll(nullptr, &text));
  std::istringstream stream(text);
  base::check(PetscFree(text));
  std::vector<std::pair<std::string, std::string>> options;
  for (std::string word; stream >> word;) {
    if (const std::string name = name_of(word); !name.empty())
      options.emplace_back(name, "");
    else if (!options.empty() && options.back().second.empty())
      options.back().second = word;
  }
  return options;
}

Options::Options(int argc, char* const* argv, std::string description,
                 std::vector<Argument> arguments, std::vector<Option> table)
    : program_(argc > 0 ? std::filesystem::path(argv[0]).filename().string() : "program"),
      description_(std::move(description)),
      arguments_(std::move(arguments)),
      table_(std::move(table)) {
  const std::vector<std::string> tokens(argv, argv + argc);
  petsc_tokens_.push_back(tokens.empty() ? program_ : tokens[0]);
  for (int i = 1; i < argc;) {
    if (is_value(tokens, i))
      positional_.push_back(tokens[i++]);
    else
      i = sort_option(i, tokens);
  }
  petsc_tokens_ = files_first(petsc_tokens_);
  for (std::string& token : petsc_tokens_) petsc_pointers_.push_back(token.data());
  petsc_pointers_.push_back(nullptr);
}

/// Sorts the option at `position` and its values; returns the position behind them.
int Options::sort_option(int position, const std::vector<std::string>& tokens) {
  const std::string name = name_of(tokens[position]);
  const int next = position + 1;
  if (const Option* option = find(name)) return take_values(*option, next, tokens);
  const bool help = name == "help" || name == "h";
  const bool for_petsc =
      is_value(tokens, next) && (tokens[next] == "petsc" || tokens[next] == "intro");
  if (help && !for_petsc) {
    help_requested_ = true;
    return next;
  }
  if (name == "version") {
    version_requested_ = true;
    return next;
  }
  if (!help && !begins_as_petsc(name)) {
    remarks_.unknown.push_back(name);
    return is_value(tokens, next) ? next + 1 : next;
  }
  const bool takes_value = is_value(tokens, next) && !is_argument_behind(name, tokens[next]);
  if (!is_cumulative(name))
    if (const auto before = last_petsc_values(name))
      note_repeated(name, *before,
                    takes_value ? std::vector{tokens[next]} : std::vector<std::string>{});
  petsc_tokens_.push_back("-" + name);
  if (takes_value && (!help || tokens[next] == "intro")) petsc_tokens_.push_back(tokens[next]);
  return takes_value ? next + 1 : next;
}

/// The values that an option of PETSc has so far, if it is given.
std::optional<std::vector<std::string>> Options::last_petsc_values(const std::string& name) const {
  const auto last = std::find(petsc_tokens_.rbegin(), petsc_tokens_.rend(), "-" + name);
  if (last == petsc_tokens_.rend()) return {};
  const auto position = static_cast<int>(petsc_tokens_.rend() - last);  // behind the name
  if (!is_value(petsc_tokens_, position)) return std::vector<std::string>{};
  return std::vector{petsc_tokens_[position]};
}

void Options::note_repeated(const std::string& name, const std::vector<std::string>& before,
                            const std::vector<std::string>& values) {
  if (before == values) return;
  const auto typed = [](const std::vector<std::string>& words) {
    return words.empty() ? "no value" : quote(fmt::format("{}", fmt::join(words, " ")));
  };
  remarks_.repeated.push_back(
      fmt::format("option -{} is given several times: {} is used, not {}; give it once", name,
                  typed(values), typed(before)));
}

int Options::take_values(const Option& option, int position,
                         const std::vector<std::string>& tokens) {
  std::vector<std::string> values;
  const auto more = [&] { return is_value(tokens, position); };
  if (option.kind == OptionKind::flag)
    values.push_back(more() && parse_flag(tokens[position]) ? tokens[position++] : "true");
  else
    for (int i = 0; i < option.values && more(); ++i) values.push_back(tokens[position++]);
  if (const auto before = given_.find(option.name); before != given_.end())
    note_repeated(option.name, before->second, values);
  given_[option.name] = std::move(values);
  return position;
}

std::string Options::help() const {
  std::string text = program_;
  for (const Argument& argument : arguments_) text += " " + argument.name;
  text += " [-option value ...]\n" + description_ + "\n\n";
  for (const Argument& argument : arguments_)
    text += fmt::format("  {:<34} {}\n", argument.name, argument.help);
  for (const Option& option : table_) text += help_line(option);
  text +=
      fmt::format("  {:<34} {}\n", "-version", "Print the versions of Repose and its libraries.");
  text += fmt::format("  {:<34} {}\n", "-help", "This page; -help petsc lists PETSc's options.");
  return text +
         "\nEvery PETSc option (-tao_type, -ksp_type, -log_view, -options_file ...) works too.\n";
}

void Options::check() {
  read_database();
  if (!remarks_.unknown.empty()) refuse_unknown(remarks_.unknown.front());
  for (const auto& [name, values] : given_) check_values(row(name), values);
  check_arguments();
  leave_out_endings();
}

void Options::leave_out_endings() {
  for (auto& [name, values] : given_)
    for (std::string& value : values) value = without_ending(value, row(name).endings);
}

void Options::read_database() {
  PetscBool initialized = PETSC_FALSE;
  base::check(PetscInitialized(&initialized));
  if (!initialized) return;
  for (const Option& option : table_) {
    std::array<char, 4096> value{};
    PetscBool set = PETSC_FALSE;
    base::check(PetscOptionsGetString(nullptr, nullptr, ("-" + option.name).c_str(), value.data(),
                                      value.size(), &set));
    if (!set || given_.contains(option.name)) continue;
    const bool bare = value[0] == '\0';
    std::vector<std::string>& values = given_[option.name];
    if (!bare || option.kind == OptionKind::flag) values.push_back(bare ? "true" : value.data());
  }
  for (const auto& [name, value] : petsc_options()) {
    check_viewer(name, value);
    if (find(name) || name.starts_with("log_") || is_read_at_finalize(name)) continue;
    petsc_settings_ += fmt::format("{}-{}{}{}", petsc_settings_.empty() ? "" : " ", name,
                                   value.empty() ? "" : " ", value);
  }
  for (const std::string& name : left_in_database())
    if (!begins_as_petsc(name) && name != "help" && !is_in_environment(name))
      remarks_.unknown.push_back(name);
}

void Options::refuse_unknown(const std::string& name) const {
  std::vector<std::string> known{"help"};
  for (const Option& option : table_) known.push_back(option.name);
  refuse("{}: unknown option {}; the nearest known one is -{} (-help lists all)", program_,
         quote("-" + name), nearest(name, known));
}

void Options::check_values(const Option& option, const std::vector<std::string>& values) const {
  if (static_cast<int>(values.size()) < option.values)
    refuse("{}: -{} needs {} value{} {}", program_, option.name, option.values,
           option.values == 1 ? ":" : "s, each", expected(option));
  for (const std::string& value : values) {
    if (is_valid(option, value)) continue;
    if (const auto removed = option.removed.find(value); removed != option.removed.end())
      refuse("{}: -{} no longer takes {}; {}", program_, option.name, value, removed->second);
    const bool words = option.kind == OptionKind::choice;
    refuse("{}: -{} {} must be {}{}", program_, option.name, quote(value), expected(option),
           words ? fmt::format("; did you mean {}?", nearest(value, option.choices)) : "");
  }
}

void Options::check_arguments() const {
  if (positional_.size() > arguments_.size())
    refuse("{}: unexpected argument {}; it takes {} (-help explains)", program_,
           quote(positional_[arguments_.size()]),
           arguments_.empty() ? "none" : fmt::format("{}", arguments_.size()));
  if (positional_.size() == arguments_.size()) return;
  const Argument& missing = arguments_[positional_.size()];
  std::string hint;
  for (std::size_t i = 2; i < petsc_tokens_.size(); ++i)
    if (name_of(petsc_tokens_[i]).empty())
      hint = fmt::format("; {} was taken as the value of {}: put {} first", quote(petsc_tokens_[i]),
                         petsc_tokens_[i - 1], missing.name);
  refuse("{}: {} is missing: {}{} (-help explains)", program_, missing.name, missing.help, hint);
}

const Option* Options::find(std::string_view name) const {
  const auto found = std::find_if(table_.begin(), table_.end(),
                                  [&](const Option& option) { return option.name == name; });
  return found == table_.end() ? nullptr : &*found;
}

const Option& Options::row(std::string_view name) const {
  if (const Option* option = find(name)) return *option;
  throw InternalError(fmt::format("{}: the table of options has no -{}", program_, name));
}

bool Options::has(std::string_view name) const { return given_.contains(row(name).name); }

std::vector<std::string> Options::texts(std::string_view name) const {
  const Option& option = row(name);
  if (const auto found = given_.find(name); found != given_.end()) return found->second;
  return option.default_text.empty() ? std::vector<std::string>{}
                                     : std::vector<std::string>{option.default_text};
}

std::string Options::text(std::string_view name) const {
  const std::vector<std::string> values = texts(name);
  return values.empty() ? std::string{} : values.front();
}

bool Options::flag(std::string_view name) const { return parse_flag(text(name)).value_or(false); }

double Options::number(std::string_view name) const {
  if (const auto value = parse_number(text(name))) return *value;
  throw InternalError(fmt::format("{}: -{} holds no number", program_, name));
}

int64_t Options::integer(std::string_view name) const {
  if (const auto value = parse_integer(text(name))) return *value;
  throw InternalError(fmt::format("{}: -{} holds no whole number", program_, name));
}

std::vector<std::string> Options::words(std::string_view name) const {
  std::vector<std::string> result;
  std::istringstream list(text(name));
  for (std::string word; std::getline(list, word, ',');)
    if (!word.empty()) result.push_back(word);
  return result;
}

std::vector<double> Options::numbers(std::string_view name, const Range& range) const {
  std::vector<double> result;
  for (const std::string& word : words(name)) {
    const auto number = parse_number(word);
    if (!number || !range.contains(*number))
      refuse("-{} {}: {} is not {}", name, text(name), quote(word),
             expected_number(false, "", range, {}));
    result.push_back(*number);
  }
  return result;
}

std::vector<int> Options::integers(std::string_view name, const Range& range) const {
  std::vector<int> result;
  for (const double number : numbers(name, range)) {
    if (number != std::floor(number))
      refuse("-{} {}: {:g} is not a whole number", name, text(name), number);
    result.push_back(static_cast<int>(number));
  }
  return result;
}

std::vector<std::string> Options::unused() const {
  std::vector<std::string> left = left_in_database();
  std::erase_if(left, is_read_at_finalize);
  std::vector<std::string> result;
  for (const std::string& token : petsc_tokens_)
    if (std::find(left.begin(), left.end(), name_of(token)) != left.end()) result.push_back(token);
  for (const std::string& name : left)
    if (is_in_environment(name)) result.push_back("-" + name + " of PETSC_OPTIONS");
  return result;
}

}  // namespace repose::base
