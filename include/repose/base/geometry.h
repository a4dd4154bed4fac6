#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

/// Fixed-size vectors that every room uses, and rows of arrays.
namespace repose {

using Vec3 = Eigen::Vector3d;  ///< a point (mm), a force (N) or a direction
using Mat3 = Eigen::Matrix3d;  ///< a 3×3 block of a Hessian, or a rotation
using Mat4 = Eigen::Matrix4d;  ///< a homogeneous transform, mm, acting on columns
using Triangle =
    std::array<int64_t, 3>;  ///< three 0-based vertex numbers, counter-clockwise outside

}  // namespace repose

namespace repose::base {

/// The values at `rows`, in their order.
template <class T>
std::vector<T> pick(const std::vector<T>& values, std::span<const int64_t> rows) {
  std::vector<T> picked;
  picked.reserve(rows.size());
  for (const int64_t row : rows) picked.push_back(values[row]);
  return picked;
}

}  // namespace repose::base
