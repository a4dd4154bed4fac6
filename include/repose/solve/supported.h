#pragma once
#include <string>
#include <vector>

/// The types of PETSc's objects that work with the program's functions and matrices.
namespace repose::solve {

/// Allowed values of a PETSc option that chooses a type.
struct SupportedTypes {
  std::string option;  ///< without its dash; a * stands for the name of a method
  std::vector<std::string> values;
  std::string use;  ///< what the object does, or which option to set in its place
};

const std::vector<SupportedTypes>& supported_types();

/// Refuses, with the allowed values, a type in PETSc's options that is not in the table
/// (InputError). Others crash, stop with an error or return a wrong answer. Not collective.
void require_supported_types();

/// The table in Markdown, as docs/guide/solver.md has it.
std::string describe_supported_types();

}  // namespace repose::solve
