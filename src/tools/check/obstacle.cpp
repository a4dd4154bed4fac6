#include "obstacle.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace repose::tools::check {

namespace {

Vec3 closest_on_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 along = b - a;
  const double square = along.squaredNorm();
  const double t = square > 0 ? std::clamp((p - a).dot(along) / square, 0.0, 1.0) : 0;
  return a + t * along;
}

/// The foot in the plane where it is inside the triangle, else the closest point of the edges.
Vec3 closest_on_triangle(const Vec3& p, const std::array<Vec3, 3>& t) {
  const Vec3 normal = (t[1] - t[0]).cross(t[2] - t[0]);
  const double square = normal.squaredNorm();
  bool within = square > 0;
  Vec3 closest = t[0];
  for (int k = 0; k < 3; ++k) {
    const Vec3 &a = t[k], &b = t[(k + 1) % 3];
    within = within && (b - a).cross(p - a).dot(normal) >= 0;
    const Vec3 on_edge = closest_on_segment(p, a, b);
    if ((p - on_edge).squaredNorm() < (p - closest).squaredNorm()) closest = on_edge;
  }
  return within ? Vec3(p - (p - t[0]).dot(normal) / square * normal) : closest;
}

/// Twice the area of the triangle (p, a, b) seen along z, the same up to its sign with a and b
/// exchanged, so that neighbors over an edge never both count or both miss a ray.
double area_along_z(const Vec3& p, const Vec3& a, const Vec3& b) {
  const bool ordered = std::make_pair(a.x(), a.y()) < std::make_pair(b.x(), b.y());
  const Vec3 &first = ordered ? a : b, &second = ordered ? b : a;
  const double area =
      (first.x() - p.x()) * (second.y() - p.y()) - (second.x() - p.x()) * (first.y() - p.y());
  const double positive = area == 0 ? std::numeric_limits<double>::min() : area;
  return ordered ? positive : -positive;
}

/// ±1 where the ray from p along z crosses the triangle, upwards positive.
int crossing(const Vec3& p, const std::array<Vec3, 3>& t) {
  std::array<double, 3> area;
  for (int k = 0; k < 3; ++k) area[k] = area_along_z(p, t[(k + 1) % 3], t[(k + 2) % 3]);
  const bool left = area[0] > 0;
  if ((area[1] > 0) != left || (area[2] > 0) != left) return 0;
  const double height = (area[0] * t[0].z() + area[1] * t[1].z() + area[2] * t[2].z()) /
                        (area[0] + area[1] + area[2]);
  if (height <= p.z()) return 0;
  return left ? 1 : -1;
}

/// A turn by which no facet of a CT's grid or of a saw lies along an axis.
Mat3 oblique() {
  static const Mat3 turn = Eigen::AngleAxisd(0.73, Vec3(0.36, 0.48, 0.8)).toRotationMatrix();
  return turn;
}

/// Returns the number of cells along the longest side of the box: about as large as triangles.
double cells_along(size_t triangles) {
  return std::clamp(0.4 * std::sqrt(static_cast<double>(triangles)), 2.0, 96.0);
}

}  // namespace

TriangleGrid::TriangleGrid(const surface::Surface& surface) {
  Vec3 facing = Vec3::Zero();
  double area = 0;
  low_.setConstant(std::numeric_limits<double>::infinity());
  high_ = -low_;
  low_corner_ = low_;
  for (const Triangle& t : surface.triangles) {
    Corners corners;
    for (int k = 0; k < 3; ++k) {
      corners[k] = oblique() * surface.points[t[k]];
      low_corner_ = low_corner_.cwiseMin(surface.points[t[k]]);
      low_ = low_.cwiseMin(corners[k]);
      high_ = high_.cwiseMax(corners[k]);
    }
    const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    facing += normal;
    area += normal.norm();
    triangles_.push_back(corners);
    const Vec3 center = (corners[0] + corners[1] + corners[2]) / 3;
    double radius = 0;
    for (const Vec3& corner : corners) radius = std::max(radius, (corner - center).norm());
    balls_.push_back({center, radius});
  }
  closed_ = facing.norm() <= 1e-6 * area;
  edge_ = std::max((high_ - low_).maxCoeff() / cells_along(triangles_.size()),
                   std::numeric_limits<double>::min());
  const Cell last = cell_of(high_);
  size_ = {last[0] + 1, last[1] + 1, last[2] + 1};
  cells_.resize(size_[0] * size_[1] * size_[2]);
  columns_.resize(size_[0] * size_[1]);
  for (size_t t = 0; t < triangles_.size(); ++t) {
    const auto& [a, b, c] = triangles_[t];
    const Cell from = cell_of(a.cwiseMin(b).cwiseMin(c)), to = cell_of(a.cwiseMax(b).cwiseMax(c));
    for (int64_t i = from[0]; i <= to[0]; ++i)
      for (int64_t j = from[1]; j <= to[1]; ++j) {
        columns_[i * size_[1] + j].push_back(static_cast<int32_t>(t));
        for (int64_t k = from[2]; k <= to[2]; ++k)
          cells_[(i * size_[1] + j) * size_[2] + k].push_back(static_cast<int32_t>(t));
      }
  }
}

TriangleGrid::Cell TriangleGrid::cell_of(const Vec3& point) const {
  Cell cell;
  for (int a = 0; a < 3; ++a)
    cell[a] = static_cast<int64_t>((std::clamp(point[a], low_[a], high_[a]) - low_[a]) / edge_);
  return cell;
}

template <class Visit>
void TriangleGrid::visit_near(const Vec3& point, double radius, Visit&& visit) const {
  const Vec3 beyond = (low_ - point).cwiseMax(point - high_).cwiseMax(0.0);
  if (beyond.norm() > radius) return;
  const Cell from = cell_of(point - Vec3::Constant(radius)),
             to = cell_of(point + Vec3::Constant(radius));
  for (int64_t i = from[0]; i <= to[0]; ++i)
    for (int64_t j = from[1]; j <= to[1]; ++j)
      for (int64_t k = from[2]; k <= to[2]; ++k)
        for (const int32_t t : cells_[(i * size_[1] + j) * size_[2] + k]) visit(t);
}

double TriangleGrid::distance(const Vec3& point, double reach) const {
  const Vec3 p = oblique() * point;
  const auto to = [&](int32_t t) { return (p - closest_on_triangle(p, triangles_[t])).norm(); };
  double nearest = triangles_.empty() ? reach : std::min(reach, to(latest_));
  visit_near(p, nearest, [&](int32_t t) {
    const double enough = nearest + balls_[t].radius;
    if ((p - balls_[t].center).squaredNorm() >= enough * enough) return;
    if (const double distance = to(t); distance < nearest) {
      nearest = distance;
      latest_ = t;
    }
  });
  return nearest;
}

std::optional<Vec3> TriangleGrid::closest_point(const Vec3& point, double reach) const {
  const Vec3 p = oblique() * point;
  std::optional<Vec3> closest;
  double nearest = reach;
  visit_near(p, reach, [&](int32_t t) {
    const Vec3 at = closest_on_triangle(p, triangles_[t]);
    if ((p - at).norm() > nearest) return;
    nearest = (p - at).norm();
    closest = at;
  });
  if (closest) *closest = oblique().transpose() * *closest;
  return closest;
}

int64_t TriangleGrid::crossings(const Vec3& p) const {
  if ((p - low_).minCoeff() < 0 || (high_ - p).minCoeff() < 0) return 0;
  const Cell cell = cell_of(p);
  int64_t sum = 0;
  for (const int32_t t : columns_[cell[0] * size_[1] + cell[1]]) sum += crossing(p, triangles_[t]);
  return sum;
}

bool TriangleGrid::contains(const Vec3& point) const {
  if (closed_) return crossings(oblique() * point) != 0;
  return std::abs(winding_number(point)) > 0.5;
}

double TriangleGrid::winding_number(const Vec3& point) const {
  const Vec3 p = oblique() * point;
  double angle = 0;
  for (const Corners& t : triangles_) {
    const Vec3 a = t[0] - p, b = t[1] - p, c = t[2] - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    angle += 2 * std::atan2(a.dot(b.cross(c)),
                            la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return angle / (4 * std::numbers::pi);
}

namespace {

double signed_distance(const scene::Sphere& ball, const Vec3& p, double) {
  return (p - ball.center).norm() - ball.radius;
}

double signed_distance(const scene::Capsule& capsule, const Vec3& p, double) {
  return (p - closest_on_segment(p, capsule.from, capsule.to)).norm() - capsule.radius;
}

double signed_distance(const scene::Box& box, const Vec3& p, double) {
  const Vec3 beyond = (p - box.center).cwiseAbs() - box.size / 2;
  return std::min(beyond.maxCoeff(), 0.0) + beyond.cwiseMax(0.0).norm();
}

double signed_distance(const scene::HalfSpace& half, const Vec3& p, double) {
  return (p - half.point).dot(half.normal) / half.normal.norm();
}

double signed_distance(const TriangleGrid& mesh, const Vec3& p, double reach) {
  const double apart = mesh.distance(p, reach);
  return mesh.contains(p) ? -apart : apart;
}

Vec3 outward(const scene::Sphere& ball, const Vec3& p) { return p - ball.center; }

Vec3 outward(const scene::Capsule& capsule, const Vec3& p) {
  return p - closest_on_segment(p, capsule.from, capsule.to);
}

Vec3 outward(const scene::Box& box, const Vec3& p) {
  const Vec3 from = p - box.center;
  Vec3 beyond = from.cwiseAbs() - box.size / 2;
  beyond = beyond.maxCoeff() > 0 ? Vec3(beyond.cwiseMax(0.0))
                                 : Vec3((beyond.array() == beyond.maxCoeff()).cast<double>());
  return (from.array() < 0).select(-beyond, beyond);
}

Vec3 outward(const scene::HalfSpace& half, const Vec3&) { return half.normal; }

Vec3 outward(const TriangleGrid&, const Vec3&) { return Vec3::Zero(); }

}  // namespace

Obstacle::Obstacle(const model::Model& model, const model::Body& body) {
  if (body.bone >= 0) {
    shape_.emplace<TriangleGrid>(model.bone_surfaces[body.bone]);
    return;
  }
  std::visit(
      [&](const auto& shape) {
        if constexpr (std::is_same_v<std::decay_t<decltype(shape)>, surface::Surface>)
          shape_.emplace<TriangleGrid>(shape);
        else
          shape_ = shape;
      },
      body.shape);
}

double Obstacle::distance(const Vec3& point, double reach) const {
  return std::visit([&](const auto& shape) { return signed_distance(shape, point, reach); },
                    shape_);
}

Vec3 Obstacle::normal(const Vec3& point) const {
  return std::visit([&](const auto& shape) { return outward(shape, point).normalized(); }, shape_);
}

}  // namespace repose::tools::check
