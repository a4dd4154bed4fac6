#pragma once
#include <mpi.h>

#include <filesystem>
#include <memory>
#include <string_view>

#include "repose/model/model.h"
#include "repose/model/step.h"

namespace repose::results {

/// Kind of a file: the end of a run, or a state on the way from which a run can be resumed.
enum class Kind { result, checkpoint };

/// Why a run ended whose last step is a rest position on the way to load 1.
inline constexpr std::string_view stopped_at_rest = "stopped before it was done, at rest so far";

/// Writes NAME.h5 in parallel: to a part file of its own first, renamed by commit(). Destroyed
/// without commit(), the part is removed: the result is complete or absent. All members but save()
/// are collective. Between two calls the part is closed and readable, so that save() can take it as
/// it is. A folder that is missing or not writable and a full disk are an InputError on all
/// ranks. The file's bytes do not depend on the number of ranks, but for what tells of it: datasets
/// are contiguous (chunks with parallel gzip took twelve times as long for 28 % less space).
class ResultFile {
 public:
  /// Opens the part of NAME.h5 (`name` is a path without the ending) and writes /model:
  /// `global_metadata`, on rank 0, has what is in no slab.
  ResultFile(MPI_Comm comm, const std::filesystem::path& name, const model::Model& global_metadata,
             const model::ModelRows& slabs, Kind kind = Kind::result);
  ~ResultFile();
  ResultFile(ResultFile&&) = delete;

  /// Appends one /step/NNNN. Each rank gives its slabs; the numbers are
  /// rank 0's. bone_surface/displacement f64 [P,3] holds how far the points of all bone surfaces in
  /// turn have gone at this load, bone_surface/points where they are; the latter only if any moved.
  void append(const model::StepNumbers& numbers, const model::StepRows& rows);

  /// Begins with the first `count` steps of an earlier result of the same model. Before any append.
  void keep(const std::filesystem::path& earlier, int64_t count);

  /// Writes a step that has not converged and that the next append replaces.
  void append_provisional(const model::StepNumbers& numbers, const model::StepRows& rows);

  /// Makes the part, as it was between the latest two calls, NAME.h5, with its XDMF files: at once,
  /// on rank 0 only and from any thread. Its last step says that it has not converged, and of a
  /// rest position at a load below 1 `stopped_at_rest`. What is appended later goes to a copy.
  /// Returns whether there was a step to save; where there was none, the first one is saved as soon
  /// as it is written.
  bool save() noexcept;

  /// The path has ended: a last step at a load below 1 says that it has not converged, as in
  /// save(). fsyncs, renames to NAME.h5 and writes NAME_tissue.xdmf, NAME_springs.xdmf,
  /// NAME_skin.xdmf and NAME_bones.xdmf (each a part, then renamed) for what the model has; one of
  /// an earlier run that would describe nothing is removed, as is NAME_given_skin.vtp. Nothing may
  /// be appended afterwards.
  void commit();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace repose::results
