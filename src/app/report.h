#pragma once
#include <fmt/format.h>

#include <string>
#include <utility>

#include "repose/adapt/grid_sequence.h"
#include "repose/model/build.h"
#include "repose/solve/prestress.h"
#include "repose/solve/repose.h"
#include "repose/solve/tearing.h"

/// End-of-run summary.
namespace repose::app {

/// Formats a name and its text as one row.
std::string report_row(const std::string& name, const std::string& value);
template <class... Values>
std::string report_row(const std::string& name, fmt::format_string<Values...> format,
                       Values&&... values) {
  return report_row(name, fmt::format(format, std::forward<Values>(values)...));
}

/// Points, springs and prisms of a model, by set. Lines ending in a newline.
std::string describe_model(const model::Counts& counts);

/// Describes the built model: skin, columns, thickness, attachment, remarks.
std::string describe_build(const model::SkinMesh& skin, const model::BuildReport& report);
/// Rows for the implausible properties of the anatomy.
std::string describe_warnings(const std::vector<std::string>& warnings);
/// An incision and how many points it doubled.
std::string describe_cut(const model::Cut& cut, int64_t doubled);

/// The initial equilibrium in one row.
std::string describe_prestress(const solve::Prestress& prestress);

/// Describes the number of points that each instrument holds, and the force (N) with which the
/// tissue pushes on it.
std::string describe_reactions(const std::vector<std::vector<int64_t>>& held,
                               const std::vector<Vec3>& forces);

/// Describes contact at the end: one row for each named body pressed on, and the depth to which
/// anything passes.
std::string describe_contact(const std::vector<std::string>& bodies, const solve::Summary& s);

/// Describes columns of tissue that bones or instruments have entered; empty if there is none.
std::string describe_pierced(const std::vector<std::string>& bodies, const solve::Summary& s);

/// Describes torn springs in two rows; empty without a limit.
std::string describe_tearing(const solve::Tearing& tearing);

/// Comparison of the rest position with that of twice the load steps.
struct PathCheck {
  int64_t steps = 0;          ///< of the first run; 0: nothing moves
  bool springs = false;       ///< of the tissue, not a solid
  double allowed = 0;         ///< mm, that two searches for one rest position may differ by
  double objective = 0;       ///< of the first run
  solve::Summary again;       ///< the second run
  double largest = 0;         ///< mm, between the two, of all soft-tissue points
  double percentile_95 = 0;   ///< likewise; on rank 0
  Vec3 place = Vec3::Zero();  ///< initial, of the largest; on rank 0
  bool holds() const { return steps == 0 || (again.path.complete() && largest <= allowed); }
};

/// Describes the comparison in one row.
std::string describe_path(const PathCheck& check);

/// Wall time (largest over ranks) and peak memory (summed over ranks) of each stage.
std::string describe_stages(const base::Stages& stages);

/// Describes a run that was interrupted and the state that it saved.
std::string describe_saved(const std::string& name);

/// A result, of which `end` is the last step, that a run to `accuracy` mm has nothing to add to.
std::string describe_finished(const std::string& file, const model::StepNumbers& end,
                              double accuracy, bool folded);

/// One-line failure message with a remedy; empty on success.
/// `stretched`: it began in an initial equilibrium; `adheres`: lips adhere to teeth; `options`: of
/// PETSc, which the search was given.
std::string describe_failure(const solve::Summary& summary, bool stretched, bool adheres,
                             const std::string& options);

/// Describes the end of a run: load, accuracy, reason, work, inverted prisms, and time and memory
/// of each stage.
std::string describe_run(const solve::Summary& summary, const solve::Settings& settings, int ranks,
                         const base::Stages& stages);

/// Lines of the closing table about a nested iteration; only rank 0 has them.
std::string describe_sequence(const adapt::GridSequence& sequence);

/// A line about the last model of a sequence where it was solved in place of the scene's own, to
/// `requested` mm: its distance from the scene's own or, of a convergence study, whose `limit`
/// (adapt::Convergence) keeps it from finer models, from the continuum. Only rank 0 has it.
std::string describe_choice(const adapt::GridSequence& sequence, double requested,
                            const std::string* limit);

}  // namespace repose::app
