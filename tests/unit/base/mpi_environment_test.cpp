#include "base/mpi_environment.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "repose/base/petsc.h"

namespace repose::base {
namespace mpi_environment_test {

std::map<std::string, std::string> variables(const std::map<std::string, const char*>& set,
                                             bool filtered = false) {
  const auto environment = [&](const char* name) {
    const auto found = set.find(name);
    return found == set.end() ? nullptr : found->second;
  };
  const auto list = mpi_variables(environment, filtered);
  return {list.begin(), list.end()};
}

TEST(MpiEnvironment, AProgramAloneNeedsNeitherDaemonNorNetwork) {
  const auto set = variables({{"OMPI_MCA_mpi_yield_when_idle", "1"}});
  EXPECT_EQ(set.at("OMPI_MCA_ess_singleton_isolated"), "1");
  EXPECT_EQ(set.at("OMPI_MCA_pml"), "ob1");
  EXPECT_EQ(set.at("OMPI_MCA_btl"), "self");
}

TEST(MpiEnvironment, AProgramAloneMakesNoFolder) {
  EXPECT_EQ(variables({}).at("OMPI_MCA_orte_create_session_dirs"), "0");
  EXPECT_EQ(variables({}).at("OMPI_MCA_sharedfp"), "individual");
  EXPECT_FALSE(
      variables({{"OMPI_COMM_WORLD_SIZE", "2"}}).contains("OMPI_MCA_orte_create_session_dirs"));
}

TEST(MpiEnvironment, RanksOnOneMachineNeedNoNetwork) {
  const auto set = variables({{"OMPI_COMM_WORLD_SIZE", "4"}, {"OMPI_COMM_WORLD_LOCAL_SIZE", "4"}});
  EXPECT_EQ(set.at("OMPI_MCA_pml"), "ob1");
  EXPECT_EQ(set.at("OMPI_MCA_btl"), "^tcp,ofi,openib");
  EXPECT_FALSE(set.contains("OMPI_MCA_ess_singleton_isolated"));
}

TEST(MpiEnvironment, RanksOnSeveralMachinesKeepTheirNetwork) {
  for (const std::map<std::string, const char*>& launcher :
       std::vector<std::map<std::string, const char*>>{
           {{"OMPI_COMM_WORLD_SIZE", "8"}, {"OMPI_COMM_WORLD_LOCAL_SIZE", "4"}},
           {{"OMPI_COMM_WORLD_SIZE", "8"}},
           {{"PMIX_RANK", "0"}, {"PMIX_NAMESPACE", "slurm.pmix.7.0"}},
           {{"PMI_RANK", "3"}, {"PMI_SIZE", "4"}},
           {{"PMI_FD", "12"}}}) {
    const auto set = variables(launcher);
    EXPECT_FALSE(set.contains("OMPI_MCA_ess_singleton_isolated")) << launcher.begin()->first;
    EXPECT_FALSE(set.contains("OMPI_MCA_pml")) << launcher.begin()->first;
    EXPECT_FALSE(set.contains("OMPI_MCA_btl")) << launcher.begin()->first;
  }
}

TEST(MpiEnvironment, RanksBehindAFilterDoNotReadEachOthersMemory) {
  for (const char* name :
       {"OMPI_MCA_btl_vader_single_copy_mechanism", "OMPI_MCA_btl_sm_single_copy_mechanism"}) {
    EXPECT_EQ(variables({}, true).at(name), "none");
    EXPECT_FALSE(variables({}, false).contains(name));
  }
}

TEST(MpiEnvironment, WhatTheUserSetStays) {
  setenv("OMPI_MCA_pml", "cm", 1);
  set_mpi_variables();
  EXPECT_STREQ(std::getenv("OMPI_MCA_pml"), "cm");
  unsetenv("OMPI_MCA_pml");
}

/// Open files of this process beyond the standard ones that are sockets.
int sockets() {
  int count = 0;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    const bool standard = std::stoi(entry.path().filename()) <= 2;
    const std::string target = std::filesystem::read_symlink(entry.path(), error).string();
    count += !standard && target.starts_with("socket:");
  }
  return count;
}

std::string child_processes() {
  std::ifstream stream("/proc/thread-self/children");
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Number of sockets and child processes that a session leaves open.
int traces_of_a_session() {
  const int before = sockets();
  std::string name = "test";
  char* argv[] = {name.data(), nullptr};
  const Session session(1, argv);
  return sockets() - before + (child_processes().empty() ? 0 : 1);
}

// In a process of its own, as MPI starts but once in each.
TEST(MpiEnvironmentDeathTest, ASessionAloneOpensNoSocketAndStartsNoDaemon) {
  EXPECT_EXIT(std::_Exit(traces_of_a_session()), ::testing::ExitedWithCode(0), "");
}

}  // namespace mpi_environment_test
}  // namespace repose::base
