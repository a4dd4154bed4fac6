#pragma once
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace repose::base {

/// Value of an environment variable by its name, or null where it is not set.
using Environment = std::function<const char*(const char* name)>;

/// Returns the variables, as (name, value), that keep Open MPI (OMPI_, 4; PRTE_, 5) from probing
/// the network before a run on one machine, which takes most of a short run's time. A program
/// started without mpirun also needs no daemon beside it. Where ranks are on several machines, or
/// who started them does not say, the choice of network is left alone. `filtered` says that a
/// filter of system calls is on, as in a container: ranks may not read each other's memory then.
std::vector<std::pair<std::string, std::string>> mpi_variables(const Environment& environment,
                                                               bool filtered);

/// Sets mpi_variables() for MPI_Init; those that the user set stay. Not collective.
void set_mpi_variables();

}  // namespace repose::base
