#include "contact_pressures.h"

#include <limits>
#include <tuple>
#include <utility>

namespace repose::solve {

void set_pressures(discrete::Objective& objective, const std::vector<Vec3>& pressure) {
  mechanics::TouchLoop& touches = objective.touches();
  const auto position = objective.positions().local();
  std::vector<double> least(pressure.size(), std::numeric_limits<double>::infinity());
  std::vector<double*> nearest(pressure.size(), nullptr);
  std::vector<double> multiplier(touches.multipliers().size(), 0.0);
  const auto offer = [&](int64_t point, double gap, double& to) {
    if (gap < least[point]) std::tie(least[point], nearest[point]) = std::pair(gap, &to);
  };
  touches.look_at_all(position);
  for (size_t c = 0; c < multiplier.size(); ++c)
    offer(touches.touches().point[c], touches.gaps()[c], multiplier[c]);
  mechanics::WallLoop& walls = objective.walls();
  std::vector<double> wall_multiplier(walls.size(), 0.0);
  walls.look(position);
  for (size_t w = 0; w < walls.size(); ++w) offer(walls.point(w), walls.gap(w), wall_multiplier[w]);
  for (size_t i = 0; i < pressure.size(); ++i)
    if (nearest[i]) *nearest[i] = pressure[i].x();
  touches.set_multipliers(multiplier);
  walls.set_multipliers(wall_multiplier);
}

}  // namespace repose::solve
