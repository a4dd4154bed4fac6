#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "repose/base/error.h"
#include "repose/surface/component.h"
#include "repose/surface/edges.h"
#include "repose/surface/triangle_tree.h"
#include "repose/tools/registration/register.h"

namespace repose::tools::registration {
using namespace surface;
namespace {

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

constexpr double min_cosine = 0.5;  ///< between the normals of a pair
constexpr double on_border = 1e-6;  ///< barycentric share
constexpr int max_halvings = 6;

struct Pair {
  Vec3 from, to, normal;  ///< moved sample, its closest point, the fixed surface's normal there
  double squared;         ///< mm²
};

struct Error {
  double plane = 0, point = 0;  ///< rms, mm
};

Error error_of(const std::vector<Pair>& pairs) {
  Error sum;
  for (const Pair& pair : pairs) {
    const double height = pair.normal.dot(pair.to - pair.from);
    sum.plane += height * height;
    sum.point += pair.squared;
  }
  const auto n = static_cast<double>(pairs.size());
  return {std::sqrt(sum.plane / n), std::sqrt(sum.point / n)};
}

Similarity shortened(const Similarity& step, double share) {
  const Eigen::AngleAxisd turn(step.rotation);
  return {1, Eigen::AngleAxisd(share * turn.angle(), turn.axis()).toRotationMatrix(),
          share * step.translation};
}

class Icp {
 public:
  Icp(const Surface& moving, const Surface& fixed, const IcpOptions& options)
      : moving_name_(moving.name),
        fixed_(fixed),
        options_(options),
        tree_(fixed),
        border_edge_(fixed.triangles.size()),
        border_vertex_(fixed.points.size()) {
    for (const HalfEdge& half : EdgeTable(fixed.triangles).border()) {
      border_edge_[half.triangle][half.corner] = true;
      border_vertex_[half.low] = border_vertex_[half.high] = true;
    }
    const std::vector<Vec3> normals = vertex_normals(moving);
    const auto count = std::ssize(moving.points);
    const int64_t used = std::min(count, options.samples);
    for (int64_t i = 0; i < used; ++i) {
      const int64_t vertex = i * count / used;
      points_.push_back(moving.points[vertex]);
      normals_.push_back(normals[vertex]);
    }
  }

  IcpResult run(const Similarity& start) {
    IcpResult result{.transform = start};
    std::vector<Pair> pairs = match(start);
    while (result.steps < options_.max_steps && !result.converged) {
      ++result.steps;
      const Similarity best = solve(pairs);
      double share = 1;
      for (int halving = 0;; ++halving, share /= 2) {
        const Similarity next = shortened(best, share).after(result.transform);
        std::vector<Pair> next_pairs = match(next);
        const bool better = error_of(next_pairs).plane <= error_of(pairs).plane;
        result.converged = largest_move(result.transform, next) <= options_.tolerance * extent();
        if (!better && !result.converged && halving < max_halvings) continue;
        if (better) {
          result.transform = next;
          pairs = std::move(next_pairs);
        }
        result.converged = result.converged || !better;
        break;
      }
    }
    return measured(result, pairs);
  }

 private:
  double extent() const { return bounding_diagonal(fixed_.points); }

  /// Returns whether a point of a triangle lies on the surface's border: on an edge that no other
  /// triangle shares, or in an end of one.
  bool at_border(int64_t triangle, const Vec3& point) const {
    const Triangle& vertices = fixed_.triangles[triangle];
    const Corners t = corners(fixed_, vertices);
    const Vec3 normal = scaled_normal(t);
    for (int k = 0; k < 3; ++k) {
      const Vec3 &a = t[(k + 1) % 3], &b = t[(k + 2) % 3];
      const double share = (a - point).cross(b - point).dot(normal) / normal.squaredNorm();
      if (std::abs(share) < on_border && border_edge_[triangle][(k + 1) % 3]) return true;
      if (std::abs(1 - share) < on_border && border_vertex_[vertices[k]]) return true;
    }
    return false;
  }

  /// Throws InputError where nearly all pairs are of triangles that face opposite ways.
  void require_same_side(size_t opposed, size_t agreeing) const {
    constexpr size_t many = 10;
    if (opposed <= many * agreeing) return;
    base::refuse(
        "ICP: triangles of {} face the other way than those of {} at {} of {} samples; turn those "
        "of the one that faces inward in a mesh editor, or check the landmarks",
        moving_name_, fixed_.name, opposed, points_.size());
  }

  /// The nearest share of the pairs that may count.
  std::vector<Pair> match(const Similarity& transform) const {
    std::vector<Pair> pairs;
    size_t opposed = 0;
    for (size_t i = 0; i < points_.size(); ++i) {
      const Vec3 from = transform.apply(points_[i]);
      const auto nearest = tree_.nearest(from);
      if (at_border(nearest.triangle, nearest.point)) continue;
      const Vec3 normal = scaled_normal(tree_.corners_of(nearest.triangle)).normalized();
      const double cosine = (transform.rotation * normals_[i]).dot(normal);
      opposed += cosine < -min_cosine;
      if (cosine > min_cosine) pairs.push_back({from, nearest.point, normal, nearest.squared});
    }
    require_same_side(opposed, pairs.size());
    const auto kept = static_cast<int64_t>(options_.trim * static_cast<double>(pairs.size()));
    if (kept < 6)
      base::refuse(
          "ICP: {} of {} samples of {} have a partner on {}, six are needed; the start is too far "
          "off: give landmarks of both, or check them",
          kept, points_.size(), moving_name_, fixed_.name);
    std::ranges::nth_element(pairs, pairs.begin() + kept - 1, {}, &Pair::squared);
    pairs.resize(kept);
    return pairs;
  }

  /// Least squares of n·(p + ω×(p − c) + u − q) over ω, u, about the pairs' mean c.
  static Similarity solve(const std::vector<Pair>& pairs) {
    Vec3 center = Vec3::Zero();
    for (const Pair& pair : pairs) center += pair.from / static_cast<double>(pairs.size());
    Mat6 matrix = Mat6::Zero();
    Vec6 right = Vec6::Zero();
    for (const Pair& pair : pairs) {
      Vec6 row;
      row << (pair.from - center).cross(pair.normal), pair.normal;
      matrix += row * row.transpose();
      right += row * pair.normal.dot(pair.to - pair.from);
    }
    const double angular = matrix.topLeftCorner<3, 3>().trace(),
                 shift = matrix.bottomRightCorner<3, 3>().trace();
    matrix.topLeftCorner<3, 3>().diagonal().array() +=
        1e-9 * angular;  // a sphere or a plane slides
    matrix.bottomRightCorner<3, 3>().diagonal().array() += 1e-9 * shift;
    const Vec6 x = matrix.ldlt().solve(right);
    const double angle = x.head<3>().norm();
    const Mat3 rotation = angle > 0
                              ? Eigen::AngleAxisd(angle, x.head<3>() / angle).toRotationMatrix()
                              : Mat3::Identity();
    return {1, rotation, center + x.tail<3>() - rotation * center};
  }

  double largest_move(const Similarity& a, const Similarity& b) const {
    double largest = 0;
    for (const Vec3& point : points_)
      largest = std::max(largest, (a.apply(point) - b.apply(point)).norm());
    return largest;
  }

  IcpResult measured(IcpResult result, const std::vector<Pair>& pairs) const {
    const Error error = error_of(pairs);
    result.rms_plane = error.plane;
    result.rms = error.point;
    result.pairs = std::ssize(pairs);
    std::vector<double> distances;
    for (const Vec3& point : points_)
      distances.push_back(tree_.nearest(result.transform.apply(point)).squared);
    result.median = std::sqrt(base::median(std::move(distances)));
    return result;
  }

  std::string moving_name_;
  const Surface& fixed_;
  IcpOptions options_;
  TriangleTree tree_;
  std::vector<std::array<bool, 3>> border_edge_;  ///< of each triangle, by their first corner
  std::vector<bool> border_vertex_;
  std::vector<Vec3> points_, normals_;
};

}  // namespace

IcpResult refine_by_icp(const Surface& moving, const Surface& fixed, const Similarity& start,
                        const IcpOptions& options) {
  return Icp(moving, fixed, options).run(start);
}

}  // namespace repose::tools::registration
