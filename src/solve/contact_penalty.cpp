#include "contact_penalty.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "repose/base/collective.h"

namespace repose::solve {

void ContactPenalty::set_stiffness(double stiffness) {
  objective_.contact().bodies().set_stiffness(stiffness);
  objective_.contact().cut_faces().set_stiffness(stiffness);
  tangent_.forget_contact();
}

ContactPressures ContactPenalty::multipliers() const {
  const auto p = objective_.contact().bodies().multipliers(),
             q = objective_.contact().cut_faces().multipliers();
  return {{p.begin(), p.end()}, {q.begin(), q.end()}};
}

void ContactPenalty::set_multipliers(const ContactPressures& to) {
  const auto resized = [](std::vector<double> pressures, size_t size) {
    pressures.resize(size, 0.0);
    return pressures;
  };
  objective_.contact().bodies().set_multipliers(
      resized(to.bodies, objective_.contact().bodies().multipliers().size()));
  objective_.contact().cut_faces().set_multipliers(
      resized(to.cut_faces, objective_.contact().cut_faces().size()));
  tangent_.forget_contact();
}

double ContactPenalty::violation() {
  mechanics::BodyContact& bodies = objective_.contact().bodies();
  bodies.update_gaps(objective_.positions().local());
  double maximum = 0;
  for (size_t c = 0; c < bodies.multipliers().size(); ++c)
    maximum = std::max(maximum, std::abs(bodies.pressure(c) - bodies.multipliers()[c]));
  mechanics::CutFaceContact& cut_faces = objective_.contact().cut_faces();
  cut_faces.update_gaps(objective_.positions().local());
  for (size_t w = 0; w < cut_faces.size(); ++w)
    maximum = std::max(maximum, std::abs(cut_faces.pressure(w) - cut_faces.multipliers()[w]));
  return base::max_over_ranks(objective_.positions().comm(), maximum / bodies.stiffness());
}

void ContactPenalty::move_multipliers() {
  mechanics::BodyContact& bodies = objective_.contact().bodies();
  std::vector<double> pressure(bodies.multipliers().size());
  for (size_t c = 0; c < pressure.size(); ++c) pressure[c] = bodies.pressure(c);
  bodies.set_multipliers(pressure);
  mechanics::CutFaceContact& cut_faces = objective_.contact().cut_faces();
  pressure.resize(cut_faces.size());
  for (size_t w = 0; w < pressure.size(); ++w) pressure[w] = cut_faces.pressure(w);
  cut_faces.set_multipliers(pressure);
}

void set_pressures(discrete::Objective& objective, const std::vector<Vec3>& pressure) {
  mechanics::BodyContact& body_contact = objective.contact().bodies();
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
  mechanics::CutFaceContact& cut_faces = objective.contact().cut_faces();
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
  mechanics::BodyContact& body_contact = objective.contact().bodies();
  const auto position = objective.positions().local();
  body_contact.update_gaps(position);
  double deepest = 0;
  for (const double gap : body_contact.gaps()) deepest = std::max(deepest, -gap);
  mechanics::CutFaceContact& cut_faces = objective.contact().cut_faces();
  cut_faces.update_gaps(position);
  for (size_t w = 0; w < cut_faces.size(); ++w) deepest = std::max(deepest, -cut_faces.gap(w));
  return base::max_over_ranks(objective.positions().comm(), deepest);
}

}  // namespace repose::solve
