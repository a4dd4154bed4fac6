#pragma once
#include <string>
#include <vector>

#include "repose/base/text.h"

/// The types of PETSc's objects that work with the program's functions and matrices, and the
/// numbers that they take.
namespace repose::solve {

/// Allowed values of a PETSc option that chooses a type.
struct SupportedTypes {
  std::string option;  ///< without its dash; a * stands for the name of a method
  std::vector<std::string> values;
  std::string use;  ///< what the object does, or which option to set in its place
};

const std::vector<SupportedTypes>& supported_types();

/// Allowed values of a PETSc option that is a number.
struct SupportedNumbers {
  std::vector<std::string> options;  ///< without their dash; a * stands for the name of a method
  base::Range range;
  bool whole = false;
};

const std::vector<SupportedNumbers>& supported_numbers();

/// Refuses, with the allowed ones, a type or number in PETSc's options that is not in the tables,
/// and nan for any option (InputError): such types crash, stop with an error or return a wrong
/// answer, and PETSc takes such numbers without a word. Not collective.
void require_supported_options();

/// The options of PETSc that choose a type or a number of the search, as "-ksp_max_it 1, -pc_type
/// none"; empty where there are none. Not collective.
std::string given_search_options();

/// The tables in Markdown, as docs/guide/solver.md has them.
std::string describe_supported_types();
std::string describe_supported_numbers();

}  // namespace repose::solve
