#pragma once
#include <cmath>
#include <functional>
#include <map>

#include "repose/model/model.h"
#include "repose/model/prism_geometry.h"

/// Small models with known answers.
namespace repose::testing {

inline int64_t add_point(model::Model& m, const Vec3& at, model::PointSet set, int64_t column,
                         int32_t layer = 0) {
  m.points.position.push_back(at);
  m.points.target.push_back(at);
  m.points.set.push_back(set);
  m.points.layer.push_back(layer);
  m.points.column.push_back(column);
  m.points.bone.push_back(set == model::PointSet::bone ? 0 : -1);
  m.points.mass.push_back(0);
  m.points.external_force.push_back(Vec3::Zero());
  return static_cast<int64_t>(m.points.position.size()) - 1;
}

inline void add_spring(model::Model& m, int64_t p, int64_t q, double stiffness, int exponent,
                       double reference = 1.0) {
  m.springs.points.push_back({p, q});
  m.springs.set.push_back(0);
  m.springs.rest_length.push_back((m.points.position[q] - m.points.position[p]).norm());
  m.springs.stiffness.push_back(stiffness);
  m.springs.exponent.push_back(static_cast<int8_t>(exponent));
  m.springs.reference.push_back(reference);
  if (m.spring_sets.empty()) m.spring_sets.push_back("all");
}

inline void add_prism(model::Model& m, const std::array<int64_t, 6>& corners) {
  std::array<Vec3, 6> p;
  for (int c = 0; c < 6; ++c) p[c] = m.points.position[corners[c]];
  m.prisms.points.push_back(corners);
  m.prisms.rest_volume.push_back(model::prism_volume(p.data()));
}

/// A block of columns × rows columns, `layers` deep, spacing 5 mm sideways and 3 mm down, skin at
/// z = 0, with every spring set and prism of the layered model. `set` says what each point is.
inline model::Model block(int columns, int rows, int layers, int exponent,
                          const std::function<model::PointSet(int, int, int)>& set) {
  model::Model m;
  const auto number = [&](int i, int j, int a) {
    return (static_cast<int64_t>(j) * columns + i) * layers + a;
  };
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i)
      for (int a = 0; a < layers; ++a)
        add_point(m, {5.0 * i, 5.0 * j, -3.0 * a}, set(i, j, a), j * columns + i, a);
  const auto edge = [&](int i, int j, int k, int l) {
    for (int a = 0; a < layers; ++a) {
      add_spring(m, number(i, j, a), number(k, l, a), 1.0, exponent);
      if (a + 1 == layers) continue;
      add_spring(m, number(i, j, a), number(k, l, a + 1), 0.5, exponent);
      add_spring(m, number(k, l, a), number(i, j, a + 1), 0.5, exponent);
    }
  };
  const auto triangle = [&](std::array<int, 2> p, std::array<int, 2> q, std::array<int, 2> r) {
    for (int a = 0; a + 1 < layers; ++a)
      add_prism(m,
                {number(p[0], p[1], a), number(q[0], q[1], a), number(r[0], r[1], a),
                 number(p[0], p[1], a + 1), number(q[0], q[1], a + 1), number(r[0], r[1], a + 1)});
  };
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      for (int a = 0; a + 1 < layers; ++a)
        add_spring(m, number(i, j, a), number(i, j, a + 1), 0.8, exponent);
      if (i + 1 < columns) edge(i, j, i + 1, j);
      if (j + 1 < rows) edge(i, j, i, j + 1);
      if (i + 1 == columns || j + 1 == rows) continue;
      edge(i, j, i + 1, j + 1);
      triangle({i, j}, {i + 1, j + 1}, {i + 1, j});
      triangle({i, j}, {i, j + 1}, {i + 1, j + 1});
    }
  m.bones = {"bone"};
  return m;
}

/// Moves the targets of all points that are not soft tissue by `map`.
inline void aim(model::Model& m, const std::function<Vec3(const Vec3&)>& map) {
  for (size_t i = 0; i < m.points.set.size(); ++i)
    if (m.points.set[i] == model::PointSet::bone || m.points.set[i] == model::PointSet::held)
      m.points.target[i] = map(m.points.position[i]);
}

}  // namespace repose::testing
