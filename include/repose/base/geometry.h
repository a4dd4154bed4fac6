#pragma once
#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <span>
#include <type_traits>
#include <vector>

/// Fixed-size vectors that every room uses, rows of arrays, and the fit of one point set to
/// another.
namespace repose {

using Vec3 = Eigen::Vector3d;  ///< a point (mm), a force (N) or a direction
using Mat3 = Eigen::Matrix3d;  ///< a 3×3 block of a Hessian, or a rotation
using Mat4 = Eigen::Matrix4d;  ///< a homogeneous transform, mm, acting on columns
using Triangle =
    std::array<int64_t, 3>;  ///< three 0-based vertex numbers, counter-clockwise outside

}  // namespace repose

/// Formats a vector as (x, y, z), each number by the given format.
template <>
struct fmt::formatter<repose::Vec3> : fmt::formatter<double> {
  template <class Context>
  auto format(const repose::Vec3& vector, Context& context) const {
    for (int axis = 0; axis < 3; ++axis) {
      context.advance_to(fmt::format_to(context.out(), "{}", axis == 0 ? "(" : ", "));
      context.advance_to(fmt::formatter<double>::format(vector[axis], context));
    }
    return fmt::format_to(context.out(), ")");
  }
};

namespace repose::base {

/// Numbers in a value: those of a vector or a tuple, else 1.
template <class Value>
constexpr size_t components = 1;
template <>
inline constexpr size_t components<Vec3> = 3;
template <class T, size_t n>
constexpr size_t components<std::array<T, n>> = n;

/// Sorts values and keeps one of each.
template <class T>
void sort_unique(std::vector<T>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

/// Two numbers in order, as one key.
inline std::array<int64_t, 2> sorted_pair(int64_t p, int64_t q) {
  return {std::min(p, q), std::max(p, q)};
}

/// 0, 1, … up to `count`.
inline std::vector<int64_t> all_rows(size_t count) {
  std::vector<int64_t> rows(count);
  std::iota(rows.begin(), rows.end(), 0);
  return rows;
}

/// The middle one of at least one value in order, of an even number the upper.
inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The values at `rows`, in their order.
template <class T>
std::vector<T> pick(const std::vector<T>& values, std::span<const int64_t> rows) {
  std::vector<T> picked;
  picked.reserve(rows.size());
  for (const int64_t row : rows) picked.push_back(values[row]);
  return picked;
}

/// The values at a fixed number of rows, as of a triangle or a prism.
template <class Values, class Row, size_t n>
auto pick(const Values& values, const std::array<Row, n>& rows) {
  std::array<std::remove_cvref_t<decltype(values[0])>, n> picked;
  for (size_t k = 0; k < n; ++k) picked[k] = values[rows[k]];
  return picked;
}

/// y = s R x + t.
struct Similarity {
  double scale = 1;
  Mat3 rotation = Mat3::Identity();
  Vec3 translation = Vec3::Zero();  ///< mm

  Vec3 apply(const Vec3& point) const { return scale * (rotation * point) + translation; }
  Mat4 matrix() const;
  /// The transform that does `first`, then this one.
  Similarity after(const Similarity& first) const;
};

/// Returns the mean of at least one point.
Vec3 mean(std::span<const Vec3> points);

enum class Handedness { kept, mirrored };

/// The least-squares transform taking `moving` to `fixed`, pairs in order (Umeyama, Least-squares
/// estimation of transformation parameters between two point patterns, 1991): the best rotation,
/// or the best reflection. The scale stays 1 unless requested. At least three pairs that fix a
/// rotation (breadth).
Similarity fit_similarity(const std::vector<Vec3>& moving, const std::vector<Vec3>& fixed,
                          bool with_scale, Handedness handedness = Handedness::kept);

/// The width of a point set over its length: the second over the first singular value of the
/// positions about their mean, to 1e-8. 0 on a line, for fewer than three points, and where a
/// position is not finite.
double breadth(std::span<const Vec3> points);

}  // namespace repose::base
