#include "skin_on_bone.h"

#include "repose/base/agreement.h"

namespace repose::solve {

SkinOnBone find_skin_on_bone(discrete::Objective& objective) {
  const discrete::Positions& positions = objective.positions();
  const discrete::Part& part = positions.part();
  SkinOnBone found;
  if (!part.contact) return found;
  mechanics::BodyContact& contact = objective.contact().bodies();
  contact.update_gaps(positions.local());
  for (size_t c = 0; c < contact.gaps().size(); ++c) {
    const auto point = contact.pairs().point[c];
    const int32_t body = contact.pairs().body[c];
    const double pressure = contact.pressure(c);
    if (pressure == 0 || part.model.points.layer[point] != 0 || contact.bodies()[body].bone() < 0)
      continue;
    ++found.points;
    if (pressure <= found.pressure) continue;
    found = {found.points, body, pressure, positions.local()[point]};
  }
  found.points = base::sum_over_ranks(positions.comm(), found.points);
  found.pressure =
      base::max_over_ranks_with(positions.comm(), found.pressure, found.body, found.where);
  return found;
}

}  // namespace repose::solve
