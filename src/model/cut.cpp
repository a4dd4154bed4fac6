#include "repose/model/cut.h"

#include <algorithm>
#include <map>
#include <set>

#include "add_contact.h"
#include "add_supports.h"
#include "cut_sides.h"
#include "repose/model/material.h"

namespace repose::model {
namespace {

/// Parts a model along one cut.
class CutSplitter {
 public:
  CutSplitter(const Cut& cut, Model& model)
      : model_(model),
        cut_(cut),
        sides_(cut.columns, cut.around),
        doubles_(model.points.position.size(), -1) {}

  std::vector<std::array<int64_t, 2>> run() {
    for (size_t i = 0; i < doubles_.size(); ++i)
      if (to_be_doubled(static_cast<int64_t>(i))) add_double(static_cast<int64_t>(i));
    measure_sides();
    share_loads();
    part_springs();
    const std::vector<double> beyond = weights_beyond_material();
    const Edges before = model_.edges;
    part_prisms();
    part_edges(before, beyond);
    part_skin();
    return pairs_;
  }

 private:
  bool to_be_doubled(int64_t row) const {
    const Points& p = model_.points;
    if (p.layer[row] >= cut_.layers || !sides_.parted(p.column[row])) return false;
    return p.set[row] == PointSet::soft_tissue;
  }

  void add_double(int64_t row) {
    Points& p = model_.points;
    doubles_[row] = static_cast<int64_t>(p.position.size());
    pairs_.push_back({row, doubles_[row]});
    for_each_array(p, [row](const char*, auto& values) {
      const auto value = values[row];
      values.push_back(value);
    });
  }

  bool doubled(int64_t row) const { return doubles_[row] >= 0; }
  int64_t double_of(int64_t row) const { return doubled(row) ? doubles_[row] : row; }
  int64_t column(int64_t row) const { return model_.points.column[row]; }

  /// Returns whether a spring lies in the cut and must become two.
  bool in_cut(int64_t p, int64_t q) const {
    return (doubled(p) || doubled(q)) &&
           (column(p) == column(q) || sides_.in_cut(column(p), column(q)));
  }

  bool left(int64_t row, const std::array<int64_t, 6>& prism) const {
    return sides_.left_triangle(column(row),
                                {column(prism[0]), column(prism[1]), column(prism[2])});
  }

  /// Sums the prisms' volume on either side of each point and spring in the cut.
  void measure_sides() {
    for (size_t m = 0; m < model_.prisms.points.size(); ++m) {
      const auto& prism = model_.prisms.points[m];
      for (int i = 0; i < 6; ++i)
        for (int j = i; j < 6; ++j) {
          const int64_t p = std::min(prism[i], prism[j]), q = std::max(prism[i], prism[j]);
          if (p == q ? !doubled(p) : !in_cut(p, q)) continue;
          volume_[{p, q}][left(doubled(p) ? p : q, prism)] += model_.prisms.rest_volume[m];
        }
    }
  }
  /// The share of the left side in what a point (p = q) or a spring has.
  double left_share(int64_t p, int64_t q) const {
    const auto& [right, left] = volume_.at(base::sorted_pair(p, q));
    return left / (left + right);
  }

  void share_loads() {
    Points& points = model_.points;
    for (const auto& [row, twin] : pairs_) {
      const double share = left_share(row, row);
      points.mass[twin] *= share;
      points.mass[row] *= 1 - share;
      points.external_force[twin] *= share;
      points.external_force[row] *= 1 - share;
    }
  }

  void add_spring(size_t row, const std::array<int64_t, 2>& ends, double share,
                  Springs& springs) const {
    const Springs& before = model_.springs;
    springs.points.push_back(ends);
    springs.set.push_back(before.set[row]);
    springs.rest_length.push_back(before.rest_length[row]);
    springs.stiffness.push_back(share * before.stiffness[row]);
    springs.exponent.push_back(before.exponent[row]);
    springs.reference.push_back(before.reference[row]);
  }
  /// The ends of a spring or edge that lies beside the cut, on its side.
  void move_to_side(int64_t& p, int64_t& q) const {
    const int64_t a = column(p), b = column(q);
    if (doubled(p) && sides_.left_edge(a, b)) p = doubles_[p];
    if (doubled(q) && sides_.left_edge(b, a)) q = doubles_[q];
  }
  /// A spring in the cut is followed by its left half, so that they stay sorted by set.
  void part_springs() {
    Springs springs;
    for (size_t j = 0; j < model_.springs.points.size(); ++j) {
      auto [p, q] = model_.springs.points[j];
      if (in_cut(p, q)) {
        const double share = left_share(p, q);
        add_spring(j, {p, q}, 1 - share, springs);
        add_spring(j, {double_of(p), double_of(q)}, share, springs);
        continue;
      }
      move_to_side(p, q);
      add_spring(j, {p, q}, 1, springs);
    }
    model_.springs = std::move(springs);
  }

  /// Returns the weights that skin tension and an initial equilibrium gave to a solid's edges.
  std::vector<double> weights_beyond_material() {
    std::vector<double> beyond = model_.edges.weight;
    if (!is_solid(model_)) return beyond;
    assemble_edges("", model_);
    for (size_t j = 0; j < beyond.size(); ++j) beyond[j] -= model_.edges.weight[j];
    return beyond;
  }

  /// The edges of the parted prisms, with what else they carried. An edge at the border of a piece
  /// may have prisms on one side only, whose share is all.
  void part_edges(const Edges& before, const std::vector<double>& beyond) {
    if (!is_solid(model_)) return;
    assemble_edges("", model_);
    for (size_t j = 0; j < before.points.size(); ++j) {
      auto [p, q] = before.points[j];
      if (in_cut(p, q)) {
        const double share = left_share(p, q);
        add_to_edge(p, q, (1 - share) * beyond[j], model_.edges);
        add_to_edge(double_of(p), double_of(q), share * beyond[j], model_.edges);
        continue;
      }
      move_to_side(p, q);
      add_to_edge(p, q, beyond[j], model_.edges);
    }
  }

  void part_prisms() {
    for (auto& prism : model_.prisms.points) {
      const std::array<int64_t, 6> before = prism;
      for (int64_t& row : prism)
        if (doubled(row) && left(row, before)) row = doubles_[row];
    }
  }

  void part_skin() {
    for (Triangle& t : model_.skin) {
      const Triangle columns = {column(t[0]), column(t[1]), column(t[2])};
      for (int64_t& row : t)
        if (doubled(row) && sides_.left_triangle(column(row), columns)) row = doubles_[row];
    }
  }

  Model& model_;
  const Cut& cut_;
  CutSides sides_;
  std::vector<int64_t> doubles_;  // [points before] the double of each, or −1
  std::vector<std::array<int64_t, 2>> pairs_;
  std::map<std::array<int64_t, 2>, std::array<double, 2>> volume_;  // mm³, right and left
};

}  // namespace

void add_skin_around(const std::vector<Vec3>& points, const std::vector<Triangle>& triangles,
                     Cut& cut) {
  const std::set<int64_t> columns(cut.columns.begin(), cut.columns.end());
  for (const Triangle& t : triangles) {
    if (std::ranges::any_of(t, [&](int64_t v) { return columns.contains(v); }))
      cut.around.push_back(t);
    for (int k = 0; k < 3; ++k)
      cut.edge += (points[t[k]] - points[t[(k + 1) % 3]]).norm() /
                  (3 * static_cast<double>(triangles.size()));
  }
}

std::vector<std::array<int64_t, 2>> cut_along(const Cut& cut, Model& model) {
  std::vector<std::array<int64_t, 2>> pairs = CutSplitter(cut, model).run();
  share_pairs(pairs, model);
  share_supports(pairs, model);
  if (cut.meets) add_cut_faces(cut, pairs, model);
  return pairs;
}

void make_cuts(const std::vector<Cut>& cuts, bool lips, Model& model) {
  for (const Cut& cut : cuts)
    if (cut.lips == lips) cut_along(cut, model);
}

}  // namespace repose::model
