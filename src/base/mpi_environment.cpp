#include "mpi_environment.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <string_view>

namespace repose::base {

namespace {

/// Each is set by who starts ranks: mpirun, or a batch system by PMI or PMIx.
constexpr std::array launchers{"OMPI_COMM_WORLD_SIZE",
                               "PMIX_RANK",
                               "PMIX_NAMESPACE",
                               "PMI_RANK",
                               "PMI_FD",
                               "PMI_PORT",
                               "PMI_SIZE",
                               "ALPS_APP_PE"};

bool is_on_one_machine(const Environment& environment) {
  const char* all = environment("OMPI_COMM_WORLD_SIZE");
  const char* local = environment("OMPI_COMM_WORLD_LOCAL_SIZE");
  return all && local && std::string_view(all) == local;
}

/// Linux' seccomp mode 2.
bool system_calls_are_filtered() {
  std::ifstream status("/proc/self/status");
  for (std::string name, value; status >> name && std::getline(status, value);)
    if (name == "Seccomp:") return value.find('2') != std::string::npos;
  return false;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> mpi_variables(const Environment& environment,
                                                               bool filtered) {
  std::vector<std::pair<std::string, std::string>> variables{
      {"OMPI_ALLOW_RUN_AS_ROOT", "1"}, {"OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"}};
  const auto add = [&](const char* name, const std::string& value) {
    variables.emplace_back(name, value);
  };
  if (std::none_of(launchers.begin(), launchers.end(), environment)) {
    add("OMPI_MCA_ess_singleton_isolated", "1");
    add("OMPI_MCA_orte_create_session_dirs", "0");
    add("OMPI_MCA_sharedfp", "individual");  // the others make files of their own
    add("OMPI_MCA_pml", "ob1");
    add("OMPI_MCA_btl", "self");
    add("HWLOC_COMPONENTS", "-gl,-opencl");
  } else if (is_on_one_machine(environment)) {
    add("OMPI_MCA_pml", "ob1");
    add("OMPI_MCA_btl", "^tcp,ofi,openib");
  }
  if (filtered) {
    add("OMPI_MCA_btl_vader_single_copy_mechanism", "none");
    add("OMPI_MCA_btl_sm_single_copy_mechanism", "none");
  }
  return variables;
}

void set_mpi_variables() {
  constexpr int keep = 0;
  const auto variables = mpi_variables([](const char* name) { return std::getenv(name); },
                                       system_calls_are_filtered());
  for (const auto& [name, value] : variables) setenv(name.c_str(), value.c_str(), keep);
}

}  // namespace repose::base
