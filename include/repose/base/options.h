#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "repose/base/text.h"

/// The command line of a program, in PETSc's style: `program ARGUMENT … -name value`.
namespace repose::base {

/// A positional argument; all of a program's are required.
struct Argument {
  std::string name;  ///< as the help shows it, e.g. "INPUT"
  std::string help;  ///< one sentence
};

enum class OptionKind { flag, number, integer, choice, text, path };

/// One row of a program's table of options.
struct Option {
  std::string name;  ///< without the dash
  OptionKind kind;
  std::string default_text;  ///< what holds when it is not given; empty: nothing does
  std::string help;          ///< one sentence
  Range range{};             ///< number, integer
  std::string unit{};        ///< number
  /// choice: the words allowed; number, integer: words that may stand in place of the number.
  std::vector<std::string> choices{};
  std::map<std::string, std::string>
      removed{};                       ///< words of earlier versions: what to give instead
  int values = 1;                      ///< how many values follow the name
  std::string default_note{};          ///< for the help, what holds without a default_text
  std::vector<std::string> endings{};  ///< path: each is left out where the value ends with it
};

/// Command-line options, checked against one table; the program's own are read from the command
/// line or, where not given there, from PETSc's database (an -options_file, PETSC_OPTIONS). A
/// program makes them and calls run_program (program.h), which starts PETSc, answers -help and
/// calls check(): every error comes when ranks can agree who prints it. As in PETSc a token is a
/// name if a letter follows its dash (or two); "-300" and "-.5" are values. The last of several
/// wins, with a warning. Nothing here is collective; every rank sees the same command line.
class Options {
 public:
  /// Sorts the command line into the program's own options, PETSc's and arguments. Never throws.
  Options(int argc, char* const* argv, std::string description, std::vector<Argument> arguments,
          std::vector<Option> table);
  Options(Options&&) = delete;

  /// -help was given. With `-help petsc` or `-help intro` it goes to PETSc instead, and this is
  /// false.
  bool help_requested() const { return help_requested_; }
  /// Returns true where -version was given.
  bool version_requested() const { return version_requested_; }
  /// Returns the help page: description, arguments and options, from the table.
  std::string help() const;

  /// The command line for PetscInitialize: the program's name and PETSc's options with their
  /// values, followed by a null pointer. Valid as long as this object.
  int petsc_argc() const { return static_cast<int>(petsc_tokens_.size()); }
  char** petsc_argv() const { return petsc_pointers_.data(); }

  /// Reads PETSc's database (where PETSc is initialized; what is ours is marked as used) and checks
  /// everything. InputError, one line, for a name that is neither ours nor begins as PETSc's do
  /// (with the nearest of ours) and does not come from PETSC_OPTIONS, a missing value, a value of
  /// the wrong kind or out of range, a missing or unexpected argument. Call once, before any of the
  /// functions below.
  void check();

  /// One line for each option that the command line gives several times with different values, of
  /// which the last is used.
  const std::vector<std::string>& repeated() const { return remarks_.repeated; }

  /// One value per Argument, in order.
  const std::vector<std::string>& arguments() const { return positional_; }
  /// The person gave it, on the command line or in PETSc's database.
  bool has(std::string_view name) const;
  /// The value given, else the default. InternalError for a name that is not in the table, and for
  /// a number where a word stands or nothing does.
  double number(std::string_view name) const;
  int64_t integer(std::string_view name) const;
  bool flag(std::string_view name) const;
  std::string text(std::string_view name) const;  ///< text, path, choice; a number as typed
  std::vector<std::string> texts(std::string_view name) const;  ///< all values; empty if none
  /// The words of a text between its commas, and as numbers. InputError for one that is none or out
  /// of range.
  std::vector<std::string> words(std::string_view name) const;
  std::vector<double> numbers(std::string_view name, const Range& range) const;
  std::vector<int> integers(std::string_view name, const Range& range) const;

  /// The PETSc options of the command line, and the unknown ones of PETSC_OPTIONS, that nobody
  /// requested. PETSc must be initialized.
  std::vector<std::string> unused() const;
  /// The options by which the user changes what PETSc computes, as typed, or empty. After check().
  const std::string& petsc_settings() const { return petsc_settings_; }

 private:
  const Option* find(std::string_view name) const;
  const Option& row(std::string_view name) const;
  int sort_option(int position, const std::vector<std::string>& tokens);
  int take_values(const Option& option, int position, const std::vector<std::string>& tokens);
  std::optional<std::vector<std::string>> last_petsc_values(const std::string& name) const;
  void note_repeated(const std::string& name, const std::vector<std::string>& before,
                     const std::vector<std::string>& values);
  void read_database();
  void leave_out_endings();
  void check_values(const Option& option, const std::vector<std::string>& values) const;
  void check_arguments() const;
  [[noreturn]] void refuse_unknown(const std::string& name) const;

  std::string program_, description_, petsc_settings_;
  std::vector<Argument> arguments_;
  std::vector<Option> table_;
  std::map<std::string, std::vector<std::string>, std::less<>> given_;
  std::vector<std::string> positional_, petsc_tokens_;
  struct {
    std::vector<std::string> unknown, repeated;
  } remarks_;
  mutable std::vector<char*> petsc_pointers_;
  bool help_requested_ = false, version_requested_ = false;
};

/// All options in PETSc's database, as (name without its dash, value); the value is empty where
/// there is none. PETSc must be initialized. Not collective.
std::vector<std::pair<std::string, std::string>> petsc_options();

/// Sets a PETSc option for its life; what the person gave stands again after.
class ScopedOption {
 public:
  ScopedOption(const char* name, const std::string& value);  ///< `name` with its dash, a literal
  ~ScopedOption();
  ScopedOption(ScopedOption&&) = delete;

 private:
  const char* name_;
  std::string before_;
};

}  // namespace repose::base
