#pragma once
#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "job.h"
#include "repose/adapt/grid_sequence.h"
#include "repose/results/result_file.h"
#include "repose/solve/repose.h"

namespace repose::app {

/// Result of coarser models.
struct Coarser {
  std::string report;                           ///< on rank 0
  std::optional<adapt::GridSequence> compared;  ///< with the scene's own model, where requested
  std::optional<double> discretization_error;   ///< mm, of the model that was chosen, if one was
  bool misses_continuum = false;  ///< that is more than was requested of -adapt; on all ranks
};

/// Writes every step to the result, and from time to time what was reached to a checkpoint. All
/// members that write or gather are collective.
class Writer {
 public:
  /// `job` is distributed. `interval` in s between checkpoints, 0 for none; `unsettled`: why not
  /// even a rest position at load 1 is the end, or empty.
  Writer(MPI_Comm comm, const std::filesystem::path& name, const Job& job, const Coarser& coarser,
         double interval, std::string unsettled);

  void operator()(model::StepNumbers numbers, model::StepRows rows);
  /// At an iteration of a search.
  void on_iterate(double load, const solve::StateSnapshot& snapshot);
  /// Begins with steps of an earlier result.
  void keep(const std::filesystem::path& earlier, int64_t count);
  void commit() { file_.commit(); }
  /// Makes what is written so far the result, at once. On rank 0, from any thread. Returns whether
  /// there was anything to save.
  bool save() { return file_.save(); }

  bool makes_checkpoints() const { return checkpoints_.interval > 0; }
  const std::string& unsettled() const { return unsettled_; }
  /// Row of the summary about the discretization error, where coarser models are compared; on rank
  /// 0.
  const std::string& comparison() const { return comparison_; }
  /// mm, estimate of the last step; negative without one. On rank 0.
  double discretization_error() const {
    const double error = last_.numbers.discretization_error;
    return std::isnan(error) ? -1 : error;
  }
  /// This rank's slabs of the positions and volume ratios at the last step.
  const std::vector<Vec3>& slab() const { return last_.rows.position; }
  const std::vector<double>& volume_ratio() const { return last_.rows.volume_ratio; }
  /// [N] of the last step, on rank 0.
  std::vector<Vec3> positions() const;
  /// [N] N/mm², or nothing where tissue touches nothing; likewise.
  std::vector<double> contact_pressures() const;
  /// This rank's rows of what else is known of the points at the last step.
  const std::vector<model::PointField>& point_fields() const { return last_.rows.point_fields; }
  /// Describes the reaction forces on the instruments in the last step, on rank 0.
  std::string reactions() const;

 private:
  struct Step {
    model::StepNumbers numbers;
    model::StepRows rows;
  };
  struct Checkpoints {
    double interval;                   // s
    double written = MPI_Wtime();      // the last one
    std::optional<Step> reached = {};  // where they are made: the last rest position, …
    bool saved = false;                // … and whether a checkpoint has it
  };
  results::ResultFile open(const std::string& ending, results::Kind kind) const;
  void compare(model::StepNumbers& numbers, model::StepRows& rows);
  bool due() const;
  void write_checkpoint(const solve::StateSnapshot& snapshot);

  MPI_Comm comm_;
  std::filesystem::path name_;
  const Job& job_;
  const Coarser& coarser_;
  std::string comparison_, unsettled_;
  results::ResultFile file_;
  bool begun_ = false;  // the file holds a step of this run
  Step last_;           // the rows that reactions and those above need
  Checkpoints checkpoints_;
};

}  // namespace repose::app
