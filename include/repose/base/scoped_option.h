#pragma once
#include <string>

namespace repose::base {

/// Sets a PETSc option for its life; what the person gave stands again after.
class ScopedOption {
 public:
  ScopedOption(const char* name, const std::string& value);  ///< `name` with its dash, a literal
  ~ScopedOption();
  ScopedOption(const ScopedOption&) = delete;
  ScopedOption& operator=(const ScopedOption&) = delete;

 private:
  const char* name_;
  std::string before_;
};

}  // namespace repose::base
