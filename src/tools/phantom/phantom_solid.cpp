#include "phantom_solid.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace repose::tools::phantom {
namespace {

double ellipsoid_distance(const Part& part, const Vec3& point) {
  const Vec3 offset = point - part.beads.front().center;
  const double k0 = offset.cwiseQuotient(part.semi_axes).norm();
  const double k1 = offset.cwiseQuotient(part.semi_axes.cwiseAbs2()).norm();
  return k1 == 0 ? -part.semi_axes.minCoeff() : k0 * (k0 - 1) / k1;
}

double segment_parameter(const Vec3& a, const Vec3& b, const Vec3& point) {
  return std::clamp((point - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
}

double cone_distance(const Bead& a, const Bead& b, const Vec3& point) {
  const double t = segment_parameter(a.center, b.center, point);
  return (point - a.center - t * (b.center - a.center)).norm() - std::lerp(a.radius, b.radius, t);
}

double triangle_distance(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& point) {
  const Vec3 normal = (b - a).cross(c - a).normalized();
  const bool above = normal.cross(b - a).dot(point - a) >= 0 &&
                     normal.cross(c - b).dot(point - b) >= 0 &&
                     normal.cross(a - c).dot(point - c) >= 0;
  if (above) return std::abs(normal.dot(point - a));
  const auto to_segment = [&](const Vec3& p, const Vec3& q) {
    return (point - p - segment_parameter(p, q, point) * (q - p)).norm();
  };
  return std::min({to_segment(a, b), to_segment(b, c), to_segment(c, a)});
}

double chain_distance(const std::vector<Bead>& beads, const Vec3& point) {
  double nearest = cone_distance(beads[0], beads[1], point);
  for (size_t i = 1; i + 1 < beads.size(); ++i)
    nearest = std::min(nearest, cone_distance(beads[i], beads[i + 1], point));
  return nearest;
}

double sheet_distance(const std::vector<Bead>& beads, const Vec3& point) {
  double nearest = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i + 2 < beads.size(); ++i)
    nearest = std::min(nearest, triangle_distance(beads[i].center, beads[i + 1].center,
                                                  beads[i + 2].center, point));
  return nearest - beads[0].radius;
}

/// Returns whether the distance to a part is certainly more than `reach`.
bool beyond(const Part& part, const Vec3& point, double reach) {
  const double radius = part.extent + (reach > 0 ? part.stretch * reach : reach);
  return radius < 0 || (point - part.middle).squaredNorm() > radius * radius;
}

double distance(const Part& part, const Vec3& point) {
  switch (part.kind) {
    case Part::Kind::ellipsoid:
      return ellipsoid_distance(part, point);
    case Part::Kind::chain:
      return chain_distance(part.beads, point);
    default:
      return sheet_distance(part.beads, point);
  }
}

Part beaded(Part::Kind kind, std::vector<Bead> beads, double blend) {
  Vec3 middle = Vec3::Zero();
  for (const Bead& bead : beads) middle += bead.center / double(beads.size());
  double extent = 0;
  for (const Bead& bead : beads)
    extent =
        std::max(extent, (bead.center - middle).norm() + std::max(bead.radius, beads[0].radius));
  return {kind, std::move(beads), Vec3::Zero(), blend, middle, extent, 1};
}

}  // namespace

Part ellipsoid(const Vec3& center, const Vec3& semi_axes, double blend) {
  const double longest = semi_axes.maxCoeff();
  return {Part::Kind::ellipsoid,         {{center, 0}}, semi_axes, blend, center, longest,
          longest / semi_axes.minCoeff()};
}

Part chain(std::vector<Bead> beads, double blend) {
  return beaded(Part::Kind::chain, std::move(beads), blend);
}

Part sheet(std::vector<Bead> beads, double blend) {
  return beaded(Part::Kind::sheet, std::move(beads), blend);
}

Part cut(Part part) {
  part.cut = true;
  return part;
}

double soft_min(double a, double b, double blend) {
  const double h = std::max(blend - std::abs(a - b), 0.0);
  return std::min(a, b) - (blend > 0 ? h * h / (4 * blend) : 0);
}

double soft_max(double a, double b, double blend) { return -soft_min(-a, -b, blend); }

double signed_distance(const std::vector<Part>& parts, const Vec3& point) {
  const Vec3 mirrored(std::abs(point.x()), point.y(), point.z());
  double result = std::numeric_limits<double>::max();
  for (const Part& part : parts) {
    // Whatever is this far away or further changes nothing.
    const double reach = part.blend + (part.cut ? -result : result);
    if (beyond(part, mirrored, reach)) continue;
    const double d = distance(part, mirrored);
    result = part.cut ? soft_max(result, -d, part.blend) : soft_min(result, d, part.blend);
  }
  return result;
}

}  // namespace repose::tools::phantom
