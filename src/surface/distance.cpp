#include "repose/surface/distance.h"

#include <CGAL/AABB_tree.h>
#include <CGAL/Orthogonal_k_neighbor_search.h>
#include <CGAL/Search_traits_3.h>
#include <CGAL/Search_traits_adapter.h>
#include <CGAL/intersections.h>
#include <CGAL/property_map.h>
#include <CGAL/version.h>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "cgal.h"
#include "repose/base/error.h"
#include "repose/surface/edges.h"
#include "repose/surface/triangle_tree.h"

#if CGAL_VERSION_NR >= 1060000000
#include <CGAL/AABB_traits_3.h>
#else
#include <CGAL/AABB_traits.h>

#include <boost/variant/get.hpp>
#endif

namespace repose::surface {

namespace {

#if CGAL_VERSION_NR >= 1060000000
template <class Primitive>
using TreeTraits = CGAL::AABB_traits_3<Kernel, Primitive>;
template <class Part, class Variant>
const Part* part_of(const Variant& variant) {
  return std::get_if<Part>(&variant);
}
#else
template <class Primitive>
using TreeTraits = CGAL::AABB_traits<Kernel, Primitive>;
template <class Part, class Variant>
const Part* part_of(const Variant& variant) {
  return boost::get<Part>(&variant);
}
#endif

/// A triangle of the tree, kept by address (CGAL's AABBPrimitive).
class Leaf {
 public:
  using Id = const Triangle3*;
  using Point = Point3;
  using Datum = Triangle3;
  using Datum_reference = const Triangle3&;

  explicit Leaf(std::vector<Triangle3>::const_iterator triangle) : triangle_(&*triangle) {}
  Id id() const { return triangle_; }
  Datum_reference datum() const { return *triangle_; }
  Point reference_point() const { return triangle_->vertex(0); }

 private:
  Id triangle_;
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

/// Directions to look along, one after the other: x, for which boxes are quickest, then others
/// spread over the sphere (a golden-angle spiral), none along an axis.
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
  using Aabb = CGAL::AABB_tree<TreeTraits<Leaf>>;

  explicit Tree(const Surface& surface) : Tree(surface, with_area(surface)) {}
  Tree(const Surface& surface, std::vector<int64_t> kept)
      : numbers(std::move(kept)),
        nearest({surface.name, surface.points, base::pick(surface.triangles, numbers)}) {
    for (const int64_t t : numbers) triangles.push_back(to_cgal(surface, surface.triangles[t]));
    aabb.insert(triangles.cbegin(), triangles.cend());  // built by the first query
    for (const Triangle3& triangle : triangles) box += triangle.bbox();
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

  int64_t number(Leaf::Id id) const { return numbers[id - triangles.data()]; }

  /// From `point` in any direction, the whole surface lies nearer than half of this.
  double reach(const Vec3& point) const {
    const Vec3 low(box.xmin(), box.ymin(), box.zmin()), high(box.xmax(), box.ymax(), box.zmax());
    return 2 * (point - low).cwiseAbs().cwiseMax((point - high).cwiseAbs()).norm();
  }

  std::vector<Leaf::Id> meeting(const Segment3& segment) const {
    std::vector<Leaf::Id> ids;
    aabb.all_intersected_primitives(segment, std::back_inserter(ids));
    return ids;
  }

  /// Triangles that a segment along an axis meets; its box is a line, so no tree for rays is built.
  std::vector<Leaf::Id> meeting_along_axis(const Segment3& segment) const {
    std::vector<Leaf::Id> ids;
    TriangleTree::Box line;
    line.extend(from_cgal(segment.source()));
    line.extend(from_cgal(segment.target()));
    nearest.overlapping(line, [&](int64_t t) {
      if (CGAL::do_intersect(segment, triangles[t])) ids.push_back(&triangles[t]);
      return false;
    });
    return ids;
  }

  std::vector<int64_t> numbers;      ///< in the surface, of the triangles with an area
  TriangleTree nearest;              ///< of these
  std::vector<Triangle3> triangles;  ///< these
  Aabb aabb;
  CGAL::Bbox_3 box;
};

DistanceTree::DistanceTree(const Surface& surface) : tree_(std::make_unique<Tree>(surface)) {}
DistanceTree::~DistanceTree() = default;
DistanceTree::DistanceTree(DistanceTree&&) noexcept = default;
DistanceTree& DistanceTree::operator=(DistanceTree&&) noexcept = default;

DistanceTree::Nearest DistanceTree::nearest(const Vec3& query) const {
  require_finite(query);
  const TriangleTree::Nearest found = tree_->nearest.nearest(query);
  return {found.point, tree_->numbers[found.triangle], std::sqrt(found.squared)};
}

std::optional<DistanceTree::Hit> DistanceTree::first_hit(const Vec3& origin, const Vec3& direction,
                                                         double reach) const {
  require_finite(origin);
  require_finite(direction);
  const double end = std::min(reach, tree_->reach(origin));
  const Segment3 segment(to_cgal(origin), to_cgal(origin + end * direction));
  std::optional<Hit> first;
  const auto offer = [&](const Point3& at, Leaf::Id id) {
    const double distance = std::max(0.0, (from_cgal(at) - origin).dot(direction));
    if (first && distance >= first->distance) return;
    first = Hit{from_cgal(at), tree_->number(id), distance};
  };
  if (!(end > 0)) return first;
  for (const auto id : tree_->meeting(segment)) {
    const auto common = CGAL::intersection(segment, *id);
    if (!common) continue;
    if (const auto* point = part_of<Point3>(*common)) offer(*point, id);
    if (const auto* along = part_of<Segment3>(*common)) {
      offer(along->source(), id);
      offer(along->target(), id);
    }
  }
  return first;
}

bool DistanceTree::contains(const Vec3& query) const {
  require_finite(query);
  const Point3 start = to_cgal(query);
  if (!CGAL::do_overlap(start.bbox(), tree_->box)) return false;
  constexpr int max_directions = 64;
  for (int i = 0; i < max_directions; ++i) {
    const Point3 end = to_cgal(query + tree_->reach(query) * ray_direction(i));
    bool odd = false, sure = true;
    const Segment3 ray(start, end);
    for (const auto id : i == 0 ? tree_->meeting_along_axis(ray) : tree_->meeting(ray)) {
      const Crossing how = crossing(*id, start, end);
      if (how == Crossing::at_start) return true;
      sure = sure && how == Crossing::through;
      odd = !odd;
    }
    if (sure) return odd;
  }
  throw base::InternalError("every ray from a point runs along an edge of the surface");
}

namespace {

using Row = std::pair<Point3, int64_t>;
using Traits = CGAL::Search_traits_adapter<Row, CGAL::First_of_pair_property_map<Row>,
                                           CGAL::Search_traits_3<Kernel>>;
using Search = CGAL::Orthogonal_k_neighbor_search<Traits>;

}  // namespace

struct PointTree::Tree {
  Search::Tree rows;
};

PointTree::PointTree(const std::vector<Vec3>& points) : tree_(std::make_unique<Tree>()) {
  for (size_t p = 0; p < points.size(); ++p)
    tree_->rows.insert({to_cgal(points[p]), static_cast<int64_t>(p)});
  tree_->rows.build();
}

PointTree::~PointTree() = default;

int64_t PointTree::nearest(const Vec3& query) const {
  return Search(tree_->rows, to_cgal(query), 1).begin()->first.second;
}

}  // namespace repose::surface
