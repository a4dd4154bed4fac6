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
      EXPECT_NO_THROW(require_supported_types()) << option << ' ' << type;
    else
      EXPECT_THROW(require_supported_types(), base::InputError) << option << ' ' << type;
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
    require_supported_types();
    FAIL();
  } catch (const base::InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("-tao_ntr_ksp_type gltr: must be one of stcg, nash"), std::string::npos)
        << text;
  }
}

TEST(SupportedTypes, APreconditionerOfAMethodIsRefused) {
  const base::ScopedOption chosen("-tao_bnk_pc_type", "jacobi");
  EXPECT_THROW(require_supported_types(), base::InputError);
}

TEST(SupportedTypes, OtherPrefixesAreLeftAlone) {
  const base::ScopedOption levels("-mg_levels_ksp_type", "gmres"), sub("-sub_pc_type", "ilu");
  EXPECT_NO_THROW(require_supported_types());
}

TEST(SupportedTypes, DocumentationHoldsTheTable) {
  std::ifstream page(REPOSE_MESHES "/../docs/guide/solver.md");
  const std::string text{std::istreambuf_iterator<char>(page), {}};
  EXPECT_NE(text.find(describe_supported_types()), std::string::npos)
      << "replace the table in docs/guide/solver.md by\n"
      << describe_supported_types();
}

}  // namespace supported_test
}  // namespace repose::solve
