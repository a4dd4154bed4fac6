#include "contact_pressures.h"

#include <algorithm>
#include <limits>
#include <tuple>
#include <utility>

#include "repose/base/collective.h"

namespace repose::solve {

void set_pressures(discrete::Objective& objective, const std::vector<Vec3>& pressure) {
  mechanics::BodyContact& body_contact = objective.body_contact();
  const auto position = objective.positions().local();
  std::vector<double> minimum(pressure.size(), std::numeric_limits<double>::infinity());
  std::vector<double*> nearest(pressure.size(), nullptr);
  std::vector<double> multiplier(body_contact.multipliers().size(), 0.0);
  const auto offer = [&](int64_t point, double gap, double& to) {
    if (gap < minimum[point]) std::tie(minimum[point], nearest[point]) = std::pair(gap, &to);
  };
  const auto presses = [&](int64_t point) { return pressure[point].x() != 0; };
  for (size_t c = 0; c < multiplier.size(); ++c)
    if (const int64_t point = body_contact.pairs().point[c]; presses(point))
      offer(point, body_contact.measure_gap(c, position), multiplier[c]);
  mechanics::CutFaceContact& cut_faces = objective.cut_face_contact();
  std::vector<double> wall_multiplier(cut_faces.size(), 0.0);
  cut_faces.update_gaps(position);
  for (size_t w = 0; w < cut_faces.size(); ++w)
    if (presses(cut_faces.point(w)))
      offer(cut_faces.point(w), cut_faces.gap(w), wall_multiplier[w]);
  for (size_t i = 0; i < pressure.size(); ++i)
    if (nearest[i]) *nearest[i] = pressure[i].x();
  body_contact.set_multipliers(multiplier);
  cut_faces.set_multipliers(wall_multiplier);
}

double penetration(discrete::Objective& objective) {
  mechanics::BodyContact& body_contact = objective.body_contact();
  const auto position = objective.positions().local();
  body_contact.update_gaps(position);
  double deepest = 0;
  for (const double gap : body_contact.gaps()) deepest = std::max(deepest, -gap);
  mechanics::CutFaceContact& cut_faces = objective.cut_face_contact();
  cut_faces.update_gaps(position);
  for (size_t w = 0; w < cut_faces.size(); ++w) deepest = std::max(deepest, -cut_faces.gap(w));
  return base::max_over_ranks(objective.positions().comm(), deepest);
}

}  // namespace repose::solve
