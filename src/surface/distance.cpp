#include "repose/surface/distance.h"

#include <CGAL/intersections.h>
#include <CGAL/version.h>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "cgal.h"
#include "repose/base/error.h"
#include "repose/surface/edges.h"
#include "repose/surface/triangle_tree.h"

#if CGAL_VERSION_NR < 1060000000
#include <boost/variant/get.hpp>
#endif

namespace repose::surface {

namespace {

template <class Part, class Variant>
const Part* part_of(const Variant& variant) {
#if CGAL_VERSION_NR >= 1060000000
  return std::get_if<Part>(&variant);
#else
  return boost::get<Part>(&variant);
#endif
}

/// A segment as a region of a tree of boxes (Ericson, Real-Time Collision Detection, 5.3.3). Boxes
/// are taken larger by more than rounding, so that none that it meets is missed.
class Line {
 public:
  Line(const Vec3& start, const Vec3& end)
      : middle_((start + end) / 2),
        half_((end - start) / 2),
        size_(half_.cwiseAbs()),
        margin_(relative_margin * start.cwiseAbs().cwiseMax(end.cwiseAbs()).maxCoeff()) {}
  bool overlaps(const TriangleTree::Box& box) const {
    const Vec3 from = middle_ - (box.low + box.high) / 2;
    const Vec3 extent = ((box.high - box.low) / 2 * (1 + relative_margin)).array() + margin_;
    if (!(from.cwiseAbs().array() <= (extent + size_).array()).all()) return false;
    const Vec3 across(extent.y() * size_.z() + extent.z() * size_.y(),
                      extent.z() * size_.x() + extent.x() * size_.z(),
                      extent.x() * size_.y() + extent.y() * size_.x());
    return (from.cross(half_).cwiseAbs().array() <= across.array()).all();
  }

 private:
  static constexpr double relative_margin = 1e-12;
  Vec3 middle_, half_, size_;
  double margin_;
};

enum class Crossing { through, beside_edge, at_start };

/// Classifies where the segment from `start` to `end` meets a triangle that it intersects.
Crossing crossing(const Triangle3& t, const Point3& start, const Point3& end) {
  if (CGAL::orientation(t[0], t[1], t[2], start) == CGAL::COPLANAR)
    return t.has_on(start) ? Crossing::at_start : Crossing::beside_edge;
  for (int k = 0; k < 3; ++k)
    if (CGAL::orientation(start, end, t[k], t[k + 1]) == CGAL::COPLANAR)
      return Crossing::beside_edge;
  return Crossing::through;
}

/// Directions of rays, one after the other: x, which meets the fewest boxes, then others spread
/// over the sphere (a golden-angle spiral), none along an axis.
Vec3 ray_direction(int i) {
  if (i == 0) return Vec3::UnitX();
  const double z = 2 * std::fmod(0.37 + i * (std::numbers::phi - 1), 1.0) - 1;
  const double angle = 0.7 + i * 2.399963229728653, radius = std::sqrt(1 - z * z);
  return {radius * std::cos(angle), radius * std::sin(angle), z};
}

void require_finite(const Vec3& query) {
  if (!query.allFinite()) throw base::InternalError("distance to a point that is not finite");
}

}  // namespace

struct DistanceTree::Tree {
  explicit Tree(const Surface& surface) : Tree(surface, with_area(surface)) {}
  Tree(const Surface& surface, std::vector<int64_t> kept)
      : numbers(std::move(kept)),
        boxes({surface.name, surface.points, base::pick(surface.triangles, numbers)}) {
    for (const int64_t t : numbers) {
      triangles.push_back(to_cgal(surface, surface.triangles[t]));
      box.extend(TriangleTree::box_of(corners(surface, surface.triangles[t])));
    }
  }

  static std::vector<int64_t> with_area(const Surface& surface) {
    require_sound(surface);
    std::vector<int64_t> kept;
    for (size_t t = 0; t < surface.triangles.size(); ++t)
      if (!to_cgal(surface, surface.triangles[t]).is_degenerate())
        kept.push_back(static_cast<int64_t>(t));
    if (kept.empty())
      base::refuse("{}: no triangle with an area, so nothing to measure to; check the mesh",
                   surface.name);
    return kept;
  }

  /// From `point` in any direction, the whole surface lies nearer than half of this.
  double reach(const Vec3& point) const {
    return 2 * (point - box.low).cwiseAbs().cwiseMax((point - box.high).cwiseAbs()).norm();
  }

  /// Rows of the triangles that a segment meets.
  std::vector<int64_t> meeting(const Vec3& start, const Vec3& end) const {
    const Segment3 segment(to_cgal(start), to_cgal(end));
    std::vector<int64_t> rows;
    boxes.overlapping(Line(start, end), [&](int64_t row) {
      if (CGAL::do_intersect(segment, triangles[row])) rows.push_back(row);
      return false;
    });
    return rows;
  }

  std::vector<int64_t> numbers;      ///< in the surface, of the triangles with an area
  TriangleTree boxes;                ///< of these
  std::vector<Triangle3> triangles;  ///< these
  TriangleTree::Box box;             ///< around them
};

DistanceTree::DistanceTree(const Surface& surface) : tree_(std::make_unique<Tree>(surface)) {}
DistanceTree::~DistanceTree() = default;
DistanceTree::DistanceTree(DistanceTree&&) noexcept = default;
DistanceTree& DistanceTree::operator=(DistanceTree&&) noexcept = default;

DistanceTree::Nearest DistanceTree::nearest(const Vec3& query) const {
  require_finite(query);
  const TriangleTree::Nearest found = tree_->boxes.nearest(query);
  return {found.point, tree_->numbers[found.triangle], std::sqrt(found.squared)};
}

std::optional<DistanceTree::Hit> DistanceTree::first_hit(const Vec3& origin, const Vec3& direction,
                                                         double reach) const {
  require_finite(origin);
  require_finite(direction);
  const double length = std::min(reach, tree_->reach(origin));
  std::optional<Hit> first;
  if (!(length > 0)) return first;
  const Vec3 end = origin + length * direction;
  const Segment3 segment(to_cgal(origin), to_cgal(end));
  const auto offer = [&](const Point3& at, int64_t row) {
    const double distance = std::max(0.0, (from_cgal(at) - origin).dot(direction));
    if (first && distance >= first->distance) return;
    first = Hit{from_cgal(at), tree_->numbers[row], distance};
  };
  for (const int64_t row : tree_->meeting(origin, end)) {
    const auto common = CGAL::intersection(segment, tree_->triangles[row]);
    if (!common) continue;
    if (const auto* point = part_of<Point3>(*common)) offer(*point, row);
    if (const auto* along = part_of<Segment3>(*common)) {
      offer(along->source(), row);
      offer(along->target(), row);
    }
  }
  return first;
}

bool DistanceTree::contains(const Vec3& query) const {
  require_finite(query);
  if (tree_->box.squared_distance(query) > 0) return false;
  const Point3 start = to_cgal(query);
  constexpr int max_directions = 64;
  for (int i = 0; i < max_directions; ++i) {
    const Vec3 end = query + tree_->reach(query) * ray_direction(i);
    bool odd = false, sure = true;
    for (const int64_t row : tree_->meeting(query, end)) {
      const Crossing how = crossing(tree_->triangles[row], start, to_cgal(end));
      if (how == Crossing::at_start) return true;
      sure = sure && how == Crossing::through;
      odd = !odd;
    }
    if (sure) return odd;
  }
  throw base::InternalError("every ray from a point runs along an edge of the surface");
}

}  // namespace repose::surface
