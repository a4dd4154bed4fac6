#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "array_check.h"
#include "repose/base/error.h"
#include "repose/base/geometry.h"
#include "repose/model/material.h"
#include "repose/model/model.h"
#include "repose/model/prism_geometry.h"
#include "repose/scene/rigid_motion.h"
#include "repose/surface/defects.h"
#include "repose/surface/edges.h"

namespace repose::model {

namespace {

using base::refuse;

// No energy of numbers up to these overflows.
constexpr double max_coordinate = 1e7, largest = 1e30;
constexpr Limits place{-max_coordinate, max_coordinate, "mm"}, any{-largest, largest, ""},
    weight{-1000, 1000, ""};

constexpr Limits at_least_zero(const char* unit) { return {0, largest, unit}; }
constexpr Limits positive(const char* unit, const char* remedy) {
  return {0, largest, unit, true, remedy};
}

// The table of the format: for each array its shape, allowed values and what it refers to.

void check_points(const Points& p, size_t bones, const ArrayCheck& check) {
  const size_t n = p.position.size();
  if (n == 0) check.refuse("point/position", "has no row; a model has at least one point");
  check.vectors("point/position", p.position, n, place);
  check.vectors("point/target", p.target, n, place);
  check.integers("point/set", p.set, n, 0, 3);
  check.integers("point/layer", p.layer, n, 0, INT32_MAX);
  check.integers("point/column", p.column, n, 0, INT64_MAX);
  check.integers("point/bone", p.bone, n, -1, static_cast<int64_t>(bones) - 1);
  check.numbers("point/mass", p.mass, n, at_least_zero("kg"));
  check.vectors("point/external_force", p.external_force, n, any);
}

void check_springs(const Springs& s, size_t points, size_t sets, const ArrayCheck& check) {
  const size_t n = s.points.size();
  check.indices("spring/points", s.points, points);
  check.integers("spring/set", s.set, n, 0, static_cast<int64_t>(sets) - 1);
  check.numbers("spring/rest_length", s.rest_length, n, {0, max_coordinate, "mm"});
  check.numbers("spring/stiffness", s.stiffness, n, at_least_zero("N/mm"));
  check.integers("spring/exponent", s.exponent, n, 0, 2);
  check.numbers("spring/reference", s.reference, n,
                positive("mm", "1 is the paper's, the initial length makes it a strain"));
}

void check_prisms(const Prisms& p, size_t points, bool solid, const ArrayCheck& check) {
  const size_t n = p.points.size(), of_solid = solid ? n : 0;
  check.indices("prism/points", p.points, points);
  check.numbers("prism/rest_volume", p.rest_volume, n,
                positive("mm³", "order prism/points so that it is, and mend flat prisms"));
  check.numbers("prism/modulus", p.modulus, of_solid, positive("N/mm²", "κ is Lamé's λ + μ"));
  check.numbers("prism/shear_modulus", p.shear_modulus, of_solid,
                positive("N/mm²", "it is Lamé's μ"));
  check.numbers("prism/target_volume", p.target_volume, of_solid, any);
  check.numbers("prism/nodal_modulus", p.nodal_modulus, p.nodal_modulus.empty() ? 0 : n,
                positive("N/mm²", "it is Lamé's λ"));
}

void check_edges(const Edges& edges, size_t points, const ArrayCheck& check) {
  check.indices("edge/points", edges.points, points);
  check.numbers("edge/weight", edges.weight, edges.points.size(), any);
}

void check_elements(const std::vector<TermElements>& all, size_t points, size_t bones,
                    const ArrayCheck& check) {
  constexpr int64_t max_points = 32, max_numbers = 1024;
  for (size_t k = 0; k < all.size(); ++k) {
    const std::string name = fmt::format("element/{}", k);
    const TermElements& of = all[k];
    check.integer(name, 0, of.points_each, 1, max_points);
    check.integer(name, 0, of.numbers_each, 0, max_numbers);
    check.integers(name + "/points", of.points, of.size() * static_cast<size_t>(of.points_each), 0,
                   static_cast<int64_t>(points) - 1);
    check.numbers(name + "/numbers", of.numbers, of.size() * static_cast<size_t>(of.numbers_each),
                  any);
    check.integer(name, 0, of.bone_number, -1, of.numbers_each - 1);
    if (of.bone_number < 0) continue;
    for (size_t e = 0; e < of.size(); ++e) {
      if (of.term == "elastic_support" && of.numbers_each == 5)
        check.number(name + "/numbers", 5 * e + 3, of.numbers_of(e)[3], at_least_zero("N/mm"));
      const double bone = of.numbers_of(e)[of.bone_number];
      if (!(bone >= 0 && bone < static_cast<double>(bones) && bone == std::floor(bone)))
        check.refuse(name + "/numbers",
                     "element {} names bone {:g}, expected a row of bone below {}", e, bone, bones);
    }
  }
}

void check_surface(const std::string& group, const surface::Surface& mesh,
                   const ArrayCheck& check) {
  check.vectors(group + "/points", mesh.points, mesh.points.size(), place);
  check.indices(group + "/triangles", mesh.triangles, mesh.points.size());
}

void check_bones(const Model& m, const ArrayCheck& check) {
  const size_t n = m.bones.size();
  check.rows("bone_transform", m.bone_transform.size(), m.bone_transform.empty() ? 0 : n);
  for (size_t b = 0; b < m.bone_transform.size(); ++b)
    for (const double value : m.bone_transform[b].reshaped())
      check.number("bone_transform", b, value, place);
  check.rows("bone_surface", m.bone_surfaces.size(), m.bone_surfaces.empty() ? 0 : n);
  for (size_t b = 0; b < m.bone_surfaces.size(); ++b)
    check_surface(fmt::format("bone_surface/{}", b), m.bone_surfaces[b], check);
}

void check_pairs(const Contact& contact, size_t points, size_t bones, const ArrayCheck& check) {
  const ContactPairs& pairs = contact.pairs;
  const size_t n = pairs.point.size(), bodies = contact.bodies.size();
  constexpr double finest = 1e-3;  // mm, of a grid
  check.number("contact attribute stiffness", 0, contact.stiffness, positive("N/mm³", ""));
  check.number("contact attribute grid", 0, contact.spacing, {finest, max_coordinate, "mm"});
  check.integers("contact/point", pairs.point, n, 0, static_cast<int64_t>(points) - 1);
  check.integers("contact/body_row", pairs.body, n, 0, static_cast<int64_t>(bodies) - 1);
  check.integers("contact/binding", pairs.binding, n, 0, 1);
  check.numbers("contact/area", pairs.area, n, at_least_zero("mm²"));
  for (size_t k = 0; k < bodies; ++k) {
    check.integer("contact/body_bone", k, contact.bodies[k].bone, -1,
                  static_cast<int64_t>(bones) - 1);
    for (const double value : contact.bodies[k].push)
      check.number("contact/body_push", k, value, place);
  }
}

void check_adhesion(const Model& m, const ArrayCheck& check) {
  const AdhesionRule& rule = *m.adhesion;
  check.number("adhesion attribute tension", 0, rule.tension, at_least_zero("N/mm²"));
  check.number("adhesion attribute range", 0, rule.range, positive("mm", ""));
  if (!((rule.axes * rule.axes.transpose() - Mat3::Identity()).norm() < 1e-9))
    check.refuse("adhesion/axes", "rows are not unit vectors at right angles to each other");
  check.vectors("adhesion/lip_line", {rule.lip_line.begin(), rule.lip_line.end()}, 3, place);
  for (size_t k = 0; k < rule.jaws.size(); ++k) {
    const AdhesionRule::Jaw& jaw = rule.jaws[k];
    check.integer("adhesion/bone", k, jaw.bone, 0, static_cast<int64_t>(m.bones.size()) - 1);
    for (const Vec3& corner : {jaw.low, jaw.high})
      for (const double value : corner) check.number("adhesion/box", k, value, place);
    check.number("adhesion/reach", k, jaw.reach, {0, max_coordinate, "mm", true, ""});
    if (m.bone_surfaces.empty() || m.bone_surfaces[jaw.bone].triangles.empty())
      check.refuse("adhesion/bone", "row {} names bone {}, which has no bone_surface", k,
                   m.bones[jaw.bone]);
  }
  check.integers("adhesion/cut_column", rule.cut_columns, rule.cut_columns.size(), 0, INT64_MAX);
}

void check_cut_faces(const CutFaces& cut_faces, size_t point_count, const ArrayCheck& check) {
  const auto points = static_cast<int64_t>(point_count);
  int64_t places = 0;
  for (size_t k = 0; k < cut_faces.size.size(); ++k) {
    for (const int64_t n : cut_faces.size[k]) check.integer("contact/wall/net", k, n, 2, points);
    places += cut_faces.size[k][0] * cut_faces.size[k][1];
    check.integer("contact/wall/net", k, places, 4, points * points);
  }
  const auto shares = static_cast<int64_t>(cut_faces.point.size());
  check.integers("contact/wall/begin", cut_faces.begin,
                 cut_faces.empty() ? 0 : static_cast<size_t>(2 * places + 1), 0, shares);
  for (size_t c = 1; c < cut_faces.begin.size(); ++c)
    check.integer("contact/wall/begin", c, cut_faces.begin[c], cut_faces.begin[c - 1] + 1, shares);
  if (!cut_faces.empty()) {
    check.integer("contact/wall/begin", 0, cut_faces.begin.front(), 0, 0);
    check.integer("contact/wall/begin", cut_faces.begin.size() - 1, cut_faces.begin.back(), shares,
                  shares);
  }
  check.integers("contact/wall/point", cut_faces.point, cut_faces.point.size(), 0, points - 1);
  check.numbers("contact/wall/weight", cut_faces.weight, cut_faces.point.size(), weight);
  for (size_t c = 1; c < cut_faces.begin.size(); ++c) {
    const auto begin = cut_faces.weight.begin() + cut_faces.begin[c - 1];
    const auto end = cut_faces.weight.begin() + cut_faces.begin[c];
    const double sum = std::accumulate(begin, end, 0.0);
    if (std::abs(sum - 1) > 1e-9)
      check.refuse("contact/wall/weight", "rows {} to {} have a sum of {}, expected 1",
                   cut_faces.begin[c - 1], cut_faces.begin[c] - 1, sum);
  }
  check.numbers("contact/wall/area", cut_faces.area, static_cast<size_t>(places),
                at_least_zero("mm²"));
}

void check_arrays(const Model& m, const ArrayCheck& check) {
  const size_t points = m.points.position.size(), bones = m.bones.size();
  constexpr double heaviest = 1e6;  // N/kg
  for (const double value : m.gravity)
    check.number("attribute gravity", 0, value, {-heaviest, heaviest, "N/kg"});
  check_points(m.points, bones, check);
  check_springs(m.springs, points, m.spring_sets.size(), check);
  check_prisms(m.prisms, points, is_solid(m) || !m.edges.points.empty(), check);
  check_edges(m.edges, points, check);
  check_elements(m.elements, points, m.bones.size(), check);
  check.indices("skin/points", m.skin, points);
  check_bones(m, check);
  if (m.adhesion) check_adhesion(m, check);
  if (m.contact.empty()) return;
  check_pairs(m.contact, points, bones, check);
  check_cut_faces(m.contact.cut_faces, points, check);
}

// Relations between arrays.

void require_bones(const Points& p, const ArrayCheck& check) {
  for (size_t i = 0; i < p.set.size(); ++i)
    if (p.set[i] == PointSet::bone && p.bone[i] < 0)
      check.refuse("point/bone", "row {} is -1, but point/set makes it a bone point; name its bone",
                   i);
}

void require_rigid(const Model& m, const ArrayCheck& check) {
  for (size_t b = 0; b < m.bone_transform.size(); ++b) try {
      scene::RigidMotion::from_matrix(m.bone_transform[b]);
    } catch (const base::InputError& error) {
      check.refuse("bone_transform", "row {} (bone {}): {}", b, m.bones[b], error.what());
    }
}

// Held points, and bone points without a bone_transform, may go anywhere.
void require_targets(const Model& m, const ArrayCheck& check) {
  constexpr double tolerance = 1e-5;  // of the coordinates: single precision, a nearly rigid matrix
  std::vector<scene::RigidMotion> motion;
  for (const Mat4& matrix : m.bone_transform)
    motion.push_back(scene::RigidMotion::from_matrix(matrix));
  for (size_t i = 0; i < m.points.set.size(); ++i) {
    const bool on_bone = m.points.set[i] == PointSet::bone;
    if (m.points.set[i] == PointSet::held || (on_bone && motion.empty())) continue;
    const Vec3 &from = m.points.position[i], &target = m.points.target[i];
    const Vec3 expected = on_bone ? motion[m.points.bone[i]].apply(from) : from;
    if ((target - expected).norm() <= tolerance * (from.norm() + target.norm())) continue;
    check.refuse("point/target", "row {} is {} mm, expected {} mm: {}", i, target, expected,
                 on_bone ? "write where bone_transform moves the point, or leave bone_transform out"
                         : "write point/position, only bone (set 2) and held points (3) are moved");
  }
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

void require_volumes(const Model& m, const ArrayCheck& check) {
  for (size_t i = 0; i < m.prisms.points.size(); ++i) {
    const std::array<Vec3, 6> corners = corners_of(m, i);
    const double volume = prism_volume(corners.data()), stored = m.prisms.rest_volume[i];
    if (!(std::abs(volume - stored) <= volume_tolerance(corners.data())))
      check.refuse("prism/rest_volume",
                   "row {} is {} mm³, but the prism's volume at point/position is {} mm³; write "
                   "that volume, order prism/points so that it is above 0",
                   i, stored, volume);
  }
}

void require_parts_of_moduli(const Prisms& p, const ArrayCheck& check) {
  for (size_t m = 0; m < p.nodal_modulus.size(); ++m)
    if (!(p.nodal_modulus[m] < p.modulus[m]))
      check.refuse("prism/nodal_modulus", "row {} is {} N/mm²; must be below prism/modulus, {}", m,
                   p.nodal_modulus[m], p.modulus[m]);
}

void require_one_tissue(const Model& m, const ArrayCheck& check) {
  if (!m.springs.points.empty() && (is_solid(m) || !m.edges.points.empty()))
    check.refuse("spring", "has {} rows beside /model/edge; a model is of springs or a solid",
                 m.springs.points.size());
}

void require_different_points(const Model& m, const ArrayCheck& check) {
  check.different("spring/points", m.springs.points);
  check.different("prism/points", m.prisms.points);
  check.different("edge/points", m.edges.points);
  for (size_t k = 0; k < m.elements.size(); ++k)
    for (size_t e = 0; e < m.elements[k].size(); ++e) {
      const auto points = m.elements[k].points_of(e);
      if (std::set<int64_t>(points.begin(), points.end()).size() != points.size())
        check.refuse(fmt::format("element/{}", k), "element {} has one of its points twice", e);
    }
}

void require_closed(const std::string& name, const surface::Surface& mesh,
                    const ArrayCheck& check) {
  if (mesh.triangles.empty())
    check.refuse(name, "has no triangles; tissue can only touch a closed surface");
  if (const surface::Defects defects = surface::inspect(mesh, false); !defects.outward)
    check.refuse(name, "must be a closed surface that faces outward; it is {}",
                 surface::describe(defects));
}

/// Checks the shape of a body: its row of contact/body_shape, or its mesh.
void check_shape(size_t row, const Body::Shape& shape, const ArrayCheck& check) {
  const auto check_row = [&](const std::vector<Vec3>& vectors, const std::vector<double>& sizes) {
    for (const Vec3& vector : vectors)
      for (const double value : vector) check.number("contact/body_shape", row, value, place);
    for (const double size : sizes)
      check.number(
          "contact/body_shape", row, size,
          {0, max_coordinate, "mm", true, "a radius, a box's size, the length of a normal"});
  };
  if (const auto* ball = std::get_if<scene::Sphere>(&shape))
    check_row({ball->center}, {ball->radius});
  if (const auto* capsule = std::get_if<scene::Capsule>(&shape))
    check_row({capsule->from, capsule->to}, {capsule->radius});
  if (const auto* box = std::get_if<scene::Box>(&shape))
    check_row({box->center}, {box->size.begin(), box->size.end()});
  if (const auto* half = std::get_if<scene::HalfSpace>(&shape))
    check_row({half->point, half->normal}, {half->normal.norm()});
  if (const auto* mesh = std::get_if<surface::Surface>(&shape)) {
    const std::string group = fmt::format("contact/body_mesh/{}", row);
    check_surface(group, *mesh, check);
    require_closed(group, *mesh, check);
  }
}

void require_bodies(const Model& m, const ArrayCheck& check) {
  if (m.contact.empty()) return;
  for (size_t k = 0; k < m.contact.bodies.size(); ++k) {
    const Body& body = m.contact.bodies[k];
    if (body.bone < 0)
      check_shape(k, body.shape, check);
    else if (m.bone_surfaces.empty())
      check.refuse("bone_surface", "is missing, but contact/body_bone row {} is bone {}", k,
                   m.bones[body.bone]);
    else
      require_closed(fmt::format("bone_surface/{}", body.bone), m.bone_surfaces[body.bone], check);
  }
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

void refuse_floating(const Model& m, const std::string& file) {
  const int64_t row = find_floating(m.points.set, {m.springs.points, m.edges.points});
  if (row >= 0)
    refuse(
        "{}: /model/point: row {} at {:.4g} mm is soft tissue, and nothing holds it or what it "
        "is joined to; make a point there a boundary point (set 1), or remove the part",
        file, row, m.points.position[row]);
}

}  // namespace

void validate(const Model& model, const std::string& file) {
  const ArrayCheck check(file);
  check_arrays(model, check);
  require_bones(model.points, check);
  require_different_points(model, check);
  require_volumes(model, check);
  require_parts_of_moduli(model.prisms, check);
  require_one_tissue(model, check);
  require_rigid(model, check);
  require_targets(model, check);
  require_bodies(model, check);
  refuse_unattached(model, file);
  refuse_floating(model, file);
}

}  // namespace repose::model
