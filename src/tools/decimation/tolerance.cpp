#include "tolerance.h"

#include <cmath>

namespace repose::tools::decimation {
using namespace surface;
namespace {

constexpr double kept_free = 1e-9;
constexpr size_t max_open_pieces = 5000;
/// Share of the distance that a point as high over a triangle as a piece's center may lie beside
/// it.
constexpr double margin_share = 0.5;

}  // namespace

Tolerance::Tolerance(const TriangleTree& tree, double distance, double extent)
    : tree_(tree), distance_(distance - kept_free * extent), squared_(distance_ * distance_) {}

bool Tolerance::contains(const Vec3& point) const {
  const int64_t found = tree_.any_within(point, squared_, hint_);
  if (found >= 0) hint_ = found;
  return found >= 0;
}

bool Tolerance::contains(const Corners& triangle, Vec3* outside) const {
  const auto fail = [&](const Vec3& point) {
    *outside = point;
    return false;
  };
  pieces_.clear();
  pieces_.emplace_back(triangle);
  for (size_t i = 0; i < pieces_.size(); ++i) {  // large pieces first: they show a fault soonest
    Piece piece = pieces_[i];
    if (tree_.one_covers(piece.corners(), squared_, hint_)) continue;
    for (const Vec3& corner : piece.corners())
      if (!contains(corner)) return fail(corner);
    const Vec3 center = piece.center();
    const auto nearest = tree_.nearest(center, squared_);
    if (nearest.triangle < 0 || pieces_.size() > max_open_pieces) return fail(center);
    hint_ = nearest.triangle;
    const double margin = margin_share * std::sqrt(squared_ - nearest.squared);
    piece.split(tree_.corners_of(nearest.triangle), distance_, margin, pieces_);
  }
  return true;
}

}  // namespace repose::tools::decimation
