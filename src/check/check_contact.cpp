#include "check_contact.h"

#include <algorithm>
#include <cmath>

#include "repose/mechanics/rigid_body.h"
#include "repose/mechanics/wall_contact.h"

namespace repose::check {

namespace {

const std::vector<double>* field(const model::StepRows& rows, const char* name) {
  for (const model::PointField& field : rows.point_fields)
    if (field.name == name) return &field.values;
  return nullptr;
}

/// What one point touches.
struct AtPoint {
  double gap = 6;  // mm, the smallest; what is looked at where there is none
  int near = 0;    // bodies that may press
  bool slides = false;
  bool wall = false;  // it is on the side of a cut
  double area = 0;    // mm², of the constraint with the smallest gap
  Vec3 normal = Vec3::Zero();
};

std::vector<AtPoint> look(const model::Model& model, const model::PrescribedMotion& motion,
                          double load, const std::vector<Vec3>& position, double slack) {
  const model::Touches& touches = model.contact.touches;
  std::vector<mechanics::RigidBody> bodies = mechanics::make_bodies(model);
  const std::vector<double> offset = mechanics::touch_offsets(model, bodies);
  mechanics::place_bodies(
      load, [&](int32_t bone) { return motion.bone_matrix(bone, load); }, bodies);
  std::vector<AtPoint> at(position.size());
  for (size_t c = 0; c < touches.point.size(); ++c) {
    AtPoint& point = at[touches.point[c]];
    const mechanics::RigidBody& body = bodies[touches.body[c]];
    const surface::Distance d = body.distance(body.beside(position[touches.point[c]]));
    const double gap = d.value - offset[c];
    const bool slides = touches.binding[c] == model::Binding::slides;
    point.slides = point.slides || slides;
    point.near += slides || gap <= slack;
    if (gap > point.gap) continue;
    point.gap = gap;
    point.area = touches.area[c];
    point.normal = d.gradient;
  }
  for (const int64_t p : model.contact.walls.point) at[p].wall = true;
  mechanics::WallLoop walls(model.contact.walls, model.contact.stiffness);
  walls.look(position);
  for (size_t w = 0; w < walls.size(); ++w)
    at[walls.point(w)].gap = std::min(at[walls.point(w)].gap, walls.gap(w));
  return at;
}

}  // namespace

void check_contact(const model::Model& model, const model::PrescribedMotion& motion,
                   const model::StepNumbers& numbers, const model::StepRows& rows,
                   base::Comparison& comparison) {
  if (model.contact.empty()) return;
  const auto *gap = field(rows, "contact_gap"), *pressure = field(rows, "contact_pressure"),
             *force = field(rows, "contact_force");
  comparison.statement("contact_gap, contact_pressure and contact_force are there",
                       gap && pressure && force);
  if (!gap || !pressure || !force) return;
  const double slack = std::max(1e-9, numbers.displacement_error);
  const std::vector<AtPoint> at = look(model, motion, numbers.load, rows.position, slack);
  std::vector<double> gaps, gaps_again, forces, forces_again;
  double pull = 0, across = 0, deepest = 0, largest = 0;
  for (size_t i = 0; i < at.size(); ++i) {
    const double p = (*pressure)[i];
    if (!at[i].slides) pull = std::max(pull, -p);
    if (p > 0 && !at[i].slides) across = std::max(across, (*gap)[i]);
    deepest = std::max(deepest, -at[i].gap);
    gaps.push_back((*gap)[i]);
    gaps_again.push_back(at[i].gap);
    if (at[i].wall || at[i].near != 1 || at[i].area == 0) continue;
    for (int a = 0; a < 3; ++a) {
      forces.push_back((*force)[3 * i + a]);
      forces_again.push_back(p * at[i].area * at[i].normal[a]);
      largest = std::max(largest, std::abs(forces.back()));
    }
  }
  comparison.array("point/contact_gap", gaps, gaps_again, 6);
  comparison.array("point/contact_force", forces, forces_again, largest);
  comparison.statement("contact only presses", pull <= 0);
  comparison.statement("pressure is where gaps are closed", across <= slack);
  comparison.statement("nothing is deeper than the penetration",
                       deepest <= numbers.penetration * (1 + 1e-6) + 1e-9);
}

}  // namespace repose::check
