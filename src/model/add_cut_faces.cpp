#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <set>

#include "add_contact.h"

namespace repose::model {

namespace {

/// The sides of a cut as nets: a column for each of the path's, a row for each layer and two more
/// round either edge, on the skin and, of a cut through all layers, inside.
class CutFaceBuilder {
 public:
  CutFaceBuilder(const Cut& cut, const std::vector<std::array<int64_t, 2>>& pairs,
                 const Model& model)
      : cut_(cut), model_(model) {
    const Points& points = model.points;
    for (const auto& [row, twin] : pairs) twin_of_[row] = twin;
    for (size_t p = 0; p < points.position.size(); ++p)
      row_of_.try_emplace({points.column[p], points.layer[p]}, static_cast<int64_t>(p));
    const int layers = 1 + *std::max_element(points.layer.begin(), points.layer.end());
    deepest_ = std::min(cut.layers, layers - 1);
    Vec3 before = Vec3::Zero();
    for (const int64_t column : cut.columns) {
      through_ = through_ || twin_of_.contains(node(column, deepest_));
      const Vec3& x = position(node(column, 0));
      along_.push_back(along_.empty() ? 0 : along_.back() + (x - before).norm());
      before = x;
    }
    find_skin_beside();
  }

  /// Keeps one side off the other, and the other's edges off the one: an edge would pass between
  /// places of a side.
  void build(CutFaces& cut_faces) const {
    if (cut_faces.begin.empty()) cut_faces.begin.push_back(0);
    const bool left = faces_away();
    add_nets(left, false, cut_faces);
    add_nets(!left, true, cut_faces);
  }

 private:
  static constexpr int beyond = 2;  // rows, round either edge
  using Shares = std::vector<std::pair<int64_t, double>>;

  /// Adds the net of a side that is kept off, with its edges alone or with all its places, and that
  /// of the surface. Seen from the other side columns are in reverse order, so that normals, along
  /// × inwards, point out of the surface.
  void add_nets(bool kept_off, bool edges_alone, CutFaces& cut_faces) const {
    const auto columns = static_cast<int64_t>(cut_.columns.size());
    const int64_t rows = deepest_ + 1 + beyond + (through_ ? beyond : 0);
    const auto column = [&](int64_t c) { return edges_alone ? columns - 1 - c / rows : c / rows; };
    const auto layer = [&](int64_t c) { return static_cast<int>(c % rows) - beyond; };
    cut_faces.size.push_back({columns, rows});
    for (const bool left : {kept_off, !kept_off})
      for (int64_t c = 0; c < columns * rows; ++c) {
        for (const auto& [point, weight] : control(column(c), layer(c), left)) {
          cut_faces.point.push_back(point);
          cut_faces.weight.push_back(weight);
        }
        cut_faces.begin.push_back(static_cast<int64_t>(cut_faces.point.size()));
      }
    for (int64_t c = 0; c < columns * rows; ++c) {
      const bool touches = !edges_alone || layer(c) == 0 || layer(c) == deepest_;
      cut_faces.area.push_back(touches ? area(column(c), layer(c)) : 0);
    }
  }

  int64_t node(int64_t column, int layer) const { return row_of_.at({column, layer}); }
  int64_t side_of(int64_t row, bool left) const {
    const auto twin = twin_of_.find(row);
    return left && twin != twin_of_.end() ? twin->second : row;
  }
  const Vec3& position(int64_t row) const { return model_.points.position[row]; }

  /// Next to each parted point of the skin the skin's points that are not in the cut.
  void find_skin_beside() {
    std::set<int64_t> in_cut;
    for (const int64_t column : cut_.columns)
      for (const bool left : {false, true}) in_cut.insert(side_of(node(column, 0), left));
    for (const Triangle& t : model_.skin)
      for (int k = 0; k < 3; ++k) {
        const int64_t p = t[k], q = t[(k + 1) % 3];
        if (in_cut.contains(p) && !in_cut.contains(q)) beside_[p].insert(q);
        if (in_cut.contains(q) && !in_cut.contains(p)) beside_[q].insert(p);
      }
  }

  /// Layers −1 and −2, and as many beyond the deepest, lie round the edge, on the skin or inside.
  /// The spline rounds an edge by a sixth of the way to the first of them.
  Shares control(size_t i, int layer, bool left) const {
    constexpr double first = 0.2, second = 1.5, max_first = 1.2;  // edges of the skin; mm
    const int inner = std::clamp(layer, 0, deepest_);
    Shares shares = {{side_of(node(cut_.columns[i], inner), left), 1.0}};
    if (layer == inner) return shares;
    const Shares direction = shares_around(i, inner, left);
    Vec3 length = Vec3::Zero();
    for (const auto& [point, weight] : direction) length += weight * position(point);
    const double distance =
        std::abs(layer - inner) == 1 ? std::min(first * cut_.edge, max_first) : second * cut_.edge;
    for (const auto& [point, weight] : direction)
      shares.emplace_back(point, distance / length.norm() * weight);
    return shares;
  }
  /// The way from an edge's points to those beside them, as a mean over the columns nearby.
  Shares shares_around(size_t i, int layer, bool left) const {
    constexpr double reach = 1.5;  // edges
    Shares direction;
    double sum = 0;
    for (size_t k = 0; k < along_.size(); ++k) {
      const double weight = 1 - std::abs(along_[k] - along_[i]) / (reach * cut_.edge);
      const int64_t row = node(cut_.columns[k], 0);
      const auto beside = beside_.find(side_of(row, left));
      if (weight <= 0 || !twin_of_.contains(row) || beside == beside_.end()) continue;
      for (const int64_t p : beside->second)
        direction.emplace_back(layer == 0 ? p : node(model_.points.column[p], layer),
                               weight / static_cast<double>(beside->second.size()));
      direction.emplace_back(side_of(node(cut_.columns[k], layer), left), -weight);
      sum += weight;
    }
    for (auto& share : direction) share.second /= sum;
    return direction;
  }

  /// mm², what a place stands for; 0 where the sides hang together.
  double area(int64_t column, int layer) const {
    const auto at = [&](int64_t i, int l) -> const Vec3& {
      return position(node(cut_.columns[i], l));
    };
    if (layer < 0 || layer > deepest_ || !twin_of_.contains(node(cut_.columns[column], layer)))
      return 0;
    double area = 0;
    for (const int i : {-1, 1})
      for (const int l : {-1, 1}) {
        const auto last = static_cast<int64_t>(cut_.columns.size()) - 1;
        if (column + i < 0 || column + i > last || layer + l < 0 || layer + l > deepest_) continue;
        const Vec3& x = at(column, layer);
        area += (at(column + i, layer) - x).cross(at(column, layer + l) - x).norm() / 4;
      }
    return area;
  }

  /// Returns whether a net's normal, along the cut × inwards, points into the tissue of the
  /// doubles.
  bool faces_away() const {
    const auto& x = model_.points.position;
    std::map<int64_t, std::pair<Vec3, int>> middle;  // of the doubles' prisms, by what is doubled
    std::map<int64_t, int64_t> row_of;
    for (const auto& [row, twin] : twin_of_) row_of[twin] = row;
    for (const auto& prism : model_.prisms.points) {
      Vec3 mean = Vec3::Zero();
      for (const int64_t p : prism) mean += x[p] / 6;
      for (const int64_t p : prism)
        if (const auto found = row_of.find(p); found != row_of.end()) {
          auto& [sum, count] = middle.try_emplace(found->second, Vec3::Zero(), 0).first->second;
          sum += mean;
          ++count;
        }
    }
    double outwards = 0;
    for (size_t i = 0; i + 1 < cut_.columns.size(); ++i)
      for (int l = 0; l < deepest_; ++l) {
        const int64_t row = node(cut_.columns[i], l);
        const auto found = middle.find(row);
        if (found == middle.end()) continue;
        const auto& [sum, count] = found->second;
        outwards += (x[node(cut_.columns[i + 1], l)] - x[row])
                        .cross(x[node(cut_.columns[i], l + 1)] - x[row])
                        .dot(x[row] - sum / count);
      }
    return outwards < 0;
  }

  const Cut& cut_;
  const Model& model_;
  int deepest_ = 0;
  bool through_ = false;
  std::vector<double> along_;  // mm, of the path's columns
  std::map<int64_t, int64_t> twin_of_;
  std::map<std::array<int64_t, 2>, int64_t> row_of_;  // column, layer
  std::map<int64_t, std::set<int64_t>> beside_;
};

}  // namespace

void add_cut_faces(const Cut& cut, const std::vector<std::array<int64_t, 2>>& pairs, Model& model) {
  CutFaceBuilder(cut, pairs, model).build(model.contact.cut_faces);
}

}  // namespace repose::model
