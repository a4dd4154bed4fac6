#include "tools/check/check_contact.h"

#include "../surface/shapes.h"

namespace repose::tools::check {
namespace check_contact_test {

/// Returns whether `stated` is taken as the exact penetration, mm, of a point that goes from one
/// depth below a face of a cube of triangles to another.
bool is_accepted(double stated, double depth_before, double depth) {
  model::Model model;
  model.points.position = {{50, 50, depth_before}};
  model.points.set = {model::PointSet::soft_tissue};
  model.points.target = model.points.position;
  model.points.bone = {-1};
  model.contact.bodies = {{"cube", -1, surface::cube()}};
  model.contact.pairs = {{0}, {0}, {model::Binding::touches}, {1.0}};
  model::StepNumbers numbers;
  numbers.penetration_exact = stated;
  model::StepRows rows;
  rows.position = {{50, 50, depth}};
  rows.point_fields = {{"contact_gap", false, {0}},
                       {"contact_pressure", false, {0}},
                       {"contact_force", true, {0, 0, 0}}};
  Comparison comparison(1e-9);
  check_contact(model, model::PrescribedMotion(model), numbers, rows, comparison);
  return comparison.table().find("penetration_exact: stated") == std::string::npos;
}

TEST(CheckContact, MeasuresPenetrationAtAnyDepth) {
  for (const auto& [before, now] : {std::pair{-1.0, 7.0}, {-1.0, 12.0}, {3.0, 12.0}, {9.0, 9.5}}) {
    const double deeper = now - std::max(before, 0.0);
    EXPECT_TRUE(is_accepted(deeper, before, now)) << before << " mm to " << now;
    EXPECT_FALSE(is_accepted(deeper + 1e-5, before, now)) << before << " mm to " << now;
  }
}

}  // namespace check_contact_test
}  // namespace repose::tools::check
