#pragma once
#include <mpi.h>

#include <filesystem>
#include <string>
#include <vector>

#include "job.h"
#include "repose/solve/repose.h"
#include "self_contact.h"

/// Parts of the end-of-run summary about the face that a job ends with. `now` are the points of its
/// skin.
namespace repose::app {

/// First lines: movement of the face, lips, accuracy (`discretization` is the mesh's share, mm;
/// negative: unknown), and warnings. On rank 0.
std::string describe_answer(const Job& job, const SolvedSkin& skin, const std::vector<Vec3>& now,
                            const solve::Summary& summary, double discretization);

/// Rows for the warnings of a job: of its input, and of its moves. On rank 0.
std::string describe_warnings(const Job& job);

/// Describes the number of prisms that are inside out, `folded`, and where the worst one was at
/// first, in a line that says what can be done; nothing where there is none. `volume_ratio` is this
/// rank's slab. Collective.
std::string describe_folds(MPI_Comm comm, const discrete::Part& part, int64_t folded,
                           const std::vector<double>& volume_ratio);

/// Last rows: contact, columns that are pierced, and bone or skin that comes through the skin. On
/// rank 0.
std::string describe_touching(const Job& job, const SolvedSkin& skin, const std::vector<Vec3>& now,
                              const solve::Summary& summary);

/// Line on a search that failed, as that of report.h.
std::string describe_failure(const Job& job, const solve::Summary& summary);

}  // namespace repose::app
