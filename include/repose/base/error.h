#pragma once
#include <fmt/format.h>

#include <stdexcept>
#include <string>

/// Errors with context: what a program says in one line before it leaves.
namespace repose::base {

/// Exit status of every program (the contract with scripts that call them).
enum class Exit { done = 0, bad_input = 1, not_converged = 2, internal_error = 3 };

/// The input is wrong and the user can mend it: exit status 1. The message is one line that names
/// the file, the place, the value, the allowed range and the remedy.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Something that must hold inside the program does not, or a library failed: exit status 3.
class InternalError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Throws InputError with a formatted message (fmt syntax).
template <class... Args>
[[noreturn]] void refuse(fmt::format_string<Args...> format, Args&&... args) {
  throw InputError(fmt::format(format, std::forward<Args>(args)...));
}

}  // namespace repose::base
