#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "repose/surface/surface.h"

/// A synthetic head of any resolution: an open skin patch with an open mouth, a skull and a
/// mandible, made from the analytic shape in phantom_shape.h. Axes LPS in mm, the jaw's hinge axis
/// is the x axis.
namespace repose::tools::phantom {

using surface::Surface;

struct PhantomOptions {
  /// Vertices of the skin, exactly. 477 gives the counts of Teschner, Girod & Girod (2000): 1351
  /// edges, 874 triangles, 80 of the edges on the mouth and the rim.
  int64_t skin_vertices = 2000;
  /// Length of the bones' edges at the face, mm; the back of the cranium is up to four times
  /// coarser. 0: as long as the skin's edges, but between 1 and 5 mm.
  double bone_edge = 0;
};
constexpr int64_t phantom_vertices_min = 477, phantom_vertices_max = 2'000'000;
constexpr double phantom_bone_edge_min = 0.5, phantom_bone_edge_max = 6;

struct Phantom {
  Surface skin;      ///< annulus (V − E + F = 0), two border loops: mouth and outer rim
  Surface skull;     ///< closed, one component, outward
  Surface mandible;  ///< closed, one component, outward
  std::map<std::string, Vec3> landmarks;  ///< mm, by name
};

/// The skin alone: exactly `vertices` points on the analytic surface, triangles close to
/// equilateral, seen from outside counter-clockwise. Star-shaped as seen from inside the head, so
/// it cannot intersect itself. The same on every machine up to rounding in libm.
/// Time in proportion to the vertices: about 2 s for 20 000, below 2 min for a million. Throws
/// InputError out of range.
Surface make_phantom_skin(int64_t vertices);

/// The bones, meshed by Delaunay refinement (CGAL Mesh_3), so free of self-intersection; vertices
/// may differ between versions of CGAL. `edge` in mm. Throws InputError out of range.
Surface make_phantom_skull(double edge);
Surface make_phantom_mandible(double edge);

/// Skin, bones and landmarks. Throws InputError for options out of range.
Phantom make_phantom(const PhantomOptions& options);

/// Tissue of the scenes: the solid with literature moduli, or the springs of the paper.
enum class PhantomTissue { solid, springs };

/// Returns the paths of the files of a head: PREFIX_skin.ply, _skull.ply, _mandible.ply,
/// _landmarks.json, PREFIX.mrk.json (3D Slicer fiducials, LPS) and the scenes
/// PREFIX_jaw_opening.yaml and PREFIX_jaw_advance.yaml.
std::vector<std::filesystem::path> phantom_files(const std::filesystem::path& prefix);

/// Writes these files, each complete or not at all, and returns their paths. Throws InputError
/// where a file cannot be written.
std::vector<std::filesystem::path> write_phantom(const std::filesystem::path& prefix,
                                                 const Phantom& phantom,
                                                 PhantomTissue tissue = PhantomTissue::solid);

}  // namespace repose::tools::phantom
