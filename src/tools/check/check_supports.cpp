#include "check_supports.h"

#include <fmt/format.h>

#include <set>

namespace repose::tools::check {

namespace {

constexpr int64_t number_count = 5;  // the place (3), the stiffness, the bone

bool has_shape(const model::TermElements& supports) {
  return supports.points_each == 1 && supports.numbers_each == number_count &&
         supports.bone_number == number_count - 1;
}

/// Returns the first defect of the supports; empty if there is none.
std::string first_wrong(const model::Model& model, const model::TermElements& supports) {
  const model::Points& points = model.points;
  std::set<int64_t> seen;
  for (size_t e = 0; e < supports.size(); ++e) {
    const int64_t point = supports.points_of(e)[0];
    const auto numbers = supports.numbers_of(e);
    if (!seen.insert(point).second) return fmt::format("point {} is supported twice", point);
    if (points.set[point] != model::PointSet::soft_tissue)
      return fmt::format("point {} is supported, but is no soft tissue", point);
    if (Vec3(numbers[0], numbers[1], numbers[2]) != points.position[point])
      return fmt::format("point {} is supported elsewhere than it begins", point);
    if (!(numbers[3] > 0))
      return fmt::format("point {} is supported with {:g} N/mm", point, numbers[3]);
  }
  return "";
}

}  // namespace

std::vector<PointForce> evaluate_supports(const model::Model& model,
                                          const model::PrescribedMotion& motion, double load,
                                          const std::vector<Vec3>& position) {
  std::vector<PointForce> forces;
  const model::TermElements* supports = elements_of(model, "elastic_support");
  if (!supports || !has_shape(*supports)) return forces;
  for (size_t e = 0; e < supports->size(); ++e) {
    const int64_t point = supports->points_of(e)[0];
    const auto numbers = supports->numbers_of(e);
    const Mat4 pose = motion.bone_matrix(static_cast<int32_t>(numbers[4]), load);
    const Vec3 place = pose.topLeftCorner<3, 3>() * Vec3(numbers[0], numbers[1], numbers[2]) +
                       pose.topRightCorner<3, 1>();
    const Vec3 way = position[point] - place;
    forces.push_back({point, numbers[3] * way.squaredNorm() / 2, -numbers[3] * way,
                      numbers[3] * position[point].lpNorm<Eigen::Infinity>()});
  }
  return forces;
}

void check_supports(const model::Model& model, Comparison& comparison) {
  const model::TermElements* supports = elements_of(model, "elastic_support");
  if (!supports) return;
  comparison.statement(
      "elements of elastic_support have 1 point and 5 numbers, of which the last is the bone",
      has_shape(*supports));
  if (!has_shape(*supports)) return;
  const std::string wrong = first_wrong(model, *supports);
  comparison.statement(wrong.empty() ? "elastic supports hold points where they begin" : wrong,
                       wrong.empty());
}

}  // namespace repose::tools::check
