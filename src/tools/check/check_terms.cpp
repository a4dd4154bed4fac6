#include "check_terms.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "obstacle.h"

namespace repose::tools::check {

namespace {

using model::AdhesionRule;
using model::Model;

/// z of the broken line from the right corner of the mouth over stomion to the left one, level
/// beyond its ends.
double lip_height(const std::array<Vec3, 3>& line, double x) {
  if (x <= line.front().x()) return line.front().z();
  for (size_t k = 1; k < line.size(); ++k) {
    const Vec3 &from = line[k - 1], &to = line[k];
    if (x > to.x()) continue;
    return from.z() + (x - from.x()) / (to.x() - from.x()) * (to.z() - from.z());
  }
  return line.back().z();
}

bool is_inside(const Vec3& point, const AdhesionRule::Jaw& jaw) {
  for (int a = 0; a < 3; ++a)
    if (point[a] < jaw.low[a] || point[a] > jaw.high[a]) return false;
  return true;
}

/// The rows of the points of the skin by their columns; of those that a cut doubles the first one.
std::map<int64_t, int64_t> skin_points(const Model& model) {
  std::map<int64_t, int64_t> row_of;
  for (size_t i = 0; i < model.points.layer.size(); ++i)
    if (model.points.layer[i] == 0)
      row_of.try_emplace(model.points.column[i], static_cast<int64_t>(i));
  return row_of;
}

/// The columns that cuts double: two of their points begin at one place.
std::set<int64_t> doubled_columns(const Model& model) {
  std::set<std::array<int64_t, 2>> seen;
  std::set<int64_t> doubled;
  for (size_t i = 0; i < model.points.column.size(); ++i)
    if (!seen.insert({model.points.column[i], model.points.layer[i]}).second)
      doubled.insert(model.points.column[i]);
  return doubled;
}

/// The difference of two sets of films as a statement, by the first point in one of them alone.
std::string difference(const std::map<int64_t, int32_t>& stored, const std::vector<Film>& films,
                       const Model& model) {
  std::map<int64_t, int32_t> own;
  for (const Film& film : films) own[film.point] = film.bone;
  for (const auto& [point, bone] : stored)
    if (!own.contains(point))
      return fmt::format("point {} adheres to '{}', but by its place it does not", point,
                         model.bones[bone]);
  for (const auto& [point, bone] : own) {
    const auto found = stored.find(point);
    if (found == stored.end())
      return fmt::format("point {} does not adhere, but by its place it does to '{}'", point,
                         model.bones[bone]);
    if (found->second != bone)
      return fmt::format("point {} adheres to '{}', but by its place to '{}'", point,
                         model.bones[found->second], model.bones[bone]);
  }
  return "";
}

void check_planes(const Model& model, const model::TermElements& elements,
                  const std::vector<Film>& films, Comparison& comparison) {
  const auto& x = model.points.position;
  std::vector<double> normals, own_normals, openings, tensions, own_tensions, ranges, own_ranges;
  double size = 0, nearest = model.adhesion->range, tension = 0;
  std::map<int64_t, size_t> element_of;
  for (size_t e = 0; e < elements.size(); ++e) element_of[elements.points_of(e)[0]] = e;
  for (const Film& film : films) {
    const size_t e = element_of.at(film.point);
    const auto numbers = elements.numbers_of(e);
    const Vec3 &at = x[film.point], normal(numbers[0], numbers[1], numbers[2]);
    for (int a = 0; a < 3; ++a) {
      normals.push_back(normal[a]);
      own_normals.push_back(film.normal[a]);
    }
    openings.push_back(normal.dot(at) - numbers[3]);
    tensions.push_back(numbers[4]);
    own_tensions.push_back(film.tension);
    ranges.push_back(numbers[5]);
    own_ranges.push_back(model.adhesion->range);
    size = std::max(size, at.lpNorm<Eigen::Infinity>());
    nearest = std::min(nearest, film.distance);
    tension = std::max(tension, film.tension);
  }
  constexpr double rounding = 1e-14, tolerance = 1e-9;
  comparison.array("adhesion, normals", normals, own_normals,
                   1 + rounding * size / nearest / tolerance);
  comparison.array("adhesion, initial openings", openings,
                   std::vector<double>(openings.size(), 0.0), size);
  comparison.array("adhesion, tensions", tensions, own_tensions, tension);
  comparison.array("adhesion, ranges", ranges, own_ranges, model.adhesion->range);
}

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

const model::TermElements* elements_of(const Model& model, const std::string& term) {
  const auto found = std::ranges::find(model.elements, term, &model::TermElements::term);
  return found == model.elements.end() ? nullptr : &*found;
}

std::vector<Film> find_films(const Model& model) {
  if (!model.adhesion) return {};
  const AdhesionRule& rule = *model.adhesion;
  const model::Points& points = model.points;
  const int32_t deepest = *std::ranges::max_element(points.layer);
  const std::set<int64_t> cut(rule.cut_columns.begin(), rule.cut_columns.end());
  const std::map<int64_t, int64_t> skin = skin_points(model);
  const model::ContactPairs& pairs = model.contact.pairs;
  std::vector<Film> films;
  constexpr double on_tooth = 1e-6;  // mm
  for (const AdhesionRule::Jaw& jaw : rule.jaws) {
    const TriangleGrid teeth(model.bone_surfaces[jaw.bone]);
    for (size_t c = 0; c < pairs.point.size(); ++c) {
      const int64_t i = pairs.point[c];
      if (model.contact.bodies[pairs.body[c]].bone != jaw.bone) continue;
      if (pairs.binding[c] != model::Binding::touches) continue;
      if (points.layer[i] != deepest || cut.contains(points.column[i])) continue;
      const auto top = skin.find(points.column[i]);
      if (top == skin.end()) continue;
      const Vec3& at = points.position[i];
      const Vec3 above = rule.axes * points.position[top->second];
      if (!is_inside(rule.axes * at, jaw)) continue;
      if ((above.z() > lip_height(rule.lip_line, above.x())) != jaw.upper) continue;
      const std::optional<Vec3> tooth = teeth.closest_point(at, jaw.reach);
      if (!tooth || teeth.contains(at)) continue;
      const double distance = (at - *tooth).norm();
      if (distance <= on_tooth) continue;
      films.push_back(
          {i, jaw.bone, (at - *tooth) / distance, distance, rule.tension * pairs.area[c]});
    }
  }
  std::ranges::sort(films, {}, &Film::point);
  return films;
}

void check_adhesion(const Model& model, const std::vector<Film>& films, Comparison& comparison) {
  const model::TermElements* elements = elements_of(model, "adhesion");
  if (!elements && !model.adhesion) return;
  const bool known = model.adhesion.has_value();
  comparison.statement("the model states where lips adhere (adhesion)", known);
  const bool shaped = !elements || (elements->points_each == 1 && elements->numbers_each == 7 &&
                                    elements->bone_number == 6);
  comparison.statement(
      "elements of adhesion have 1 point and 7 numbers, of which the last is the bone", shaped);
  if (!known || !shaped) return;
  const auto& cut = model.adhesion->cut_columns;
  comparison.statement("columns that cuts double do not adhere",
                       std::ranges::all_of(doubled_columns(model), [&](int64_t column) {
                         return std::ranges::find(cut, column) != cut.end();
                       }));
  std::map<int64_t, int32_t> stored;
  std::string wrong;
  for (size_t e = 0; elements && e < elements->size(); ++e)
    if (!stored.emplace(elements->points_of(e)[0], elements->bone_of(e)).second)
      wrong = fmt::format("point {} adheres twice", elements->points_of(e)[0]);
  if (wrong.empty()) wrong = difference(stored, films, model);
  comparison.statement(wrong.empty() ? "points adhere that lie at the teeth of their jaw" : wrong,
                       wrong.empty());
  if (elements && wrong.empty()) check_planes(model, *elements, films, comparison);
}

std::vector<PointForce> evaluate(const Model& model, const std::vector<Film>& films,
                                 const model::PrescribedMotion& motion, double load,
                                 const std::vector<Vec3>& position) {
  std::vector<PointForce> forces;
  for (const Film& film : films) {
    const Mat4 pose = motion.bone_matrix(film.bone, load);
    const Mat3 turn = pose.topLeftCorner<3, 3>();
    const Vec3 start = turn * model.points.position[film.point] + pose.topRightCorner<3, 1>();
    const Vec3 normal = turn * film.normal, &at = position[film.point];
    const double range = model.adhesion->range, s = normal.dot(at - start) / range;
    PointForce state{film.point, 0, Vec3::Zero(), 0};
    if (s > 0) {
      const double root = std::hypot(1.0, s);
      state.energy = film.tension * range * (root - 1);
      state.force = -film.tension * s / root * normal;
    }
    const double size = at.lpNorm<Eigen::Infinity>();
    state.noise = film.tension * size * (1 / range + 1 / film.distance);
    forces.push_back(state);
  }
  return forces;
}

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
