#include <algorithm>
#include <cmath>
#include <set>

#include "repose/base/error.h"
#include "repose/base/geometry.h"
#include "repose/model/model.h"
#include "repose/model/prism_geometry.h"
#include "repose/scene/rigid_motion.h"
#include "repose/surface/edges.h"

namespace repose::model {

namespace {

using base::refuse;

/// Refuses what is wrong with one array, naming it as the file does.
class Array {
 public:
  Array(const std::string& file, const char* name) : file_(file), name_(name) {}

  void has_rows(size_t rows, size_t expected) const {
    if (rows != expected)
      refuse("{}: /model/{}: has {} rows, expected {}, one for each", file_, name_, rows, expected);
  }
  void is_finite(const std::vector<Vec3>& values) const {
    for (size_t i = 0; i < values.size(); ++i)
      if (!values[i].allFinite())
        refuse("{}: /model/{}: row {} is ({}, {}, {}), expected finite numbers", file_, name_, i,
               values[i][0], values[i][1], values[i][2]);
  }
  void is_finite(const std::vector<double>& values) const {
    for (size_t i = 0; i < values.size(); ++i)
      if (!std::isfinite(values[i]))
        refuse("{}: /model/{}: row {} is {}, expected a finite number", file_, name_, i, values[i]);
  }
  void is_not_negative(const std::vector<double>& values, const char* unit) const {
    for (size_t i = 0; i < values.size(); ++i)
      if (!std::isfinite(values[i]) || values[i] < 0)
        refuse("{}: /model/{}: row {} is {} {}, expected a finite number, 0 or more", file_, name_,
               i, values[i], unit);
  }
  void is_positive(const std::vector<double>& values, const char* unit, const char* remedy) const {
    for (size_t i = 0; i < values.size(); ++i)
      if (!std::isfinite(values[i]) || values[i] <= 0)
        refuse("{}: /model/{}: row {} is {} {}, expected a finite number above 0: {}", file_, name_,
               i, values[i], unit, remedy);
  }
  void is_within(int64_t value, size_t row, int64_t first, int64_t last) const {
    if (value < first || value > last)
      refuse("{}: /model/{}: row {} is {}, expected {} to {}", file_, name_, row, value, first,
             last);
  }
  template <class Int>
  void all_within(const std::vector<Int>& values, int64_t first, int64_t last) const {
    for (size_t i = 0; i < values.size(); ++i)
      is_within(static_cast<int64_t>(values[i]), i, first, last);
  }
  template <size_t K>
  void all_index(const std::vector<std::array<int64_t, K>>& rows, size_t count) const {
    for (size_t i = 0; i < rows.size(); ++i)
      for (const int64_t index : rows[i]) is_within(index, i, 0, static_cast<int64_t>(count) - 1);
  }

 private:
  const std::string& file_;
  const char* name_;
};

void validate_points(const Points& p, int64_t bones, const std::string& file) {
  const size_t n = p.position.size();
  if (n == 0) refuse("{}: /model/point/position: has no row; a model has at least one point", file);
  Array(file, "point/set").has_rows(p.set.size(), n);
  Array(file, "point/target").has_rows(p.target.size(), n);
  Array(file, "point/layer").has_rows(p.layer.size(), n);
  Array(file, "point/column").has_rows(p.column.size(), n);
  Array(file, "point/bone").has_rows(p.bone.size(), n);
  Array(file, "point/mass").has_rows(p.mass.size(), n);
  Array(file, "point/external_force").has_rows(p.external_force.size(), n);
  Array(file, "point/position").is_finite(p.position);
  Array(file, "point/target").is_finite(p.target);
  Array(file, "point/external_force").is_finite(p.external_force);
  Array(file, "point/mass").is_not_negative(p.mass, "kg");
  Array(file, "point/set").all_within(p.set, 0, 3);
  Array(file, "point/layer").all_within(p.layer, 0, INT32_MAX);
  Array(file, "point/column").all_within(p.column, 0, INT64_MAX);
  Array(file, "point/bone").all_within(p.bone, -1, bones - 1);
  for (size_t i = 0; i < n; ++i)
    if (p.set[i] == PointSet::bone && p.bone[i] < 0)
      refuse(
          "{}: /model/point/bone: row {} is -1, but point/set makes it a bone point; name its bone",
          file, i);
}

void validate_springs(const Springs& s, size_t points, size_t sets, const std::string& file) {
  const size_t n = s.points.size();
  Array(file, "spring/set").has_rows(s.set.size(), n);
  Array(file, "spring/rest_length").has_rows(s.rest_length.size(), n);
  Array(file, "spring/stiffness").has_rows(s.stiffness.size(), n);
  Array(file, "spring/exponent").has_rows(s.exponent.size(), n);
  Array(file, "spring/reference").has_rows(s.reference.size(), n);
  Array(file, "spring/points").all_index(s.points, points);
  for (size_t j = 0; j < n; ++j)
    if (s.points[j][0] == s.points[j][1])
      refuse(
          "{}: /model/spring/points: row {} is ({}, {}), expected two different points: a spring "
          "between a point and itself holds nothing; remove it",
          file, j, s.points[j][0], s.points[j][1]);
  Array(file, "spring/set").all_within(s.set, 0, static_cast<int64_t>(sets) - 1);
  Array(file, "spring/rest_length").is_not_negative(s.rest_length, "mm");
  Array(file, "spring/stiffness").is_not_negative(s.stiffness, "N/mm");
  Array(file, "spring/exponent").all_within(s.exponent, 0, 2);
  Array(file, "spring/reference")
      .is_positive(s.reference, "mm", "1 is the paper's, the initial length makes it a strain");
}

// A millionth, and what rounding the coordinates to single precision may do to the volume.
double volume_tolerance(const Vec3 corners[6]) {
  double coordinate = 0, extent = 0;
  for (int i = 0; i < 6; ++i) {
    coordinate = std::max(coordinate, corners[i].lpNorm<Eigen::Infinity>());
    extent = std::max(extent, (corners[i] - corners[0]).norm());
  }
  return 1e-6 * std::abs(prism_volume(corners)) + 2e-7 * coordinate * extent * extent;
}

void refuse_wrong_volume(const Model& m, const std::string& file) {
  for (size_t i = 0; i < m.prisms.points.size(); ++i) {
    Vec3 corners[6];
    for (int j = 0; j < 6; ++j) corners[j] = m.points.position[m.prisms.points[i][j]];
    const double volume = prism_volume(corners), stored = m.prisms.rest_volume[i];
    if (!(std::abs(volume - stored) <= volume_tolerance(corners)))
      refuse(
          "{}: /model/prism/rest_volume: row {} is {} mm³, but the prism's volume at "
          "point/position is {} mm³; write that volume, order prism/points so that it is above 0",
          file, i, stored, volume);
  }
}

void validate_nodal(const Prisms& p, const std::string& file) {
  if (p.nodal_modulus.empty()) return;
  Array(file, "prism/nodal_modulus").has_rows(p.nodal_modulus.size(), p.points.size());
  Array(file, "prism/nodal_modulus").is_positive(p.nodal_modulus, "N/mm²", "it is Lamé's λ");
  for (size_t m = 0; m < p.points.size(); ++m)
    if (!(p.nodal_modulus[m] < p.modulus[m]))
      refuse("{}: /model/prism/nodal_modulus: row {} is {} N/mm²; must be below prism/modulus, {}",
             file, m, p.nodal_modulus[m], p.modulus[m]);
}

/// A solid's material and edges, all of them or none.
void validate_solid(const Model& m, const std::string& file) {
  const Prisms& p = m.prisms;
  if (!is_solid(m) && m.edges.points.empty()) return;
  const size_t n = p.points.size();
  Array(file, "prism/modulus").has_rows(p.modulus.size(), n);
  Array(file, "prism/shear_modulus").has_rows(p.shear_modulus.size(), n);
  Array(file, "prism/target_volume").has_rows(p.target_volume.size(), n);
  Array(file, "prism/modulus").is_positive(p.modulus, "N/mm²", "κ is Lamé's λ + μ");
  Array(file, "prism/shear_modulus").is_positive(p.shear_modulus, "N/mm²", "it is Lamé's μ");
  Array(file, "prism/target_volume").is_finite(p.target_volume);
  validate_nodal(p, file);
  Array(file, "edge/weight").has_rows(m.edges.weight.size(), m.edges.points.size());
  Array(file, "edge/points").all_index(m.edges.points, m.points.position.size());
  Array(file, "edge/weight").is_finite(m.edges.weight);
  if (!m.springs.points.empty())
    refuse("{}: /model/spring: has {} rows beside /model/edge; a model is of springs or a solid",
           file, m.springs.points.size());
}

void validate_prisms(const Model& m, const std::string& file) {
  const Prisms& p = m.prisms;
  Array(file, "prism/rest_volume").has_rows(p.rest_volume.size(), p.points.size());
  Array(file, "prism/points").all_index(p.points, m.points.position.size());
  Array(file, "prism/rest_volume")
      .is_positive(p.rest_volume, "mm³", "order prism/points so that it is, and mend flat prisms");
  refuse_wrong_volume(m, file);
}

void validate_bones(const Model& m, const std::string& file) {
  if (!m.bone_transform.empty())
    Array(file, "bone_transform").has_rows(m.bone_transform.size(), m.bones.size());
  for (size_t b = 0; b < m.bone_transform.size(); ++b) try {
      scene::RigidMotion::from_matrix(m.bone_transform[b]);
    } catch (const base::InputError& error) {
      refuse("{}: /model/bone_transform: row {} (bone {}): {}", file, b, m.bones[b], error.what());
    }
  if (!m.bone_surfaces.empty())
    Array(file, "bone_surface").has_rows(m.bone_surfaces.size(), m.bones.size());
  for (size_t b = 0; b < m.bone_surfaces.size(); ++b) {
    const std::string group = fmt::format("bone_surface/{}/", b);
    Array(file, (group + "points").c_str()).is_finite(m.bone_surfaces[b].points);
    Array(file, (group + "triangles").c_str())
        .all_index(m.bone_surfaces[b].triangles, m.bone_surfaces[b].points.size());
  }
}

void validate_walls(const Walls& walls, int64_t points, const std::string& file) {
  int64_t places = 0;
  for (size_t k = 0; k < walls.size.size(); ++k) {
    for (const int64_t n : walls.size[k])
      Array(file, "contact/wall/net").is_within(n, k, 2, points);
    places += walls.size[k][0] * walls.size[k][1];
    Array(file, "contact/wall/net").is_within(places, k, 4, points * points);
  }
  Array(file, "contact/wall/begin")
      .has_rows(walls.begin.size(), walls.empty() ? 0 : static_cast<size_t>(2 * places + 1));
  const auto shares = static_cast<int64_t>(walls.point.size());
  for (size_t c = 1; c < walls.begin.size(); ++c)
    Array(file, "contact/wall/begin")
        .is_within(walls.begin[c], c, c == 1 ? 1 : walls.begin[c - 1] + 1, shares);
  if (!walls.empty()) {
    Array(file, "contact/wall/begin").is_within(walls.begin.front(), 0, 0, 0);
    Array(file, "contact/wall/begin").is_within(walls.begin.back(), 2 * places, shares, shares);
  }
  Array(file, "contact/wall/point").all_within(walls.point, 0, points - 1);
  Array(file, "contact/wall/weight").has_rows(walls.weight.size(), walls.point.size());
  Array(file, "contact/wall/weight").is_finite(walls.weight);
  Array(file, "contact/wall/area").has_rows(walls.area.size(), static_cast<size_t>(places));
  Array(file, "contact/wall/area").is_not_negative(walls.area, "mm²");
}

void validate_contact(const Model& m, const std::string& file) {
  if (m.contact.empty()) return;
  const auto points = static_cast<int64_t>(m.points.position.size());
  const Touches& touches = m.contact.touches;
  Array(file, "contact attributes stiffness and grid")
      .is_positive({m.contact.stiffness, m.contact.spacing}, "N/mm³ or mm", "both are");
  Array(file, "contact/point").all_within(touches.point, 0, points - 1);
  const auto bodies = static_cast<int64_t>(m.contact.bodies.size());
  Array(file, "contact/body_row").all_within(touches.body, 0, bodies - 1);
  for (size_t c = 0; c < touches.binding.size(); ++c)
    Array(file, "contact/binding").is_within(static_cast<int64_t>(touches.binding[c]), c, 0, 1);
  Array(file, "contact/area").is_not_negative(touches.area, "mm²");
  for (size_t k = 0; k < m.contact.bodies.size(); ++k)
    Array(file, "contact/body_bone")
        .is_within(m.contact.bodies[k].bone, k, -1, static_cast<int64_t>(m.bones.size()) - 1);
  validate_walls(m.contact.walls, points, file);
}

void refuse_unattached(const Model& m, const std::string& file) {
  std::vector<bool> held(m.points.position.size(), false);
  for (const auto& ends : m.springs.points)
    for (const int64_t end : ends) held[end] = true;
  for (const auto& ends : m.edges.points)
    for (const int64_t end : ends) held[end] = true;
  for (size_t i = 0; i < held.size(); ++i)
    if (!held[i] && m.points.set[i] == PointSet::soft_tissue)
      refuse(
          "{}: /model/point: row {} is soft tissue and no spring or edge holds it; remove it, join "
          "it with a spring (/model/spring) or, of a solid, an edge (/model/edge), or make it a "
          "boundary point (set 1)",
          file, i);
}

void validate_elements(const Model& m, const std::string& file) {
  constexpr int64_t most_points = 32, most_numbers = 1024;
  for (size_t k = 0; k < m.elements.size(); ++k) {
    const TermElements& of = m.elements[k];
    const std::string name = fmt::format("element/{}", k), points_name = name + "/points",
                      numbers_name = name + "/numbers";
    Array(file, name.c_str()).is_within(of.points_each, 0, 1, most_points);
    Array(file, name.c_str()).is_within(of.numbers_each, 0, 0, most_numbers);
    const auto each = static_cast<size_t>(of.points_each);
    const auto numbers_each = static_cast<size_t>(of.numbers_each);
    Array(file, points_name.c_str()).has_rows(of.points.size(), of.size() * each);
    Array(file, numbers_name.c_str()).has_rows(of.numbers.size(), of.size() * numbers_each);
    Array(file, points_name.c_str())
        .all_within(of.points, 0, static_cast<int64_t>(m.points.position.size()) - 1);
    Array(file, numbers_name.c_str()).is_finite(of.numbers);
    for (size_t e = 0; e < of.size(); ++e) {
      const auto points = of.points_of(e);
      const std::set<int64_t> different(points.begin(), points.end());
      if (different.size() != points.size())
        refuse("{}: /model/element/{}: element {} has one of its points twice", file, k, e);
    }
  }
}

void refuse_floating(const Model& m, const std::string& file) {
  const size_t points = m.points.set.size();
  surface::UnionFind parts(static_cast<int64_t>(points));
  for (const auto& ends : m.springs.points) parts.unite(ends[0], ends[1]);
  for (const auto& ends : m.edges.points) parts.unite(ends[0], ends[1]);
  std::vector<bool> held(points, false);
  for (size_t i = 0; i < points; ++i)
    if (m.points.set[i] != PointSet::soft_tissue) held[parts.find(static_cast<int64_t>(i))] = true;
  for (size_t i = 0; i < points; ++i)
    if (!held[parts.find(static_cast<int64_t>(i))])
      refuse(
          "{}: /model/point: row {} at ({:.4g}, {:.4g}, {:.4g}) mm is soft tissue, and nothing "
          "holds it or what it is joined to; make a point there a boundary point (set 1), or "
          "remove the part",
          file, i, m.points.position[i].x(), m.points.position[i].y(), m.points.position[i].z());
}

}  // namespace

Prisms pick_prisms(const Prisms& p, const std::vector<int64_t>& rows) {
  const auto of_solid = [&](const std::vector<double>& values) {
    return values.empty() ? values : base::pick(values, rows);
  };
  return {base::pick(p.points, rows), base::pick(p.rest_volume, rows), of_solid(p.shear_modulus),
          of_solid(p.modulus),        of_solid(p.target_volume),       of_solid(p.nodal_modulus)};
}

Counts count(const Model& model) {
  Counts c;
  c.points = static_cast<int64_t>(model.points.position.size());
  for (const PointSet set : model.points.set) {
    c.soft += set == PointSet::soft_tissue;
    c.boundary += set == PointSet::boundary;
    c.bone += set == PointSet::bone;
    c.held += set == PointSet::held;
  }
  c.springs = static_cast<int64_t>(model.springs.points.size());
  c.prisms = static_cast<int64_t>(model.prisms.points.size());
  c.edges = static_cast<int64_t>(model.edges.points.size());
  return c;
}

void validate(const Model& model, const std::string& file) {
  const size_t points = model.points.position.size();
  if (!model.gravity.allFinite()) refuse("{}: /model attribute gravity: is not finite", file);
  validate_points(model.points, static_cast<int64_t>(model.bones.size()), file);
  validate_springs(model.springs, points, model.spring_sets.size(), file);
  validate_prisms(model, file);
  validate_solid(model, file);
  Array(file, "skin/points").all_index(model.skin, points);
  validate_bones(model, file);
  validate_contact(model, file);
  validate_elements(model, file);
  refuse_unattached(model, file);
  refuse_floating(model, file);
}

}  // namespace repose::model
