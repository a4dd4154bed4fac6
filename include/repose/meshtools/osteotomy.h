#pragma once
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "repose/surface/surface.h"

/// Bones cut into pieces.
namespace repose::meshtools {

using surface::Surface;

/// A saw cut in a plane. Its front is the side that the normal points to.
struct CutPlane {
  Vec3 point;                                               ///< mm
  Vec3 normal;                                              ///< any length but 0
  double radius = std::numeric_limits<double>::infinity();  ///< mm: cuts within this disc only
};

/// Cuts that take one piece off a bone.
struct Osteotomy {
  std::string piece;               ///< name of the piece
  std::vector<CutPlane> planes;    ///< and
  std::optional<Surface> surface;  ///< a cutting surface, open or closed, manifold, oriented
  double kerf = 0;                 ///< mm the saw takes, half on either side of each cut
  /// A point inside the piece. Without one the piece is what lies in front of every cut.
  std::optional<Vec3> seed;
};

/// The parts of a bone: each closed, manifold and oriented outwards. Their volumes add up to the
/// bone's, to rounding.
struct Pieces {
  Surface piece, rest;
  double kerf_volume = 0;            ///< mm³, what the saw took
  std::vector<std::string> remarks;  ///< lines for a person
};

/// Cuts a closed, manifold, outward bone. All cuts are made at once and where they meet, each ends
/// that parts nothing of the piece: cuts in front of each other's backs leave no trace. With a seed
/// and a kerf the whole of each cut is sawn. A shell that no cut meets goes with the part that
/// contains it, or with the piece where all cuts are planes without a radius and it is in front of
/// each, or stays. Where a cut runs exactly through vertices so that parts would touch in a point,
/// it is shifted by some 1e-4 mm. Computed with exact predicates and constructions, then rounded.
/// Throws InputError naming bone, piece and remedy: cuts that miss the bone or end inside it, a
/// piece or a rest that comes out empty, a seed outside the bone or in the kerf, surfaces that
/// intersect themselves where the cut runs.
Pieces cut_bone(const Surface& bone, const Osteotomy& plan);

/// A cutting surface from a file (PLY, STL, OBJ, OFF): manifold and oriented, open or closed, of
/// one part or several. Throws InputError naming the file.
Surface load_cutter(const std::filesystem::path& file);

}  // namespace repose::meshtools
