#include "repose/solve/supported.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "repose/base/error.h"
#include "repose/base/options.h"

namespace repose::solve {

namespace {

bool matches(const std::string& pattern, const std::string& name) {
  const std::size_t star = pattern.find('*');
  if (star == std::string::npos) return name == pattern;
  const std::string end = pattern.substr(star + 1);
  return name.size() >= pattern.size() && name.starts_with(pattern.substr(0, star)) &&
         name.ends_with(end);
}

void require_supported(const std::string& name, const std::string& value) {
  for (const SupportedTypes& types : supported_types()) {
    if (!matches(types.option, base::lower(name))) continue;
    if (types.values.empty()) base::refuse("-{} {}: {}", name, value, types.use);
    if (std::find(types.values.begin(), types.values.end(), value) != types.values.end()) return;
    base::refuse("-{} {}: must be one of {} ({})", name, value.empty() ? "(no value)" : value,
                 fmt::join(types.values, ", "), types.use);
  }
}

/// Returns whether a word is what PETSc reads as no number at all.
bool is_nan(const std::string& value) {
  const std::string word = base::lower(value);
  return word == "nan" || word == "+nan" || word == "-nan";
}

void require_number(const std::string& name, const std::string& value) {
  for (const SupportedNumbers& numbers : supported_numbers()) {
    const auto is_named = [&](const std::string& option) {
      return matches(option, base::lower(name));
    };
    if (std::none_of(numbers.options.begin(), numbers.options.end(), is_named)) continue;
    const auto number = base::parse_number(value);
    const bool whole = !numbers.whole || base::parse_integer(value);
    if (number && whole && numbers.range.contains(*number)) return;
    base::refuse("-{} {}: must be {}", name, value.empty() ? "(no value)" : value,
                 base::expected_number(numbers.whole, "", numbers.range, {}));
  }
  if (is_nan(value)) base::refuse("-{} {}: must be a number", name, value);
}

}  // namespace

const std::vector<SupportedTypes>& supported_types() {
  static const std::vector<SupportedTypes> table{
      {"tao_type",
       {"lmvm", "ntr", "nls", "ntl", "bntr", "bnls", "bntl", "bqnkls", "bqnktr", "bqnktl", "blmvm",
        "bqnls", "bncg", "cg"},
       "the search for the rest position"},
      {"tao_ls_type", {"more-thuente", "armijo", "gpcg"}, "its line search"},
      {"tao_*_ksp_type", {"stcg", "nash"}, "linear systems of a Newton method's steps"},
      {"tao_*_pc_type", {}, "the preconditioner is chosen by -pc_type"},
      {"tao_*_mat_type", {"lmvmbfgs"}, "the approximation of the inverse Hessian"},
      {"ksp_type",
       {"cg", "groppcg", "pipecg", "pipeprcg", "fcg", "cr", "minres", "preonly", "stcg", "nash"},
       "linear systems of the error estimate"},
      {"ksp_norm_type",
       {"preconditioned", "unpreconditioned", "natural"},
       "the norm that ends them"},
      {"ksp_convergence_test", {"default"}, "what ends them"},
      {"ksp_atol", {}, "an absolute tolerance bounds no error; give -ksp_rtol"},
      {"pc_type",
       {"columns", "none", "jacobi", "pbjacobi", "sor", "gamg", "ml", "hypre", "cholesky", "lu"},
       "the preconditioner of both"},
      {"eps_type", {}, "the eigenvalue solver follows from the number of unknowns; leave it out"},
      {"st_type", {}, "the spectral transformation follows from -stability; leave it out"}};
  return table;
}

const std::vector<SupportedNumbers>& supported_numbers() {
  using base::Range;
  static const std::vector<SupportedNumbers> table{
      {{"tao_gatol", "tao_grtol", "tao_gttol", "tao_catol", "tao_crtol", "tao_steptol"},
       Range::at_least(0)},
      {{"tao_max_it", "tao_max_funcs"}, Range::at_least(-1), true},
      {{"tao_ls_ftol", "tao_ls_gtol", "tao_ls_rtol", "tao_ls_stepmin"}, Range::at_least(0)},
      {{"tao_ls_stepmax"}, Range::above(0)},
      {{"tao_ls_max_funcs"}, Range::at_least(1), true},
      {{"ksp_rtol", "tao_*_ksp_rtol"}, {.min = 0, .max = 0.9, .min_excluded = true}},
      {{"tao_*_ksp_atol"}, Range::at_least(0)},
      {{"ksp_divtol", "tao_*_ksp_divtol"}, Range::above(1)},
      {{"ksp_max_it", "tao_*_ksp_max_it"}, Range::at_least(1), true},
      {{"pc_renewal_price"}, Range::at_least(-1)},
      {{"tao_lmvm_renewal_price"}, Range::at_least(1)},
      {{"eps_tol"}, {.min = 0, .max = 1, .min_excluded = true}},
      {{"eps_max_it", "eps_nev"}, Range::at_least(1), true}};
  return table;
}

void require_supported_options() {
  for (const auto& [name, value] : base::petsc_options()) {
    require_supported(name, value);
    require_number(name, value);
  }
}

std::string given_search_options() {
  std::vector<std::string> options;
  for (const SupportedTypes& types : supported_types()) options.push_back(types.option);
  for (const SupportedNumbers& numbers : supported_numbers())
    options.insert(options.end(), numbers.options.begin(), numbers.options.end());
  std::erase_if(options, [](const std::string& option) { return option.starts_with("eps_"); });
  std::vector<std::string> given;
  for (const auto& [name, value] : base::petsc_options())
    if (std::ranges::any_of(options, [&, lower = base::lower(name)](const std::string& option) {
          return matches(option, lower);
        }))
      given.push_back(fmt::format("-{} {}", name, value));
  return fmt::format("{}", fmt::join(given, ", "));
}

std::string describe_supported_types() {
  std::string text = "| option | values | chooses |\n|---|---|---|\n";
  for (const SupportedTypes& types : supported_types()) {
    std::string values = types.values.empty() ? "none" : "";
    for (const std::string& value : types.values)
      values += fmt::format("{}`{}`", values.empty() ? "" : ", ", value);
    text += fmt::format("| `-{}` | {} | {} |\n", types.option, values, types.use);
  }
  return text;
}

std::string describe_supported_numbers() {
  std::string text = "| options | value |\n|---|---|\n";
  for (const SupportedNumbers& numbers : supported_numbers())
    text += fmt::format("| `-{}` | {} |\n", fmt::join(numbers.options, "`, `-"),
                        base::expected_number(numbers.whole, "", numbers.range, {}));
  return text;
}

}  // namespace repose::solve
