#include "front_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "mean_near_largest.h"
#include "repose/surface/edges.h"

namespace repose::anatomy {
namespace {

constexpr double nothing = std::numeric_limits<double>::infinity();

/// Triangles from the middles of rims to their edges, over holes that are at most as wide as the
/// limit below. A mouth is wider.
std::vector<std::array<Vec3, 3>> closings_of_holes(const std::vector<Vec3>& points,
                                                   const std::vector<Triangle>& triangles) {
  constexpr double widest = 12;  // mm, diagonal of the box around a rim
  const std::vector<surface::HalfEdge> rim_edges = surface::EdgeTable(triangles).border();
  surface::UnionFind rims(std::ssize(points));
  for (const auto& edge : rim_edges) rims.unite(edge.low, edge.high);
  std::map<int64_t, Eigen::AlignedBox3d> boxes;
  for (const auto& edge : rim_edges)
    for (const int64_t end : {edge.low, edge.high}) boxes[rims.find(end)].extend(points[end]);
  std::vector<std::array<Vec3, 3>> closings;
  for (const auto& edge : rim_edges)
    if (const auto& box = boxes[rims.find(edge.low)]; box.diagonal().norm() <= widest)
      closings.push_back({points[edge.low], points[edge.high], box.center()});
  return closings;
}

}  // namespace

FrontMap::FrontMap(const surface::Surface& surface, const HeadFrame& frame) {
  std::vector<Vec3> points;
  points.reserve(surface.points.size());
  for (const Vec3& p : surface.points) points.push_back(frame.to_frame(p));
  const Eigen::AlignedBox3d box = surface::bounding_box(points);
  // Columns lie in the midline and as far beside it on both sides, so that mirrored heads agree.
  low_ = {spacing_ * (std::floor(box.min().x() / spacing_) - 0.5), box.min().z() - spacing_};
  columns_ = static_cast<int64_t>((box.max().x() - low_.x()) / spacing_) + 2;
  rows_ = static_cast<int64_t>(box.sizes().z() / spacing_) + 3;
  depth_.assign(columns_ * rows_, nothing);
  for (const Triangle& t : surface.triangles) draw(base::pick(points, t));
  for (const std::array<Vec3, 3>& closing : closings_of_holes(points, surface.triangles))
    draw(closing);
}

void FrontMap::draw(const std::array<Vec3, 3>& corner) {
  const auto flat = [&](int k) {
    return Eigen::Vector2d((corner[k].x() - low_.x()) / spacing_ - 0.5,
                           (corner[k].z() - low_.y()) / spacing_ - 0.5);
  };
  const Eigen::Vector2d a = flat(0), b = flat(1), c = flat(2), u = b - a, v = c - a;
  const Eigen::Vector2d low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
  const double area = u.x() * v.y() - u.y() * v.x();
  if (std::abs(area) < 1e-12) return;
  for (auto row = static_cast<int64_t>(std::ceil(low.y())); static_cast<double>(row) <= high.y();
       ++row)
    for (auto column = static_cast<int64_t>(std::ceil(low.x()));
         static_cast<double>(column) <= high.x(); ++column) {
      const Eigen::Vector2d w =
          Eigen::Vector2d(static_cast<double>(column), static_cast<double>(row)) - a;
      const double s = (w.x() * v.y() - w.y() * v.x()) / area,
                   t = (u.x() * w.y() - u.y() * w.x()) / area;
      if (s < -1e-9 || t < -1e-9 || s + t > 1 + 1e-9) continue;
      const double y =
          corner[0].y() + s * (corner[1].y() - corner[0].y()) + t * (corner[2].y() - corner[0].y());
      cell(column, row) = std::min(cell(column, row), y);
    }
}

std::optional<double> FrontMap::depth(double x, double z) const {
  const auto column = static_cast<int64_t>(std::floor((x - low_.x()) / spacing_));
  const auto row = static_cast<int64_t>(std::floor((z - low_.y()) / spacing_));
  if (column < 0 || column >= columns_ || row < 0 || row >= rows_) return std::nullopt;
  const double y = depth_[row * columns_ + column];
  return y < nothing ? std::optional(y) : std::nullopt;
}

std::optional<double> FrontMap::foremost(double x, double z, double half_width) const {
  std::optional<double> best;
  for (const double at : steps(x - half_width, x + half_width))
    if (const auto y = depth(at, z); y && (!best || *y < *best)) best = y;
  return best;
}

std::vector<double> FrontMap::steps(double from, double to, int sign) const {
  constexpr double rounding = 1e-6;  // of a cell
  const double step = sign * spacing_, cells = (to - from) / step;
  std::vector<double> found;
  for (int i = 0; i <= cells + rounding; ++i) found.push_back(from + i * step);
  return found;
}

std::vector<ProfilePoint> FrontMap::profile(double from_z, double to_z, double half_width,
                                            double aside) const {
  constexpr double rounding = 1e-6;  // of a cell, so that heights of the profile are ends of others
  const auto row = [&](double z) { return (z - low_z()) / spacing_ - 0.5; };
  const auto first = static_cast<int64_t>(std::ceil(std::max(row(from_z), 0.0) - rounding));
  const double last = std::min(row(to_z) + rounding, static_cast<double>(rows_ - 1));
  std::vector<ProfilePoint> points;
  for (int64_t i = first; static_cast<double>(i) <= last; ++i) {
    const double z = low_z() + (static_cast<double>(i) + 0.5) * spacing_;
    if (const auto y = foremost(aside, z, half_width)) points.emplace_back(*y, z);
  }
  return points;
}

std::vector<ProfilePoint> between(const std::vector<ProfilePoint>& profile, double from_z,
                                  double to_z) {
  std::vector<ProfilePoint> inside;
  for (const ProfilePoint& p : profile)
    if (p.y() >= from_z && p.y() <= to_z) inside.push_back(p);
  return inside;
}

ProfilePoint at_height(const std::vector<ProfilePoint>& profile, double z) {
  const auto height_of = [](const ProfilePoint& p) { return p.y(); };
  const double height = std::clamp(z, profile.front().y(), profile.back().y());
  const auto above = std::ranges::lower_bound(profile, height, {}, height_of);
  if (above == profile.begin()) return *above;
  const ProfilePoint low = *std::prev(above), rise = *above - low;
  return low + (height - low.y()) / rise.y() * rise;
}

std::optional<ProfilePoint> farthest_from_chord(const std::vector<ProfilePoint>& profile,
                                                const ProfilePoint& a, const ProfilePoint& b,
                                                int sign, double flat) {
  if (profile.empty()) return std::nullopt;
  const ProfilePoint along = (b.y() >= a.y() ? b - a : a - b).normalized();
  const ProfilePoint ahead(-along.y(), along.x());  // to the left of upwards: in front
  const auto distance = [&](const ProfilePoint& p) { return sign * ahead.dot(p - a); };
  const auto height_of = [](const ProfilePoint& p) { return p.y(); };
  return at_height(profile, mean_near_largest(profile, flat, distance, height_of));
}

std::optional<ProfilePoint> foremost_of(const std::vector<ProfilePoint>& profile) {
  return farthest_from_chord(profile, {0, 0}, {0, 1}, 1);
}

std::optional<ProfilePoint> chin_of(const std::vector<ProfilePoint>& profile, double from_z,
                                    double to_z) {
  constexpr double end = 3, flat = 1;  // mm
  const std::vector<ProfilePoint> inside = between(profile, from_z, to_z);
  const auto foremost = farthest_from_chord(inside, {0, 0}, {0, 1}, 1, flat);
  if (inside.size() < 2) return foremost;
  const ProfilePoint rise = inside.back() - inside.front();
  const double share = std::max(1 - (inside.back().y() - foremost->y()) / end, 0.0);
  return farthest_from_chord(inside, {0, 0}, {share * rise.x() / rise.y(), 1}, 1, flat);
}

std::optional<ProfilePoint> b_point_of(const std::vector<ProfilePoint>& profile,
                                       const ProfilePoint& pogonion, const ProfilePoint& edge,
                                       double usual) {
  constexpr double concave = 1;  // mm
  const auto deepest = farthest_from_chord(profile, pogonion, edge, -1);
  if (!deepest) return deepest;
  const ProfilePoint up = (edge - pogonion).normalized(), way = *deepest - pogonion;
  const double share = std::clamp((way.x() * up.y() - way.y() * up.x()) / concave, 0.0, 1.0);
  return at_height(profile, usual + share * (deepest->y() - usual));
}

}  // namespace repose::anatomy
