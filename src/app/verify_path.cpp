#include "verify_path.h"

#include <algorithm>

#include "repose/base/agreement.h"
#include "repose/discrete/gather.h"

namespace repose::app {

namespace {

/// On rank 0.
void compare(const model::Model& model, const std::vector<Vec3>& one,
             const std::vector<Vec3>& other, PathCheck& check) {
  std::vector<double> apart;
  for (size_t i = 0; i < one.size(); ++i) {
    if (model.points.set[i] != model::PointSet::soft_tissue) continue;
    apart.push_back((other[i] - one[i]).norm());
    if (apart.back() < check.largest) continue;
    check.largest = apart.back();
    check.place = model.points.position[i];
  }
  const auto at = apart.begin() + static_cast<std::ptrdiff_t>(0.95 * (apart.size() - 1));
  std::nth_element(apart.begin(), at, apart.end());
  check.percentile_95 = *at;
}

}  // namespace

PathCheck verify_path(MPI_Comm comm, const model::Model& model, solve::Settings settings,
                      const solve::Summary& first, const std::vector<Vec3>& position) {
  PathCheck check;
  check.steps = first.path.steps - 1;  // without that to the initial state
  check.allowed = 2 * settings.path.accuracy;
  check.objective = first.last.objective;
  if (check.steps == 0) return check;
  settings.path.load_steps = static_cast<int>(2 * check.steps);
  settings.path.ends_along = true;
  settings.stability = false;
  settings.finds_other_rest = false;
  settings.stages = nullptr;
  std::vector<Vec3> slab;
  check.again = solve::find_repose(
      comm, model, settings, {},
      [&](const model::StepNumbers&, const model::StepRows& rows) { slab = rows.position; });
  const std::vector<Vec3> other = discrete::gather_points(comm, slab);
  if (!check.again.path.complete()) return check;
  base::on_root(comm, [&] { compare(model, position, other, check); });
  MPI_Bcast(&check.largest, 1, MPI_DOUBLE, 0, comm);
  return check;
}

}  // namespace repose::app
