#include "repose/solve/supported.h"

#include <gtest/gtest.h>
#include <petsctao.h>

#include <algorithm>
#include <fstream>

#include "repose/base/error.h"
#include "repose/base/options.h"
#include "repose/base/petsc.h"

extern "C" {
extern PetscFunctionList TaoList, TaoLineSearchList, KSPList, PCList;
}

namespace repose::solve {
namespace supported_test {

const SupportedTypes& row(const std::string& option) {
  const auto& table = supported_types();
  return *std::find_if(table.begin(), table.end(), [&](auto& row) { return row.option == option; });
}

std::vector<std::string> registered(PetscFunctionList list) {
  const char** names = nullptr;
  int count = 0;
  base::check(PetscFunctionListGet(list, &names, &count));
  std::vector<std::string> result;
  for (int i = 0; i < count; ++i)
    if (names[i]) result.emplace_back(names[i]);
  base::check(PetscFree(names));
  return result;
}

/// Every type that PETSc has is taken or refused as the table says.
void expect_table(const char* option, PetscFunctionList list) {
  const auto& allowed = row(option + 1).values;
  const auto all = registered(list);
  EXPECT_GT(all.size(), 4u);
  for (const std::string& type : all) {
    const base::ScopedOption chosen(option, type);
    if (std::find(allowed.begin(), allowed.end(), type) != allowed.end())
      EXPECT_NO_THROW(require_supported_options()) << option << ' ' << type;
    else
      EXPECT_THROW(require_supported_options(), base::InputError) << option << ' ' << type;
  }
  for (const std::string& type : allowed)  // PETSc is built with ML or without
    EXPECT_TRUE(type == "columns" || type == "ml" ||
                std::find(all.begin(), all.end(), type) != all.end())
        << type;
}

TEST(SupportedTypes, EveryTypeOfPetscIsTakenOrRefused) {
  base::check(TaoInitializePackage());
  base::check(TaoLineSearchInitializePackage());
  base::check(KSPInitializePackage());
  base::check(PCInitializePackage());
  expect_table("-tao_type", TaoList);
  expect_table("-tao_ls_type", TaoLineSearchList);
  expect_table("-ksp_type", KSPList);
  expect_table("-pc_type", PCList);
}

TEST(SupportedTypes, ARefusalNamesTheAllowedValues) {
  const base::ScopedOption chosen("-tao_ntr_ksp_type", "gltr");
  try {
    require_supported_options();
    FAIL();
  } catch (const base::InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("-tao_ntr_ksp_type gltr: must be one of stcg, nash"), std::string::npos)
        << text;
  }
}

TEST(SupportedTypes, APreconditionerOfAMethodIsRefused) {
  const base::ScopedOption chosen("-tao_bnk_pc_type", "jacobi");
  EXPECT_THROW(require_supported_options(), base::InputError);
}

TEST(SupportedTypes, OtherPrefixesAreLeftAlone) {
  const base::ScopedOption levels("-mg_levels_ksp_type", "gmres"), sub("-sub_pc_type", "ilu");
  EXPECT_NO_THROW(require_supported_options());
}

/// The message of a refusal, or "accepted".
std::string refusal_of(const char* option, const std::string& value) {
  const base::ScopedOption chosen(option, value);
  try {
    require_supported_options();
  } catch (const base::InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(SupportedNumbers, ValuesOutOfRangeAreRefusedWithTheRange) {
  for (const char* value : {"nan", "inf", "-1", "1e-2mm", "0,01", "1e400", "many"})
    EXPECT_EQ(refusal_of("-tao_gatol", value),
              fmt::format("-tao_gatol {}: must be a number, ≥ 0", value));
  EXPECT_EQ(refusal_of("-tao_gatol", ""), "-tao_gatol (no value): must be a number, ≥ 0");
  EXPECT_EQ(refusal_of("-tao_ntr_ksp_rtol", "1"),
            "-tao_ntr_ksp_rtol 1: must be a number, > 0 and ≤ 0.9");
  EXPECT_EQ(refusal_of("-ksp_divtol", "1"), "-ksp_divtol 1: must be a number, > 1");
  EXPECT_EQ(refusal_of("-tao_lmvm_renewal_price", "-5"),
            "-tao_lmvm_renewal_price -5: must be a number, ≥ 1");
  EXPECT_EQ(refusal_of("-tao_max_it", "2.5"), "-tao_max_it 2.5: must be a whole number, ≥ -1");
  for (const char* value : {"0", "1e-3", ".5"})
    EXPECT_EQ(refusal_of("-tao_gatol", value), "accepted");
  EXPECT_EQ(refusal_of("-tao_max_it", "20"), "accepted");
}

TEST(SupportedNumbers, NoOptionTakesNan) {
  EXPECT_EQ(refusal_of("-pc_sor_omega", "NaN"), "-pc_sor_omega NaN: must be a number");
  EXPECT_EQ(refusal_of("-pc_sor_omega", "1.5"), "accepted");
}

TEST(SupportedTypes, GivenOptionsOfTheSearchAreListed) {
  EXPECT_EQ(given_search_options(), "");
  const base::ScopedOption maximum("-ksp_max_it", "1"), share("-tao_ntr_ksp_rtol", "1"),
      monitor("-ksp_monitor", ""), stability("-eps_tol", "0.1");
  const std::string given = given_search_options();
  EXPECT_NE(given.find("-ksp_max_it 1"), std::string::npos) << given;
  EXPECT_NE(given.find("-tao_ntr_ksp_rtol 1"), std::string::npos) << given;
  EXPECT_EQ(given.find("monitor"), std::string::npos) << given;
  EXPECT_EQ(given.find("eps"), std::string::npos) << given;
}

TEST(SupportedTypes, DocumentationHoldsTheTable) {
  std::ifstream page(REPOSE_MESHES "/../docs/guide/solver.md");
  const std::string text{std::istreambuf_iterator<char>(page), {}};
  EXPECT_NE(text.find(describe_supported_types()), std::string::npos)
      << "replace the table in docs/guide/solver.md by\n"
      << describe_supported_types();
  EXPECT_NE(text.find(describe_supported_numbers()), std::string::npos)
      << "replace the table in docs/guide/solver.md by\n"
      << describe_supported_numbers();
}

}  // namespace supported_test
}  // namespace repose::solve
