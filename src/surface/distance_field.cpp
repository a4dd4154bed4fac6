#include "repose/surface/distance_field.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>

#include "line_winding.h"
#include "repose/base/error.h"

namespace repose::surface {

namespace {

constexpr int b = 8;  // grid points along an edge of a block
constexpr int64_t cells = int64_t{b} * b * b;
constexpr double max_blocks = 1 << 22;

TriangleTree::Box box_of(const Surface& surface) {
  TriangleTree::Box box;
  for (const Triangle& triangle : surface.triangles)
    box.extend(TriangleTree::box_of(corners(surface, triangle)));
  return box;
}

}  // namespace

DistanceField::DistanceField(Surface surface, double spacing, double reach)
    : surface_(std::move(surface)) {
  const TriangleTree::Box box = box_of(surface_);
  const double margin = reach + 4 * spacing;
  const Vec3 origin = box.low - Vec3::Constant(margin);
  const Vec3 blocks = (box.high - origin + Vec3::Constant(margin)) / (b * spacing);
  if (!((blocks + Vec3::Ones()).prod() <= max_blocks))
    base::refuse(
        "{}: distances to this mesh on a grid of {:g} mm would need {:.2g} grid points, expected "
        "at most {:.2g}; make contact.grid larger",
        surface_.name, spacing, blocks.prod() * cells, max_blocks * cells);
  grid_ = {origin, spacing, reach, {}, false};
  for (int a = 0; a < 3; ++a) grid_.blocks[a] = 1 + static_cast<int64_t>(blocks[a]);
}

DistanceField DistanceField::rounded(double times) const {
  constexpr double reach = 4;  // spacings, at least: what a stencil spans
  if (surface_.triangles.empty()) return {};
  const double spacing = times * grid_.spacing;
  DistanceField field(surface_, spacing, std::max(grid_.reach, reach * spacing));
  field.grid_.rounded = true;
  return field;
}

Vec3 DistanceField::Grid::point(const Index& at) const {
  return origin + spacing * Vec3(static_cast<double>(at[0]), static_cast<double>(at[1]),
                                 static_cast<double>(at[2]));
}

DistanceField::Index DistanceField::Grid::nearest(const Vec3& at) const {
  Index index;
  for (int a = 0; a < 3; ++a)
    index[a] = static_cast<int64_t>(std::floor((at[a] - origin[a]) / spacing + 0.5));
  return index;
}

DistanceField::Index DistanceField::grid_points() const {
  return {b * grid_.blocks[0], b * grid_.blocks[1], b * grid_.blocks[2]};
}

/// The grid values that are known, and what computes the others.
class DistanceField::Values {
 public:
  Values(const Surface& surface, const Grid& grid)
      : grid_(grid),
        place_(grid.blocks[0] * grid.blocks[1] * grid.blocks[2], unknown),
        tree_(surface) {}

  float at(const Index& at) {
    const int64_t begin = block_begin({at[0] / b, at[1] / b, at[2] / b});
    return begin < 0 ? farthest() : cell_value(begin, at);
  }

  /// [4³] The coefficients from grid point `first` on, x running fastest; false if all are `reach`.
  bool gather(const Index& first, std::array<float, 64>& coefficients) {
    const Index low{first[0] / b, first[1] / b, first[2] / b},
        high{(first[0] + 3) / b, (first[1] + 3) / b, (first[2] + 3) / b};
    std::array<int64_t, 8> begin;
    bool any = false;
    for (int n = 0; n < 8; ++n) {
      begin[n] = block_begin(
          {n & 1 ? high[0] : low[0], n & 2 ? high[1] : low[1], n & 4 ? high[2] : low[2]});
      any = any || begin[n] >= 0;
    }
    if (!any) return false;
    any = false;
    for (int n = 0; n < 64; ++n) {
      const Index at{first[0] + n % 4, first[1] + n / 4 % 4, first[2] + n / 16};
      const int64_t from =
          begin[(at[0] / b > low[0]) + 2 * (at[1] / b > low[1]) + 4 * (at[2] / b > low[2])];
      coefficients[n] = from < 0 ? farthest() : coefficient(from, at);
      any = any || coefficients[n] != farthest();
    }
    return any;
  }

  /// A lower bound of the spline at a point of the grid: of grid points in order of what their
  /// distances cost, that of the first which reaches `enough`, or else of the point itself.
  double lower_bound(const Vec3& point, double enough) {
    const Index nearest = grid_.nearest(point);
    const Index block{nearest[0] / b, nearest[1] / b, nearest[2] / b};
    const Index middle{b * block[0] + b / 2, b * block[1] + b / 2, b * block[2] + b / 2};
    const int64_t begin = block_begin(block);
    const auto bound = [&](const Index& at, double distance) {
      return distance - (grid_.point(at) - point).norm() - smoothing();
    };
    if (begin < 0) return std::min(grid_.reach, bound(middle, enough_far()));
    const double by_middle = bound(middle, middle_[begin / cells]);
    if (by_middle >= enough) return by_middle;
    const double value = cell_value(begin, nearest), by_nearest = bound(nearest, value);
    if (by_nearest >= enough || value < 0) return by_nearest;
    const double exact = outside(point).value;
    // On the other side of the surface than the grid point, it is no farther from it than that.
    const bool same_side = exact > (grid_.point(nearest) - point).norm();
    return same_side ? exact - smoothing() : by_nearest;
  }

  /// Distance and direction from the closest triangle, `reach` and 0 beyond.
  Distance outside(const Vec3& point) {
    const TriangleTree::Nearest nearest = tree_.nearest(point, search_limit(point));
    if (nearest.triangle >= 0) last_triangle_ = nearest.triangle;
    const double distance = std::sqrt(nearest.squared);
    if (nearest.triangle < 0 || distance >= grid_.reach)
      return {grid_.reach, Vec3::Zero(), Mat3::Zero()};
    return {distance, (point - nearest.point) / distance, Mat3::Zero()};
  }

  int64_t count() const {
    return std::count_if(value_.begin(), value_.end(), [](float v) { return !std::isnan(v); });
  }

 private:
  /// mm, by which the spline is less than the distance, at most: the largest sum over grid points
  /// of the weight's size times the distance to them. Single precision is allowed for.
  double smoothing() const { return (grid_.rounded ? 0.97 : 1.67) * grid_.spacing + 1e-5; }

  float farthest() const { return static_cast<float>(grid_.reach); }

  /// Where the values of a block begin, −1 where all are `reach`.
  int64_t block_begin(const Index& block) {
    int32_t& place = place_[(block[2] * grid_.blocks[1] + block[1]) * grid_.blocks[0] + block[0]];
    if (place == unknown) {
      const Index middle{b * block[0] + b / 2, b * block[1] + b / 2, b * block[2] + b / 2};
      const double distance = signed_distance(middle);
      if (distance >= enough_far()) {
        place = far;
      } else {
        place = static_cast<int32_t>(value_.size() / cells);
        value_.resize(value_.size() + cells, NAN);
        if (!grid_.rounded) coefficient_.resize(value_.size(), NAN);
        middle_.push_back(kept(distance));
      }
    }
    return place == far ? -1 : place * cells;
  }

  /// The number of a grid point in its block.
  static int64_t cell_of(const Index& at) { return ((at[2] % b) * b + at[1] % b) * b + at[0] % b; }

  float kept(double distance) const { return static_cast<float>(std::min(distance, grid_.reach)); }

  float cell_value(int64_t begin, const Index& at) {
    float& value = value_[begin + cell_of(at)];
    if (std::isnan(value)) value = kept(signed_distance(at));
    return value;
  }

  /// The value, less a sixth of its second differences unless the field is rounded.
  float coefficient(int64_t begin, const Index& at) {
    if (grid_.rounded) return cell_value(begin, at);
    const int64_t cell = begin + cell_of(at);
    if (!std::isnan(coefficient_[cell])) return coefficient_[cell];
    double sum = 0;
    for (int a = 0; a < 3; ++a)
      for (const int side : {-1, 1}) {
        Index beside = at;
        beside[a] += side;
        sum += this->at(beside);
      }
    const float here = this->at(at);
    return coefficient_[cell] = static_cast<float>(here - (sum - 6 * here) / 6);
  }

  /// mm. Where the middle of a block or a point of a stencil is as far outside, the others are
  /// farther than `reach`.
  double enough_far() const { return grid_.reach + b * grid_.spacing; }

  /// Exact up to rounding where it is below `reach`, otherwise `reach` or more. Where the last
  /// point is nearer than the surface is to it or to this one, both are on one side.
  double signed_distance(const Index& at) {
    const Vec3 point = grid_.point(at);
    const double travel = (1 + 1e-9) * (point - last_point_).norm();
    if (travel < last_distance_ && last_distance_ - travel >= grid_.reach)
      return last_distance_ - travel;
    TriangleTree::Nearest nearest = tree_.nearest(point, search_limit(point));
    double distance = nearest.triangle < 0 ? enough_far() : std::sqrt(nearest.squared);
    const bool same_side = travel < std::max(std::abs(last_distance_), distance);
    const bool inside = same_side ? last_distance_ < 0 : is_inside(at, point);
    if (nearest.triangle < 0 && inside) {
      nearest = tree_.nearest(point);
      distance = std::sqrt(nearest.squared);
    }
    if (nearest.triangle >= 0) last_triangle_ = nearest.triangle;
    last_point_ = point;
    last_distance_ = inside ? -distance : distance;
    return last_distance_;
  }

  /// mm², above that of the closest triangle, or that of enough_far().
  double search_limit(const Vec3& point) const {
    const double largest = enough_far() * enough_far();
    if (last_triangle_ < 0) return largest;
    const double squared = squared_distance(point, tree_.corners_of(last_triangle_));
    return std::fmin(largest, (1 + 1e-9) * squared + 1e-12 * grid_.spacing * grid_.spacing);
  }

  bool is_inside(const Index& at, const Vec3& point) {
    const auto [line, is_new] = lines_.try_emplace(at[2] * b * grid_.blocks[1] + at[1]);
    if (is_new) line->second = line_crossings(tree_, point.y(), point.z());
    return winding_number(tree_, line->second, point) != 0;
  }

  static constexpr int32_t unknown = -1, far = -2;
  Grid grid_;
  std::vector<int32_t> place_;      // [blocks] which of the kept ones, or unknown or far
  std::vector<float> value_;        // [kept blocks][8³] mm, not a number where it is not known
  std::vector<float> coefficient_;  // the same
  std::vector<float> middle_;       // [kept blocks] mm, a value in the middle
  TriangleTree tree_;
  std::unordered_map<int64_t, std::vector<LineCrossing>> lines_;  // by (j, k)
  Vec3 last_point_ = Vec3::Constant(std::numeric_limits<double>::infinity());
  double last_distance_ = 0;
  int64_t last_triangle_ = -1;
};

DistanceField::Values& DistanceField::values() const {
  if (!values_) values_ = std::make_shared<Values>(surface_, grid_);
  return *values_;
}

float DistanceField::value_at(const Index& at) const { return values().at(at); }

int64_t DistanceField::computed_values() const { return values_ ? values_->count() : 0; }

/// The first of the 4³ grid points around a point, and the weights of each axis with two
/// derivatives.
struct DistanceField::Stencil {
  Index first;
  std::array<std::array<double, 4>, 3> weight, slope, bend;
};

bool DistanceField::locate(const Vec3& point, Stencil& stencil) const {
  for (int a = 0; a < 3; ++a) {
    const double at = (point[a] - grid_.origin[a]) / grid_.spacing;
    if (!(at >= 2 && at < static_cast<double>(b * grid_.blocks[a] - 3))) return false;
    stencil.first[a] = static_cast<int64_t>(at) - 1;
    const double t = at - static_cast<double>(stencil.first[a] + 1), u = 1 - t;
    stencil.weight[a] = {u * u * u / 6, 2.0 / 3 - t * t * (1 - t / 2),
                         2.0 / 3 - u * u * (1 - u / 2), t * t * t / 6};
    stencil.slope[a] = {-u * u / 2, t * (1.5 * t - 2), -u * (1.5 * u - 2), t * t / 2};
    stencil.bend[a] = {u, 3 * t - 2, 3 * u - 2, t};
  }
  return true;
}

double DistanceField::lower_bound(const Vec3& point, double enough) const {
  Stencil at;
  return locate(point, at) ? values().lower_bound(point, enough) : grid_.reach;
}

Distance DistanceField::outside(const Vec3& point) const {
  Stencil at;
  if (!locate(point, at)) return {grid_.reach, Vec3::Zero(), Mat3::Zero()};
  return values().outside(point);
}

double DistanceField::value(const Vec3& point) const { return sample(point).value; }

Distance DistanceField::sample(const Vec3& point) const {
  Distance result{grid_.reach, Vec3::Zero(), Mat3::Zero()};
  Stencil at;
  std::array<float, 64> values;
  if (!locate(point, at) || !this->values().gather(at.first, values)) return result;
  double value = 0;
  Vec3 slope = Vec3::Zero();
  Mat3 bend = Mat3::Zero();
  for (int k = 0; k < 4; ++k)
    for (int j = 0; j < 4; ++j) {
      double v = 0, vx = 0, vxx = 0;
      for (int i = 0; i < 4; ++i) {
        const double f = values[16 * k + 4 * j + i];
        v += at.weight[0][i] * f;
        vx += at.slope[0][i] * f;
        vxx += at.bend[0][i] * f;
      }
      const double y = at.weight[1][j], z = at.weight[2][k], ys = at.slope[1][j],
                   zs = at.slope[2][k];
      value += y * z * v;
      slope += Vec3(y * z * vx, ys * z * v, y * zs * v);
      bend(0, 0) += y * z * vxx;
      bend(1, 1) += at.bend[1][j] * z * v;
      bend(2, 2) += y * at.bend[2][k] * v;
      bend(0, 1) += ys * z * vx;
      bend(0, 2) += y * zs * vx;
      bend(1, 2) += ys * zs * v;
    }
  bend.triangularView<Eigen::StrictlyLower>() = bend.transpose();
  return {value, slope / grid_.spacing, bend / (grid_.spacing * grid_.spacing)};
}

}  // namespace repose::surface
