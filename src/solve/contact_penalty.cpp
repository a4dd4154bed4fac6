#include "contact_penalty.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "repose/base/collective.h"

namespace repose::solve {

void ContactPenalty::set_stiffness(double stiffness) {
  objective_.contact().set_stiffness(stiffness);
  tangent_.forget_contact();
}

void ContactPenalty::set_multipliers(const discrete::ContactPressures& to) {
  objective_.contact().set_multipliers(to);
  tangent_.forget_contact();
}

double ContactPenalty::violation() {
  discrete::Contact& contact = objective_.contact();
  contact.update_gaps();
  const discrete::ContactPressures now = contact.pressures(), before = contact.multipliers();
  double maximum = 0;
  for (size_t c = 0; c < now.bodies.size(); ++c)
    maximum = std::max(maximum, std::abs(now.bodies[c] - before.bodies[c]));
  for (size_t w = 0; w < now.cut_faces.size(); ++w)
    maximum = std::max(maximum, std::abs(now.cut_faces[w] - before.cut_faces[w]));
  return base::max_over_ranks(objective_.positions().comm(), maximum / contact.stiffness());
}

void ContactPenalty::move_multipliers() {
  objective_.contact().update_gaps();
  objective_.contact().set_multipliers(objective_.contact().pressures());
}

void set_pressures(discrete::Objective& objective, const std::vector<double>& pressure) {
  mechanics::BodyContact& bodies = objective.contact().bodies();
  mechanics::CutFaceContact& cut_faces = objective.contact().cut_faces();
  const auto position = objective.positions().local();
  std::vector<double> minimum(pressure.size(), std::numeric_limits<double>::infinity());
  std::vector<double*> nearest(pressure.size(), nullptr);
  discrete::ContactPressures multiplier{std::vector<double>(bodies.multipliers().size(), 0.0),
                                        std::vector<double>(cut_faces.size(), 0.0)};
  const auto offer = [&](int64_t point, double gap, double& to) {
    if (gap < minimum[point]) std::tie(minimum[point], nearest[point]) = std::pair(gap, &to);
  };
  for (size_t c = 0; c < multiplier.bodies.size(); ++c)
    if (const int64_t point = bodies.pairs().point[c]; pressure[point] != 0)
      offer(point, bodies.measure_gap(c, position), multiplier.bodies[c]);
  cut_faces.update_gaps(position);
  for (size_t w = 0; w < cut_faces.size(); ++w)
    if (pressure[cut_faces.point(w)] != 0)
      offer(cut_faces.point(w), cut_faces.gap(w), multiplier.cut_faces[w]);
  for (size_t i = 0; i < pressure.size(); ++i)
    if (nearest[i]) *nearest[i] = pressure[i];
  objective.contact().set_multipliers(std::move(multiplier));
}

double penetration(discrete::Objective& objective) {
  objective.contact().update_gaps();
  double deepest = 0;
  for (const double gap : objective.contact().bodies().gaps()) deepest = std::max(deepest, -gap);
  const mechanics::CutFaceContact& cut_faces = objective.contact().cut_faces();
  for (size_t w = 0; w < cut_faces.size(); ++w) deepest = std::max(deepest, -cut_faces.gap(w));
  return base::max_over_ranks(objective.positions().comm(), deepest);
}

}  // namespace repose::solve
