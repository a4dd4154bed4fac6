#include "contact_penalty.h"

#include <algorithm>
#include <cmath>

#include "repose/base/collective.h"

namespace repose::solve {

void ContactPenalty::set_stiffness(double stiffness) {
  objective_.body_contact().set_stiffness(stiffness);
  objective_.cut_face_contact().set_stiffness(stiffness);
  tangent_.forget_contact();
}

ContactPressures ContactPenalty::multipliers() const {
  const auto p = objective_.body_contact().multipliers(),
             q = objective_.cut_face_contact().multipliers();
  return {{p.begin(), p.end()}, {q.begin(), q.end()}};
}

void ContactPenalty::set_multipliers(const ContactPressures& to) {
  const auto resized = [](std::vector<double> pressures, size_t size) {
    pressures.resize(size, 0.0);
    return pressures;
  };
  objective_.body_contact().set_multipliers(
      resized(to.bodies, objective_.body_contact().multipliers().size()));
  objective_.cut_face_contact().set_multipliers(
      resized(to.cut_faces, objective_.cut_face_contact().size()));
  tangent_.forget_contact();
}

double ContactPenalty::violation() {
  mechanics::BodyContact& bodies = objective_.body_contact();
  bodies.update_gaps(objective_.positions().local());
  double maximum = 0;
  for (size_t c = 0; c < bodies.multipliers().size(); ++c)
    maximum = std::max(maximum, std::abs(bodies.pressure(c) - bodies.multipliers()[c]));
  mechanics::CutFaceContact& cut_faces = objective_.cut_face_contact();
  cut_faces.update_gaps(objective_.positions().local());
  for (size_t w = 0; w < cut_faces.size(); ++w)
    maximum = std::max(maximum, std::abs(cut_faces.pressure(w) - cut_faces.multipliers()[w]));
  return base::max_over_ranks(objective_.positions().comm(), maximum / bodies.stiffness());
}

void ContactPenalty::move_multipliers() {
  mechanics::BodyContact& bodies = objective_.body_contact();
  std::vector<double> pressure(bodies.multipliers().size());
  for (size_t c = 0; c < pressure.size(); ++c) pressure[c] = bodies.pressure(c);
  bodies.set_multipliers(pressure);
  mechanics::CutFaceContact& cut_faces = objective_.cut_face_contact();
  pressure.resize(cut_faces.size());
  for (size_t w = 0; w < pressure.size(); ++w) pressure[w] = cut_faces.pressure(w);
  cut_faces.set_multipliers(pressure);
}

}  // namespace repose::solve
