#include "cube_cases.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "repose/base/error.h"
#include "repose/base/geometry.h"

namespace repose::imaging {
namespace {

using Loop = std::vector<int>;  // edges of the cube, in order

int edge_between(int a, int b) {
  for (int e = 0; e < cube_edges; ++e) {
    const auto ends = edge_corners(e);
    if ((ends[0] == a && ends[1] == b) || (ends[0] == b && ends[1] == a)) return e;
  }
  throw base::InternalError("no edge of the cube joins these corners");
}

/// The four corners of a face, counter-clockwise seen from outside the cube.
std::array<int, 4> face_corners(int face) {
  const int axis = face / 2, side = face % 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
  const int base = side << axis;
  std::array<int, 4> corners{base, base | 1 << u, base | 1 << u | 1 << v, base | 1 << v};
  if (side == 0) std::reverse(corners.begin(), corners.end());
  return corners;
}

bool share_face(int edge, int other) {
  const auto a = edge_corners(edge), b = edge_corners(other);
  const int zeros = ~(a[0] | a[1] | b[0] | b[1]) & 7, ones = a[0] & a[1] & b[0] & b[1];
  return (zeros | ones) != 0;
}

/// For each crossed edge the next one along its loop: on each face from where a run of inside
/// corners begins to where it ends.
std::array<int, cube_edges> successors(int inside) {
  std::array<int, cube_edges> next;
  next.fill(-1);
  for (int face = 0; face < 6; ++face) {
    const auto corners = face_corners(face);
    const auto is_inside = [&](int i) { return (inside >> corners[i & 3] & 1) != 0; };
    for (int begin = 0; begin < 4; ++begin) {
      if (is_inside(begin + 3) || !is_inside(begin)) continue;
      int end = begin;
      while (is_inside(end + 1)) ++end;
      next[edge_between(corners[(begin + 3) & 3], corners[begin])] =
          edge_between(corners[end & 3], corners[(end + 1) & 3]);
    }
  }
  return next;
}

std::vector<Loop> loops(int inside) {
  auto next = successors(inside);
  std::vector<Loop> result;
  for (int first = 0; first < cube_edges; ++first) {
    Loop loop;
    for (int e = first; next[e] >= 0;) {
      loop.push_back(e);
      e = std::exchange(next[e], -1);
    }
    if (!loop.empty()) result.push_back(loop);
  }
  return result;
}

Vec3 middle(int edge) {
  const auto ends = edge_corners(edge);
  Vec3 sum = Vec3::Zero();
  for (const int c : ends) sum += Vec3(c & 1, c >> 1 & 1, c >> 2 & 1);
  return sum / 2;
}

double smallest_angle(const std::array<uint8_t, 3>& triangle) {
  double minimum = M_PI;
  for (int k = 0; k < 3; ++k) {
    const Vec3 here = middle(triangle[k]);
    const Vec3 a = middle(triangle[(k + 1) % 3]) - here, b = middle(triangle[(k + 2) % 3]) - here;
    minimum = std::min(minimum, std::atan2(a.cross(b).norm(), a.dot(b)));
  }
  return minimum;
}

struct Cut {
  CubeTriangles triangles;
  double angle = -1;  ///< smallest; −1: there is no such cut
};

/// The best cut of the part of a loop from `begin` to `end`, whose last side joins the two.
Cut best_cut(const Loop& loop, size_t begin, size_t end) {
  if (end - begin < 2) return {{}, M_PI};
  Cut best;
  const auto allowed = [&](size_t a, size_t b) {
    return b - a == 1 || !share_face(loop[a], loop[b]);
  };
  for (size_t apex = begin + 1; apex < end; ++apex) {
    if (!allowed(begin, apex) || !allowed(apex, end)) continue;
    const Cut left = best_cut(loop, begin, apex), right = best_cut(loop, apex, end);
    const std::array<uint8_t, 3> triangle{static_cast<uint8_t>(loop[begin]),
                                          static_cast<uint8_t>(loop[apex]),
                                          static_cast<uint8_t>(loop[end])};
    const double angle = std::min({left.angle, right.angle, smallest_angle(triangle)});
    if (angle <= best.angle) continue;
    best = {left.triangles, angle};
    best.triangles.insert(best.triangles.end(), right.triangles.begin(), right.triangles.end());
    best.triangles.push_back(triangle);
  }
  return best;
}

std::array<CubeTriangles, 256> all_cases() {
  std::array<CubeTriangles, 256> cases;
  for (int inside = 0; inside < 256; ++inside)
    for (const Loop& loop : loops(inside)) {
      const Cut cut = best_cut(loop, 0, loop.size() - 1);
      if (cut.angle < 0) throw base::InternalError("a loop of marching cubes cannot be cut");
      cases[inside].insert(cases[inside].end(), cut.triangles.begin(), cut.triangles.end());
    }
  return cases;
}

}  // namespace

std::array<int, 2> edge_corners(int edge) {
  const int axis = edge / 4, low = axis == 0 ? 1 : 0, high = axis == 2 ? 1 : 2;
  const int corner = (edge & 1) << low | (edge >> 1 & 1) << high;
  return {corner, corner | 1 << axis};
}

const std::array<CubeTriangles, 256>& cube_cases() {
  static const auto cases = all_cases();
  return cases;
}

}  // namespace repose::imaging
