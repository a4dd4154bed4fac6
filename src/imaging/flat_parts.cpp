#include "flat_parts.h"

#include <cmath>

#include "repose/surface/edges.h"
#include "repose/surface/triangle_tree.h"

namespace repose::imaging {
using namespace surface;
namespace {

constexpr double beside_plane = 0.5;  // mm
constexpr double min_cosine = 0.95;
constexpr int64_t seed_every = 40;
constexpr int refits = 3;

struct Plane {
  Vec3 point, normal;
};

/// Triangles with what growing a part asks of them.
class Parts {
 public:
  explicit Parts(const Surface& surface) : beside_(surface.triangles.size(), {-1, -1, -1}) {
    const EdgeTable edges(surface.triangles);
    for (int64_t e = 0; e < edges.edges(); ++e)
      if (edges[e].size() == 2) {
        beside_[edges[e][0].triangle][edges[e][0].corner] = edges[e][1].triangle;
        beside_[edges[e][1].triangle][edges[e][1].corner] = edges[e][0].triangle;
      }
    for (const Triangle& triangle : surface.triangles) {
      const Corners at = corners(surface, triangle);
      center_.push_back((at[0] + at[1] + at[2]) / 3);
      normal_.push_back(scaled_normal(at) / 2);
    }
    last_visit_.assign(beside_.size(), -1);
  }

  Plane at(int64_t triangle) const { return {center_[triangle], normal_[triangle].normalized()}; }

  /// The triangles around `seed` that are near the plane, and the plane that fits them better.
  std::vector<int64_t> grow(int64_t seed, Plane& plane, double& area) {
    std::vector<int64_t> part{seed};
    last_visit_[seed] = ++visit_;
    area = 0;
    Vec3 point = Vec3::Zero(), normal = Vec3::Zero();
    for (size_t next = 0; next < part.size(); ++next) {
      const int64_t t = part[next];
      area += normal_[t].norm();
      point += normal_[t].norm() * center_[t];
      normal += normal_[t];
      for (const int64_t other : beside_[t]) {
        if (other < 0 || last_visit_[other] == visit_ || !fits(other, plane)) continue;
        last_visit_[other] = visit_;
        part.push_back(other);
      }
    }
    plane = {point / area, normal.normalized()};
    return part;
  }

 private:
  bool fits(int64_t t, const Plane& plane) const {
    return std::abs((center_[t] - plane.point).dot(plane.normal)) < beside_plane &&
           normal_[t].dot(plane.normal) > min_cosine * normal_[t].norm();
  }

  std::vector<Triangle> beside_;
  std::vector<Vec3> center_, normal_;  ///< mm; mm², the length is the area
  std::vector<int64_t> last_visit_;
  int64_t visit_ = 0;
};

}  // namespace

std::vector<char> flat_parts(const Surface& surface, double area) {
  Parts parts(surface);
  std::vector<char> flat(surface.triangles.size(), 0), small(flat.size(), 0);
  for (int64_t seed = 0; seed < static_cast<int64_t>(flat.size()); seed += seed_every) {
    if (flat[seed] || small[seed]) continue;
    Plane plane = parts.at(seed);
    double grown = 0;
    std::vector<int64_t> part;
    for (int fit = 0; fit <= refits && (fit == 0 || grown > area / 20); ++fit)
      part = parts.grow(seed, plane, grown);
    if (grown >= area)
      for (const int64_t t : part) flat[t] = 1;
    else if (grown < area / 2)
      for (const int64_t t : part) small[t] = 1;
  }
  return flat;
}

}  // namespace repose::imaging
