#include "cut_faces.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>

namespace repose::tools::check {

namespace {

using Parameters = Eigen::Vector2d;  // along the cut, inwards

/// Cubic cardinal B-spline and its slope at a distance from its middle, in knots.
double bell(double x) {
  const double a = std::abs(x);
  if (a >= 2) return 0;
  return a >= 1 ? std::pow(2 - a, 3) / 6 : 2.0 / 3 - a * a + a * a * a / 2;
}
double bell_slope(double x) {
  const double a = std::abs(x), sign = x < 0 ? -1 : 1;
  if (a >= 2) return 0;
  return sign * (a >= 1 ? -std::pow(2 - a, 2) / 2 : 1.5 * a * a - 2 * a);
}

/// One side of a cut.
class Side {
 public:
  Side(const model::CutFaces& cuts, size_t first, int columns, int rows,
       std::span<const Vec3> position)
      : columns_(columns), rows_(rows) {
    for (size_t c = first; c < first + static_cast<size_t>(columns) * rows; ++c) {
      Vec3 control = Vec3::Zero();
      for (int64_t k = cuts.begin[c]; k < cuts.begin[c + 1]; ++k)
        control += cuts.weight[k] * position[cuts.point[k]];
      controls_.push_back(control);
    }
    for (int i = -2; i <= 2 * columns; ++i)
      for (int j = 0; j <= 2 * (rows - 1); ++j) halves_[{i, j}] = point(at_half(i, j));
  }

  Vec3 point(const Parameters& at) const {
    return sum(at, [](double x, double y) { return bell(x) * bell(y); });
  }
  /// Derivatives along the cut and inwards.
  std::array<Vec3, 2> slopes(const Parameters& at) const {
    return {sum(at, [](double x, double y) { return bell_slope(x) * bell(y); }),
            sum(at, [](double x, double y) { return bell(x) * bell_slope(y); })};
  }
  static Parameters begin() { return {-1, 0}; }
  Parameters end() const { return {columns_, rows_ - 1}; }
  /// Half parameters where this is nearer to a place than at those around.
  std::vector<Parameters> nearer_than_around(const Vec3& place) const {
    std::vector<Parameters> found;
    for (const auto& [number, half] : halves_) {
      bool nearer = true;
      for (const auto& [i, j] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}})
        if (const auto beside = halves_.find({number[0] + i, number[1] + j});
            beside != halves_.end())
          nearer = nearer && (half - place).norm() <= (beside->second - place).norm();
      if (nearer) found.push_back(at_half(number[0], number[1]));
    }
    return found;
  }

 private:
  /// A control; those beyond the ends lie in a straight line with the last two.
  Vec3 control(int column, int row) const {
    const auto beyond = [](int at, int count) {
      return at < 0 ? at : at >= count ? at - count + 1 : 0;
    };
    if (const int off = beyond(column, columns_); off != 0) {
      const int end = off < 0 ? 0 : columns_ - 1, inner = off < 0 ? 1 : columns_ - 2;
      return (1 + std::abs(off)) * control(end, row) - std::abs(off) * control(inner, row);
    }
    if (const int off = beyond(row, rows_); off != 0) {
      const int end = off < 0 ? 0 : rows_ - 1, inner = off < 0 ? 1 : rows_ - 2;
      return (1 + std::abs(off)) * control(column, end) - std::abs(off) * control(column, inner);
    }
    return controls_[static_cast<size_t>(column) * rows_ + row];
  }
  template <class Weight>
  Vec3 sum(const Parameters& at, Weight&& weight) const {
    Vec3 sum = Vec3::Zero();
    const int column = static_cast<int>(std::floor(at[0])),
              row = static_cast<int>(std::floor(at[1]));
    for (int i = column - 1; i <= column + 2; ++i)
      for (int j = row - 1; j <= row + 2; ++j) sum += weight(at[0] - i, at[1] - j) * control(i, j);
    return sum;
  }

  static Parameters at_half(int i, int j) { return {0.5 * i, 0.5 * j}; }

  int columns_, rows_;
  std::vector<Vec3> controls_;                 // column by column
  std::map<std::array<int, 2>, Vec3> halves_;  // points, from begin() to end()
};

/// Parameters at which the distance to `place` is least, from `at` on: steps to the best of 24
/// neighbors, halved where none is nearer. Of several minima, `first` steps that are long may reach
/// another one than those that are short.
Parameters descend(const Side& side, const Vec3& place, Parameters at, double first) {
  constexpr double last = 1e-7;
  double minimum = (side.point(at) - place).squaredNorm();
  for (double step = first; step > last;) {
    Parameters best = at;
    for (const double i : {-1.0, -0.5, 0.0, 0.5, 1.0})
      for (const double j : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
        const Parameters next =
            (at + step * Parameters(i, j)).cwiseMax(side.begin()).cwiseMin(side.end());
        const double squared = (side.point(next) - place).squaredNorm();
        if (squared >= minimum) continue;
        minimum = squared;
        best = next;
      }
    if (best == at) step /= 2;
    at = best;
  }
  return at;
}

struct Foot {
  double distance, gap;
};
Foot foot_from(const Side& side, const Vec3& place, const Parameters& start, double first) {
  constexpr double at_end = 1e-6;
  const Parameters foot = descend(side, place, start, first);
  const Vec3 offset = place - side.point(foot);
  const auto [along, inwards] = side.slopes(foot);
  const Vec3 normal = along.cross(inwards);
  const bool opposite = (foot - side.begin()).minCoeff() > at_end &&
                        (side.end() - foot).minCoeff() > at_end && normal.norm() > 0;
  return {offset.norm(), opposite ? normal.normalized().dot(offset) : offset.norm()};
}

/// The gap from the nearest foot, first, and those from others as near. Feet are found by long and
/// by short steps from all of a side's points at half parameters that are nearer than those around.
std::vector<double> gaps_of(const Side& side, const Vec3& place) {
  constexpr double as_near = 1e-6;  // mm
  std::vector<Foot> feet;
  for (const Parameters& start : side.nearer_than_around(place))
    for (const double first : {1.0 / 4, 1.0 / 32})
      feet.push_back(foot_from(side, place, start, first));
  std::ranges::sort(feet, {}, &Foot::distance);
  std::vector<double> gaps;
  for (const Foot& foot : feet)
    if (foot.distance <= feet.front().distance + as_near) gaps.push_back(foot.gap);
  return gaps;
}

}  // namespace

std::vector<CutGap> cut_gaps(const model::CutFaces& cuts, std::span<const Vec3> position) {
  std::vector<CutGap> gaps;
  size_t first = 0, place = 0;
  for (const auto& [columns, rows] : cuts.size) {
    const size_t count = static_cast<size_t>(columns) * rows;
    const Side own(cuts, first, static_cast<int>(columns), static_cast<int>(rows), position);
    const Side other(cuts, first + count, static_cast<int>(columns), static_cast<int>(rows),
                     position);
    for (size_t c = 0; c < count; ++c, ++place) {
      if (!(cuts.area[place] > 0)) continue;
      const Vec3 at = own.point({c / rows, c % rows});
      gaps.push_back({cuts.point[cuts.begin[first + c]], gaps_of(other, at)});
    }
    first += 2 * count;
  }
  return gaps;
}

}  // namespace repose::tools::check
