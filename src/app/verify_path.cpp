#include "verify_path.h"

#include <algorithm>

#include "repose/base/agreement.h"
#include "repose/base/collective.h"
#include "repose/discrete/natural_rows.h"

namespace repose::app {

namespace {

/// Compares two positions, this rank's slabs. Collective.
void compare(MPI_Comm comm, const discrete::Part& part, const std::vector<Vec3>& one,
             const std::vector<Vec3>& other, PathCheck& check) {
  const discrete::NaturalRows natural(comm, part);
  const std::vector<Vec3> before = natural.owned(one), after = natural.owned(other);
  std::vector<double> mine;
  for (size_t i = 0; i < before.size(); ++i) {
    if (part.model.points.set[i] != model::PointSet::soft_tissue) continue;
    mine.push_back((after[i] - before[i]).norm());
    if (mine.back() < check.largest) continue;
    check.largest = mine.back();
    check.place = part.model.points.position[i];
  }
  check.largest = base::max_over_ranks_with(comm, check.largest, check.place);
  std::vector<double> apart = base::gather(comm, std::move(mine));
  if (apart.empty()) return;
  const auto at =
      apart.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(apart.size() - 1));
  std::nth_element(apart.begin(), at, apart.end());
  check.percentile_95 = *at;
}

}  // namespace

PathCheck verify_path(MPI_Comm comm, const discrete::Part& part, solve::Settings settings,
                      const solve::Summary& first, const std::vector<Vec3>& position) {
  PathCheck check;
  check.steps = first.path.steps;
  check.springs = !part.solid;
  check.allowed = 2 * settings.path.accuracy;
  check.objective = first.last.objective;
  if (check.steps == 0) return check;
  settings.path.load_steps = static_cast<int>(2 * check.steps);
  settings.path.ends_along = true;
  settings.stability = false;
  settings.finds_other_rest = false;
  settings.stages = nullptr;
  std::vector<Vec3> slab;
  check.again =
      solve::RestSolver(comm, part, settings)
          .find(settings, {}, [&](const model::StepNumbers&, const model::StepRows& rows) {
            slab = rows.position;
          });
  if (check.again.path.complete()) compare(comm, part, position, slab, check);
  return check;
}

}  // namespace repose::app
