#include "repose/surface/distance_field.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "repose/base/error.h"
#include "repose/surface/triangle_tree.h"

namespace repose::surface {

namespace {

constexpr int b = DistanceField::block;
constexpr int64_t cells = int64_t{b} * b * b;
constexpr int64_t most_blocks = int64_t{1} << 27;
constexpr size_t most_values = size_t{1} << 26;

[[noreturn]] void refuse_grid(double spacing) {
  base::refuse(
      "the distances to a body of contact would take more than {} million points of a grid of {:g} "
      "mm; make contact.grid larger",
      most_values >> 20, spacing);
}

/// Normals of a surface's features, weighted by angle at vertices.
class Pseudonormals {
 public:
  explicit Pseudonormals(const Surface& surface)
      : surface_(surface), vertex_(surface.points.size(), Vec3::Zero()) {
    for (const Triangle& t : surface.triangles) {
      const Vec3 normal = normal_of(t);
      face_.push_back(normal);
      for (int k = 0; k < 3; ++k) {
        const Vec3 &at = surface.points[t[k]], one = surface.points[t[(k + 1) % 3]] - at,
                   other = surface.points[t[(k + 2) % 3]] - at;
        vertex_[t[k]] += std::atan2(one.cross(other).norm(), one.dot(other)) * normal;
        edge_.try_emplace(std::minmax(t[k], t[(k + 1) % 3]), Vec3::Zero()).first->second += normal;
      }
    }
  }

  /// Whether `query` lies on the inner side of the feature of a triangle that `closest` is on.
  bool inside(const Vec3& query, int32_t triangle, const Vec3& closest) const {
    constexpr double on = 1e-9;  // of the triangle's size
    const Triangle& t = surface_.triangles[triangle];
    std::array<double, 3> share;
    const std::array<Vec3, 3> x{surface_.points[t[0]], surface_.points[t[1]],
                                surface_.points[t[2]]};
    const Vec3& normal = face_[triangle];
    double sum = 0;
    for (int k = 0; k < 3; ++k)
      sum += share[k] =
          normal.dot((x[(k + 2) % 3] - x[(k + 1) % 3]).cross(closest - x[(k + 1) % 3]));
    std::array<int, 3> zero{};
    int zeros = 0;
    for (int k = 0; k < 3; ++k)
      if (share[k] <= on * sum) zero[zeros++] = k;
    const Vec3 way = query - closest;
    if (zeros == 0) return way.dot(normal) < 0;
    if (zeros == 1) {
      const int k = zero[0];
      return way.dot(edge_.at(std::minmax(t[(k + 1) % 3], t[(k + 2) % 3]))) < 0;
    }
    const int corner = zeros == 2 ? 3 - zero[0] - zero[1] : 0;
    return way.dot(vertex_[t[corner]]) < 0;
  }

 private:
  Vec3 normal_of(const Triangle& t) const {
    const auto& x = surface_.points;
    const Vec3 normal = (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]);
    const double size = normal.norm();
    return size > 0 ? Vec3(normal / size) : Vec3::Zero();
  }

  const Surface& surface_;
  std::vector<Vec3> face_, vertex_;
  std::map<std::pair<int64_t, int64_t>, Vec3, std::less<>> edge_;
};

int64_t count_blocks(const std::array<int32_t, 3>& size) {
  return int64_t{size[0]} * size[1] * size[2];
}

}  // namespace

void DistanceField::lay_grid(const Surface& surface) {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const Triangle& t : surface.triangles)
    for (const int64_t p : t) {
      low = low.cwiseMin(surface.points[p]);
      high = high.cwiseMax(surface.points[p]);
    }
  const double margin = reach_ + 3 * spacing_;
  origin_ = low - Vec3::Constant(margin);
  for (int a = 0; a < 3; ++a)
    size_[a] = 1 + static_cast<int32_t>((high[a] - low[a] + 2 * margin) / (b * spacing_));
  if (count_blocks(size_) > most_blocks) refuse_grid(spacing_);
}

/// Fills a field: closest triangles are found near the surface and handed on from grid point to
/// grid point, on both sides as far as outsides are asked for; then signs; then deeper inside.
class FieldBuilder {
 public:
  FieldBuilder(const Surface& surface, DistanceField& field)
      : surface_(surface), normals_(surface), field_(field) {
    for (int a = 0; a < 3; ++a) points_[a] = int64_t{b} * field.size_[a];
    field.place_.assign(count_blocks(field.size_), -1);
  }

  /// Leaves out the blocks that are not wanted, if any is.
  void want(const std::vector<char>& wanted) {
    wanted_ = wanted;
    if (std::find(wanted.begin(), wanted.end(), 1) == wanted.end())
      wanted_.assign(field_.place_.size(), 1);
  }

  void fill() {
    limit_ = field_.reach_ + 2 * field_.spacing_;
    for (size_t t = 0; t < surface_.triangles.size(); ++t) begin_at(static_cast<int32_t>(t));
    spread();
    give_signs();
    limit_ = field_.depth_;
    spread();
    for (float& value : field_.value_) value = std::min(value, static_cast<float>(field_.reach_));
  }

 private:
  using Index = std::array<int64_t, 3>;
  int64_t block_row(int64_t i, int64_t j, int64_t k) const {
    return (k * field_.size_[1] + j) * field_.size_[0] + i;
  }

  /// Where the value of a grid point is kept, −1 if it is not wanted.
  int64_t slot(const Index& at) {
    for (int a = 0; a < 3; ++a)
      if (at[a] < 0 || at[a] >= points_[a]) return -1;
    const int64_t row = block_row(at[0] / b, at[1] / b, at[2] / b);
    if (!wanted_[row]) return -1;
    int32_t& place = field_.place_[row];
    if (place < 0) {
      if (field_.value_.size() >= most_values) refuse_grid(field_.spacing_);
      place = static_cast<int32_t>(field_.value_.size() / cells);
      field_.value_.resize(field_.value_.size() + cells, std::numeric_limits<float>::infinity());
      triangle_.resize(field_.value_.size(), -1);
    }
    return place * cells + cell(at);
  }

  static int64_t cell(const Index& at) { return ((at[2] % b) * b + at[1] % b) * b + at[0] % b; }

  Vec3 place_of(const Index& at) const {
    return field_.origin_ + field_.spacing_ * Vec3(static_cast<double>(at[0]),
                                                   static_cast<double>(at[1]),
                                                   static_cast<double>(at[2]));
  }

  /// Hands triangles on from the grid points in the queue to their neighbours, up to limit_.
  void spread() {
    while (!queue_.empty())
      for (const Index& at : std::exchange(queue_, {})) {
        const int32_t triangle = triangle_[slot(at)];
        for_neighbours(at, [&](const Index& beside) {
          if (triangle == deep)
            sink(beside);
          else
            offer(beside, triangle);
        });
      }
  }

  template <class Visit>
  static void for_neighbours(const Index& at, Visit&& visit) {
    for (int a = 0; a < 3; ++a)
      for (const int64_t step : {-1, 1}) {
        Index beside = at;
        beside[a] += step;
        visit(beside);
      }
  }

  /// The distance of a grid point to a triangle, where it is the smallest yet: as if outside until
  /// signs are given, then inside, where all else is known.
  void offer(const Index& at, int32_t triangle) {
    const int64_t row = slot(at);
    if (row < 0 || triangle_[row] == triangle || (signed_ && outside(row))) return;
    const auto distance = static_cast<float>(
        std::sqrt(squared_distance(place_of(at), corners(surface_, surface_.triangles[triangle]))));
    if (!(distance < std::abs(field_.value_[row]))) return;
    if (signed_ && !(distance < limit_)) return sink(at);
    field_.value_[row] = signed_ ? -distance : distance;
    triangle_[row] = triangle;
    if (distance < limit_) queue_.push_back(at);
  }

  bool outside(int64_t row) const {
    return std::isfinite(field_.value_[row]) && field_.value_[row] > 0;
  }

  /// Grid neighbours whose distances add up to more than their own lie on one side: they vote. One
  /// alone is misled where the closest triangle is a sliver, whose normal says little. Those inside
  /// are left in the queue.
  void give_signs() {
    signed_ = true;
    std::vector<char> seen(field_.value_.size(), 0);
    for (int64_t row = 0; row < static_cast<int64_t>(field_.place_.size()); ++row) {
      if (field_.place_[row] < 0) continue;
      const Index block{row % field_.size_[0], row / field_.size_[0] % field_.size_[1],
                        row / field_.size_[0] / field_.size_[1]};
      for (int64_t c = 0; c < cells; ++c)
        give_sign({b * block[0] + c % b, b * block[1] + c / b % b, b * block[2] + c / b / b}, seen);
    }
  }

  void give_sign(const Index& first, std::vector<char>& seen) {
    if (!known(first) || seen[slot(first)]) return;
    std::vector<Index> side{first};
    seen[slot(first)] = 1;
    int64_t votes = 0;
    for (size_t next = 0; next < side.size(); ++next) {
      const Index at = side[next];
      votes += is_inside(at) ? 1 : -1;
      for_neighbours(at, [&](const Index& beside) {
        if (!known(beside) || seen[slot(beside)]) return;
        if (!(field_.value_[slot(at)] + field_.value_[slot(beside)] > field_.spacing_)) return;
        seen[slot(beside)] = 1;
        side.push_back(beside);
      });
    }
    if (votes <= 0) return;
    for (const Index& at : side) {
      field_.value_[slot(at)] *= -1;
      queue_.push_back(at);
    }
  }

  /// Whether a grid point has a distance; makes no block.
  bool known(const Index& at) const {
    for (int a = 0; a < 3; ++a)
      if (at[a] < 0 || at[a] >= points_[a]) return false;
    const int32_t place = field_.place_[block_row(at[0] / b, at[1] / b, at[2] / b)];
    return place >= 0 && std::isfinite(field_.value_[place * cells + cell(at)]);
  }

  bool is_inside(const Index& at) {
    const int32_t triangle = triangle_[slot(at)];
    Vec3 closest;
    squared_distance(place_of(at), corners(surface_, surface_.triangles[triangle]), &closest);
    return normals_.inside(place_of(at), triangle, closest);
  }

  /// A grid point is deeper inside than anybody asks for.
  void sink(const Index& at) {
    const int64_t row = slot(at);
    if (row < 0 || std::isfinite(field_.value_[row])) return;
    field_.value_[row] = static_cast<float>(-field_.depth_);
    triangle_[row] = deep;
    queue_.push_back(at);
  }

  void begin_at(int32_t triangle) {
    const Corners x = corners(surface_, surface_.triangles[triangle]);
    Index low, high;
    for (int a = 0; a < 3; ++a) {
      const auto [least, most] = std::minmax({x[0][a], x[1][a], x[2][a]});
      low[a] = static_cast<int64_t>(std::floor((least - field_.origin_[a]) / field_.spacing_));
      high[a] = static_cast<int64_t>(std::ceil((most - field_.origin_[a]) / field_.spacing_));
    }
    for (int64_t k = low[2]; k <= high[2]; ++k)
      for (int64_t j = low[1]; j <= high[1]; ++j)
        for (int64_t i = low[0]; i <= high[0]; ++i) offer({i, j, k}, triangle);
  }

  const Surface& surface_;
  Pseudonormals normals_;
  DistanceField& field_;
  Index points_{};                 // grid points along each axis
  std::vector<char> wanted_;       // [blocks]
  std::vector<int32_t> triangle_;  // [kept values] the closest, −1 or deep
  std::vector<Index> queue_;
  bool signed_ = false;
  double limit_ = 0;  // mm, up to which triangles are handed on
  static constexpr int32_t deep = -2;
};

DistanceField::DistanceField(const Surface& surface, double spacing, double reach,
                             const std::vector<char>& wanted, double near)
    : spacing_(spacing), reach_(reach), depth_(std::max(near, reach)) {
  lay_grid(surface);
  FieldBuilder builder(surface, *this);
  builder.want(wanted);
  builder.fill();
}

std::vector<char> DistanceField::blocks_near(const Surface& surface, double spacing, double reach,
                                             const std::vector<Vec3>& points, double near) {
  DistanceField grid;
  grid.spacing_ = spacing;
  grid.reach_ = reach;
  grid.lay_grid(surface);
  const auto& size = grid.size_;
  std::vector<char> wanted(count_blocks(size), 0);
  for (const Vec3& point : points) {
    std::array<int64_t, 3> low, high;
    for (int a = 0; a < 3; ++a) {
      const double at = (point[a] - grid.origin_[a]) / spacing, wide = near / spacing + 2;
      low[a] = std::max<int64_t>(0, static_cast<int64_t>(std::floor((at - wide) / b)));
      high[a] = std::min<int64_t>(size[a] - 1, static_cast<int64_t>(std::floor((at + wide) / b)));
    }
    for (int64_t k = low[2]; k <= high[2]; ++k)
      for (int64_t j = low[1]; j <= high[1]; ++j)
        for (int64_t i = low[0]; i <= high[0]; ++i) wanted[(k * size[1] + j) * size[0] + i] = 1;
  }
  return wanted;
}

/// The 4³ grid points around a point, and the weights of each axis with two derivatives.
struct DistanceField::Corner {
  std::array<std::array<int32_t, 4>, 3> block_at, cell_at;
  std::array<std::array<double, 4>, 3> weight, slope, bend;
};

bool DistanceField::locate(const Vec3& point, Corner& corner) const {
  for (int a = 0; a < 3; ++a) {
    const double at = (point[a] - origin_[a]) / spacing_;
    if (!(at >= 1 && at < b * size_[a] - 2)) return false;
    const auto first = static_cast<int32_t>(at) - 1;
    const double t = at - (first + 1), u = 1 - t;
    for (int k = 0; k < 4; ++k) {
      corner.block_at[a][k] = (first + k) / b;
      corner.cell_at[a][k] = (first + k) % b;
    }
    corner.weight[a] = {u * u * u / 6, 2.0 / 3 - t * t * (1 - t / 2), 2.0 / 3 - u * u * (1 - u / 2),
                        t * t * t / 6};
    corner.slope[a] = {-u * u / 2, t * (1.5 * t - 2), -u * (1.5 * u - 2), t * t / 2};
    corner.bend[a] = {u, 3 * t - 2, 3 * u - 2, t};
  }
  return true;
}

double DistanceField::value(const Vec3& point) const { return sample(point).value; }

Distance DistanceField::sample(const Vec3& point) const {
  Distance result{reach_, Vec3::Zero(), Mat3::Zero()};
  Corner at;
  if (value_.empty() || !locate(point, at)) return result;
  double value = 0;
  Vec3 slope = Vec3::Zero();
  Mat3 bend = Mat3::Zero();
  for (int k = 0; k < 4; ++k)
    for (int j = 0; j < 4; ++j) {
      double v = 0, vx = 0, vxx = 0;
      for (int i = 0; i < 4; ++i) {
        const int64_t row = (int64_t{at.block_at[2][k]} * size_[1] + at.block_at[1][j]) * size_[0] +
                            at.block_at[0][i];
        if (place_[row] < 0) return result;
        const double f =
            value_[place_[row] * cells + (int64_t{at.cell_at[2][k]} * b + at.cell_at[1][j]) * b +
                   at.cell_at[0][i]];
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
  return {value, slope / spacing_, bend / (spacing_ * spacing_)};
}

}  // namespace repose::surface
