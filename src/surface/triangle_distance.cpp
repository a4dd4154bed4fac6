#include "triangle_distance.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

namespace repose::surface {
namespace {

void offer(const Vec3& p, const Vec3& q, ShortestSegment& best) {
  const double squared = (p - q).squaredNorm();
  if (squared < best.squared) best = {squared, (p + q) / 2};
}

double clamped(double value) { return std::clamp(value, 0.0, 1.0); }

/// Nearest points of the segments p + s d, q + t e.
void sides(const Vec3& p, const Vec3& d, const Vec3& q, const Vec3& e, ShortestSegment& best) {
  const Vec3 r = p - q;
  const double dd = d.squaredNorm(), ee = e.squaredNorm(), de = d.dot(e), dr = d.dot(r),
               er = e.dot(r), determinant = dd * ee - de * de;
  double s = determinant > 0 ? clamped((de * er - dr * ee) / determinant) : 0;
  double t = ee > 0 ? (de * s + er) / ee : 0;
  if (t < 0 || t > 1) {
    t = clamped(t);
    s = dd > 0 ? clamped((de * t - dr) / dd) : 0;
  }
  offer(p + s * d, q + t * e, best);
}

/// Returns whether the foot of `p` on the plane of `t` lies in it, for the unscaled normal n.
bool above(const Vec3& p, const Corners& t, const Vec3& n) {
  for (int k = 0; k < 3; ++k)
    if (n.cross(t[(k + 1) % 3] - t[k]).dot(p - t[k]) < 0) return false;
  return true;
}

/// Corners of `a` over triangle `b`, and sides of `a` that cross it.
void corners_and_crossings(const Corners& a, const Corners& b, ShortestSegment& best) {
  const Vec3 n = (b[1] - b[0]).cross(b[2] - b[0]);
  const double nn = n.squaredNorm();
  if (!(nn > 0)) return;
  std::array<double, 3> height;
  for (int k = 0; k < 3; ++k) {
    height[k] = n.dot(a[k] - b[0]);
    if (height[k] * height[k] < best.squared * nn && above(a[k], b, n))
      offer(a[k], a[k] - height[k] / nn * n, best);
  }
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    if (!(height[k] * height[next] < 0)) continue;
    const Vec3 at = a[k] + height[k] / (height[k] - height[next]) * (a[next] - a[k]);
    if (above(at, b, n)) best = {0, at};
  }
}

}  // namespace

ShortestSegment shortest_segment(const Corners& a, const Corners& b) {
  ShortestSegment best{std::numeric_limits<double>::infinity(), a[0]};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      sides(a[i], a[(i + 1) % 3] - a[i], b[j], b[(j + 1) % 3] - b[j], best);
  corners_and_crossings(a, b, best);
  corners_and_crossings(b, a, best);
  return best;
}

}  // namespace repose::surface
