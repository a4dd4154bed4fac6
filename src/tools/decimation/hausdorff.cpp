#include "repose/tools/decimation/hausdorff.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "piece.h"
#include "repose/base/error.h"
#include "repose/surface/edges.h"
#include "repose/surface/triangle_tree.h"

namespace repose::tools::decimation {
using namespace surface;
namespace {

constexpr size_t max_pieces = 50'000'000;

class Search {
 public:
  Search(const Surface& from, const Surface& to, double accuracy)
      : from_(from), tree_(to), accuracy_(accuracy) {}

  DistanceBounds run() {
    for (const auto& triangle : from_.triangles)
      for (const int64_t vertex : triangle) see(from_.points[vertex]);
    for (const auto& triangle : from_.triangles) offer(Piece(corners(from_, triangle)));
    size_t refined = 0;
    while (!pieces_.empty() && pieces_.top().upper > lower_ + accuracy_ && refined++ < max_pieces)
      refine();
    const double upper = pieces_.empty() ? 0 : pieces_.top().upper;
    return {lower_, std::max({upper, lower_, dropped_})};
  }

 private:
  struct Bounded {
    double upper;
    Piece piece;
    bool operator<(const Bounded& other) const { return upper < other.upper; }
  };

  /// Cuts the piece with the greatest bound: along the edges of the triangle nearest to its center,
  /// or in halves.
  void refine() {
    Piece piece = pieces_.top().piece;
    pieces_.pop();
    const auto nearest = tree_.nearest(piece.center());
    parts_.clear();
    piece.split(tree_.corners_of(nearest.triangle), lower_ + accuracy_, 0, parts_);
    for (const Piece& part : parts_) {
      for (const Vec3& corner : part.corners()) see(corner);
      offer(part);
    }
  }

  void see(const Vec3& point) {
    if (tree_.any_within(point, lower_ * lower_) >= 0) return;
    lower_ = std::sqrt(tree_.nearest(point).squared);
  }

  /// Pieces that cannot matter are not kept.
  void offer(const Piece& piece) {
    const double enough = lower_ + 0.5 * accuracy_;
    const double upper = std::sqrt(tree_.min_max(piece.corners(), enough * enough));
    if (upper <= enough)
      dropped_ = std::max(dropped_, upper);
    else
      pieces_.push({upper, piece});
  }

  const Surface& from_;
  TriangleTree tree_;
  double accuracy_, lower_ = 0, dropped_ = 0;
  std::priority_queue<Bounded> pieces_;
  std::vector<Piece> parts_;
};

}  // namespace

DistanceBounds one_sided_distance(const Surface& from, const Surface& to, double accuracy) {
  if (from.triangles.empty() || to.triangles.empty())
    throw base::InternalError("distance of surfaces without triangles");
  DistanceBounds bounds = Search(from, to, accuracy).run();
  bounds.upper += 1e-12 * (bounding_diagonal(to.points) + bounding_diagonal(from.points));
  return bounds;
}

}  // namespace repose::tools::decimation
