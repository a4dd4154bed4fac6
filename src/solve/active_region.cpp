#include "active_region.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

#include "repose/base/geometry.h"
#include "repose/mechanics/energy.h"
#include "repose/mechanics/spring_law.h"
#include "repose/model/motion.h"

namespace repose::solve {

using base::pick;
using model::Model;
using model::PointSet;

namespace {

constexpr double unreached = std::numeric_limits<double>::infinity();

template <size_t n>
bool touches(const std::array<int64_t, n>& element, const std::vector<char>& flagged) {
  return std::any_of(element.begin(), element.end(), [&](int64_t i) { return flagged[i] != 0; });
}

/// Rows of the elements that touch a flagged point; their points are marked.
template <size_t n>
std::vector<int64_t> touching(const std::vector<std::array<int64_t, n>>& elements,
                              const std::vector<char>& flagged, std::vector<char>& marked) {
  std::vector<int64_t> rows;
  for (size_t e = 0; e < elements.size(); ++e) {
    if (!touches(elements[e], flagged)) continue;
    rows.push_back(static_cast<int64_t>(e));
    for (const int64_t i : elements[e]) marked[i] = 1;
  }
  return rows;
}

template <size_t n>
std::vector<std::array<int64_t, n>> renumbered(std::vector<std::array<int64_t, n>> elements,
                                               const std::vector<int64_t>& number) {
  for (auto& element : elements)
    for (int64_t& i : element) i = number[i];
  return elements;
}

model::Points pick_points(const model::Points& all, const std::vector<int64_t>& rows) {
  return {pick(all.position, rows), pick(all.set, rows),           pick(all.target, rows),
          pick(all.layer, rows),    pick(all.column, rows),        pick(all.bone, rows),
          pick(all.mass, rows),     pick(all.external_force, rows)};
}

/// Bones move as those of the whole model, of which few points may be left to tell how.
void carry_motion(const Model& whole, Model& part) {
  const model::PrescribedMotion motion(whole);
  part.bones = whole.bones;
  for (size_t b = 0; b < whole.bones.size(); ++b)
    part.bone_transform.push_back(motion.bone_matrix(static_cast<int32_t>(b), 1.0));
  model::Points& points = part.points;
  for (size_t i = 0; i < points.set.size(); ++i)
    if (points.set[i] == PointSet::bone && points.bone[i] >= 0 && motion.straight(points.bone[i]))
      points.set[i] = PointSet::held;
}

/// [N] whether a fixed point goes anywhere, beyond rounding.
std::vector<char> travelling(const Model& model) {
  constexpr double rounding = 1e-12;
  const model::PrescribedMotion motion(model);
  std::vector<char> travels(model.points.position.size(), 0);
  for (size_t i = 0; i < travels.size(); ++i)
    for (const double load : {0.5, 1.0}) {
      const Vec3& from = model.points.position[i];
      const Vec3 way = motion.at(model, static_cast<int64_t>(i), load) - from;
      if (way.norm() > rounding * (1 + from.norm())) travels[i] = 1;
    }
  return travels;
}

/// [N] Σ k0 r_0 over the springs at a point, Σ |w| r_0 over the edges, N.
std::vector<double> force_scales(const Model& model) {
  std::vector<double> scale(model.points.position.size(), 0.0);
  const model::Springs& springs = model.springs;
  for (size_t j = 0; j < springs.points.size(); ++j) {
    const auto [p, q] = springs.points[j];
    const double force =
        springs.stiffness[j] * (model.points.position[q] - model.points.position[p]).norm();
    scale[p] += force;
    scale[q] += force;
  }
  for (size_t j = 0; j < model.edges.points.size(); ++j) {
    const auto [p, q] = model.edges.points[j];
    const double force = std::abs(model.edges.weight[j]) *
                         (model.points.position[q] - model.points.position[p]).norm();
    scale[p] += force;
    scale[q] += force;
  }
  return scale;
}

/// The forces of a solid in its initial state.
void subtract_solid_gradient(const Model& model, std::vector<Vec3>& force) {
  const auto loops = mechanics::make_loops(model, 0, 0);
  std::vector<Vec3> gradient(force.size(), Vec3::Zero());
  mechanics::add_edge_gradient(loops.edges, model.points.position, 1, gradient);
  mechanics::add_volume_gradient(loops, model.points.position, mechanics::solid_weights, gradient);
  for (size_t i = 0; i < force.size(); ++i) force[i] -= gradient[i];
}

int64_t count(const std::vector<char>& flags) {
  return std::count_if(flags.begin(), flags.end(), [](char flag) { return flag != 0; });
}

}  // namespace

Submodel submodel(const Model& whole, const std::vector<char>& unknown) {
  std::vector<char> marked = unknown;
  const std::vector<int64_t> springs = touching(whole.springs.points, unknown, marked);
  std::vector<int64_t> prisms = touching(whole.prisms.points, unknown, marked);
  if (!whole.prisms.nodal_modulus.empty())  // and all prisms around their points
    prisms = touching(whole.prisms.points, std::vector<char>(marked), marked);
  const std::vector<int64_t> edges = touching(whole.edges.points, unknown, marked);
  Submodel part;
  std::vector<int64_t> number(marked.size(), -1);
  for (size_t i = 0; i < marked.size(); ++i)
    if (marked[i]) {
      number[i] = static_cast<int64_t>(part.point_row.size());
      part.point_row.push_back(static_cast<int64_t>(i));
    }
  part.model.gravity = whole.gravity;
  part.model.points = pick_points(whole.points, part.point_row);
  for (size_t k = 0; k < part.point_row.size(); ++k)
    if (part.model.points.set[k] == PointSet::soft_tissue && !unknown[part.point_row[k]])
      part.model.points.set[k] = PointSet::held;
  const model::Springs& s = whole.springs;
  part.model.springs = {renumbered(pick(s.points, springs), number),
                        pick(s.set, springs),
                        pick(s.rest_length, springs),
                        pick(s.stiffness, springs),
                        pick(s.exponent, springs),
                        pick(s.reference, springs)};
  part.model.prisms = model::pick_prisms(whole.prisms, prisms);
  part.model.prisms.points = renumbered(std::move(part.model.prisms.points), number);
  part.model.edges = {renumbered(pick(whole.edges.points, edges), number),
                      pick(whole.edges.weight, edges)};
  part.model.spring_sets = whole.spring_sets;
  carry_motion(whole, part.model);
  return part;
}

Submodel submodel_at(const Model& whole, const std::vector<char>& unknown,
                     const std::vector<Vec3>& position) {
  Submodel part = submodel(whole, unknown);
  model::Points& points = part.model.points;
  for (size_t k = 0; k < part.point_row.size(); ++k) {
    if (points.set[k] == PointSet::soft_tissue) continue;
    points.set[k] = PointSet::held;
    points.target[k] = position[part.point_row[k]];
  }
  return part;
}

std::vector<Vec3> initial_forces(const Model& model) {
  const std::vector<Vec3>& x = model.points.position;
  std::vector<Vec3> force(x.size(), Vec3::Zero());
  const model::Springs& springs = model.springs;
  for (size_t j = 0; j < springs.points.size(); ++j) {
    const auto [p, q] = springs.points[j];
    const Vec3 d = x[q] - x[p];
    const double length = d.norm();
    if (length == 0) continue;
    const double tension = mechanics::with_exponent(springs.exponent[j], [&]<int e>() {
      return mechanics::spring_tension<e>(length - springs.rest_length[j], springs.stiffness[j],
                                          1 / springs.reference[j]);
    });
    force[p] += tension / length * d;
    force[q] -= tension / length * d;
  }
  if (model::is_solid(model)) subtract_solid_gradient(model, force);
  for (size_t i = 0; i < x.size(); ++i) {
    force[i] += model.points.mass[i] * model.gravity + model.points.external_force[i];
    if (model.points.set[i] != PointSet::soft_tissue) force[i].setZero();
  }
  return force;
}

ActiveRegion::ActiveRegion(const Model& model, const std::vector<Vec3>& force)
    : model_(model), graph_(discrete::column_graph(model)), distance_(graph_.columns(), unreached) {
  measure(set_in_motion(force));
}

std::vector<char> ActiveRegion::set_in_motion(const std::vector<Vec3>& force) {
  constexpr double rest = 1e-9;
  const std::vector<PointSet>& set = model_.points.set;
  const std::vector<int64_t>& column = graph_.column_of_point;
  std::vector<char> moved(graph_.columns(), 0), uneasy(graph_.columns(), 0);
  const std::vector<char> travels = travelling(model_);
  const auto set_going = [&](const auto& elements) {
    for (const auto& element : elements)
      if (touches(element, travels))
        for (const int64_t i : element)
          if (set[i] == PointSet::soft_tissue) moved[column[i]] = 1;
  };
  set_going(model_.springs.points);
  set_going(model_.prisms.points);
  const std::vector<double> scale = force_scales(model_);
  for (size_t i = 0; i < force.size(); ++i)
    if (force[i].norm() > rest * scale[i]) uneasy[column[i]] = 1;
  moved_ = count(moved);
  uneasy_ = count(uneasy);
  for (size_t c = 0; c < moved.size(); ++c) moved[c] |= uneasy[c];
  return moved;
}

void ActiveRegion::measure(const std::vector<char>& sources) {
  const std::vector<Vec3>& x = model_.points.position;
  std::vector<int64_t> first(graph_.columns(), -1);
  std::vector<double> thickness(graph_.columns(), 0.0);
  for (size_t i = 0; i < x.size(); ++i) {
    const int64_t c = graph_.column_of_point[i];
    if (first[c] < 0) first[c] = static_cast<int64_t>(i);
    thickness[c] = std::max(thickness[c], (x[i] - x[first[c]]).norm());
  }
  const auto length = [&](int64_t a, int64_t b) {
    const double mean = 0.5 * (thickness[a] + thickness[b]);
    return mean > 0 ? (x[first[a]] - x[first[b]]).norm() / mean : 1.0;
  };
  using Entry = std::pair<double, int64_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> front;  // Dijkstra 1959
  for (int64_t c = 0; c < graph_.columns(); ++c)
    if (sources[c]) front.emplace(distance_[c] = 0, c);
  while (!front.empty()) {
    const auto [distance, c] = front.top();
    front.pop();
    if (distance > distance_[c]) continue;
    for (int64_t k = graph_.row_begin[c]; k < graph_.row_begin[c + 1]; ++k) {
      const int64_t other = graph_.neighbour[k];
      const double there = distance + length(c, other);
      if (there < distance_[other]) front.emplace(distance_[other] = there, other);
    }
  }
}

std::vector<char> ActiveRegion::points(double nearest, double farthest) const {
  std::vector<char> flags(model_.points.set.size(), 0);
  for (size_t i = 0; i < flags.size(); ++i) {
    const double distance = distance_[graph_.column_of_point[i]];
    flags[i] =
        model_.points.set[i] == PointSet::soft_tissue && distance >= nearest && distance < farthest;
  }
  return flags;
}

int64_t ActiveRegion::columns(double farthest) const {
  return std::count_if(distance_.begin(), distance_.end(),
                       [&](double distance) { return distance < farthest; });
}

double ActiveRegion::largest() const {
  double largest = 0;
  for (const double distance : distance_)
    if (distance < unreached) largest = std::max(largest, distance);
  return largest;
}

}  // namespace repose::solve
