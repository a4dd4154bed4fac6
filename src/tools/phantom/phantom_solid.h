#pragma once
#include <vector>

#include "repose/base/geometry.h"

/// Solids made of a few soft-edged parts, given by a signed distance (mm, negative inside).
namespace repose::tools::phantom {

struct Bead {
  Vec3 center;    ///< mm
  double radius;  ///< mm
};

/// One part of a solid, joined to the parts before it, or cut out of them, over a soft edge: an
/// ellipsoid; a chain of round cones between beads; or a sheet, the strip of rounded triangular
/// plates between beads 0 1 2, 1 2 3, …, all of them as thick as twice the first bead's radius.
struct Part {
  enum class Kind { ellipsoid, chain, sheet };
  Kind kind;
  std::vector<Bead> beads;  ///< an ellipsoid has one, its center
  Vec3 semi_axes;           ///< mm, of an ellipsoid
  double blend;             ///< mm over which it flows into the parts before it
  Vec3 middle;              ///< mm, of a sphere around the part
  double extent;            ///< mm, its radius
  double stretch;    ///< how many times further off than its distance says a point may be; 1 for
                     ///< all but an ellipsoid, whose distance is not exact
  bool cut = false;  ///< taken away instead of added
};

Part ellipsoid(const Vec3& center, const Vec3& semi_axes, double blend);
Part chain(std::vector<Bead> beads, double blend);
Part sheet(std::vector<Bead> beads, double blend);
Part cut(Part part);

/// The lesser (greater) of two distances, rounded where they are within `blend` of each other, by
/// at most blend / 4; blend 0 does not round.
double soft_min(double a, double b, double blend);
double soft_max(double a, double b, double blend);

/// Signed distance to parts joined in their order at (|x|, y, z). Exact to first order near the
/// surface, and nowhere steeper than about 1: outside, the true distance is hardly ever less.
double signed_distance(const std::vector<Part>& parts, const Vec3& point);

}  // namespace repose::tools::phantom
