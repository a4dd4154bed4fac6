#pragma once
#include <functional>

#include "repose/surface/surface.h"

namespace repose::meshtools {

using surface::Surface;

/// Skin within this distance of bones and places is taken, mm, straight.
constexpr double face_near = 25;

/// Request for the part of a given skin that is solved, and for its mesh.
struct FaceRequest {
  double edge;                                              ///< mm, of the triangles
  std::vector<std::function<bool(const Vec3&)>> regions{};  ///< the skin in these is taken
  std::vector<Surface> beneath{};  ///< without any, that near these (moved bones) …
  std::vector<Vec3> places{};      ///< … and these; where there are none either, all of it
  double margin = 35;              ///< mm along the skin beyond face_near
};

struct Face {
  Surface skin;                    ///< manifold, one component, its triangles nearly equilateral
  double off_95 = 0, off_max = 0;  ///< mm from its vertices to the given skin
  double min_angle = 0;            ///< degrees, of its triangles
  int64_t openings = 0;            ///< of the given skin beside it, as large as an open mouth
  int64_t borders = 0;             ///< loops of its own border
};

/// A skin fit to be solved, from any triangles: the outer skin (outer_skin.h) in the regions, or
/// over the bones that move and a margin, without the scan's ends, with no hole in it but the
/// openings of the given skin that are as large as a mouth, remeshed, its angles below 22° widened
/// where that can be, and then drawn along its normals to the given triangles, whose offsets within
/// 3 mm are averaged over an edge, so that noise is not followed; what is farther off (ears) is
/// passed over. Throws InputError if no outer skin is in the regions or near the bones.
Face solvable_face(const Surface& given, const FaceRequest& request);

/// An edge for a head of this size, mm: a seventieth of the surface's bounding diagonal, 2 to 8.
double edge_for(const Surface& given);

}  // namespace repose::meshtools
