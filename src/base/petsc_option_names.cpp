#include "petsc_option_names.h"

#include <sstream>
#include <string>

namespace repose::base {

namespace {

/// First words of the options in libpetsc 3.18 and 3.22, and the prefixes of nested solvers;
/// SLEPc's too.
constexpr const char* prefixes =
    "adaptor_ ao_ blas_ bv_ coarse_ convest_ da_ debugger_ device_ dll_ dm_ dmcomposite_ "
    "dmnetwork_ dmplex_ dmsnes_ dmts_ draw_ drawaxis_ ds_ eps_ error_output_ esteig_ fas_ "
    "fieldsplit_ gdsw_ glvis_ info_ inner_ is_ islocaltoglobalmapping ksp_ lg_ log_ "
    "malloc_ mat_ matconvert_ matden2sp_ matis_ matload_ matmatmatmult_ matmatmult_ "
    "matmattransmult_ matptap_ matrart_ matstash_ mattransposematmult_ memory_ mg_ mpi_ "
    "mumps_ nox_ on_error_ options_ pc_ petsc pf_ prefix_ psubcomm_ random_ redundant_ "
    "saws_ sf_ slepc_ snes_ splitreduction_ ssls_ st_ sub_ tao_ telescope_ ts_ vec_ "
    "vecload_ vecscatter_ vecstash_ viewer_ viewfromoptions";

/// Whole names.
constexpr const char* names =
    "build_twosided check_pointer_intensity checkfunctionlist checkstack citations "
    "debug_terminal default_device_type disable_sse display fp_trap geometry "
    "get_total_flops history info library_preload log malloc mpidump no_signal_handler "
    "noshared nox objects_dump popen_machine python skip_petscrc start_in_debugger "
    "stop_for_debugger use_gpu_aware_mpi version x_virtual";

template <class Predicate>
bool any_word(const char* words, Predicate&& satisfies) {
  std::istringstream stream(words);
  for (std::string word; stream >> word;)
    if (satisfies(word)) return true;
  return false;
}

}  // namespace

bool begins_as_petsc(std::string_view name) {
  return any_word(prefixes, [&](const std::string& prefix) { return name.starts_with(prefix); }) ||
         any_word(names, [&](const std::string& whole) { return name == whole; });
}

}  // namespace repose::base
