#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "repose/surface/surface.h"
#include "repose/surface/write.h"

/// Range images of laser scanners as triangle surfaces.
namespace repose::tools::range_scan {

using surface::PointData;
using surface::Surface;

/// A grid of cells, each of which holds a point or nothing.
struct RangeGrid {
  std::string name;  ///< the file, for messages
  int64_t columns = 0, rows = 0;
  std::vector<int64_t> cell;  ///< [rows][columns] row of points, −1 for nothing
  std::vector<Vec3> points;   ///< in the file's unit
  PointData data;             ///< colors, and other numbers of each point by their names
};

/// Reads a Cyberware or Stanford range-grid PLY (text or binary; obj_info num_cols and num_rows,
/// elements vertex and range_grid). Throws InputError naming the file, and the line of a header or
/// the row of an element, where it is no such file, truncated, or names points that are not there.
RangeGrid read_range_grid(const std::filesystem::path& file);

struct ScanOptions {
  double scale = 1;         ///< mm per unit of the file
  double longest_edge = 0;  ///< mm; 0: four times the median distance of neighboring points
  double steepest = 80;     ///< degrees between a triangle's normal and the way to the scanner
  bool cylinder = false;    ///< the scanner went round the y axis: columns close to a ring, and it
                            ///< looks at that axis; otherwise it looks along −z
  bool largest = false;     ///< keep the component of the most triangles alone
};

struct ScanMesh {
  Surface surface;  ///< manifold, facing the scanner; mm
  PointData data;
  double longest_edge = 0;  ///< mm, what triangles were cut at
  int64_t cut_long = 0;     ///< triangles left out for an edge
  int64_t cut_steep = 0;    ///< and for their slope alone
  int64_t dropped = 0;      ///< and of components other than the largest
  int64_t split = 0;        ///< points doubled where two sheets met in one
  int64_t unused = 0;       ///< points in no triangle, left out
};

/// Triangles between neighboring cells: two where all four corners of a square hold points, cut
/// along the shorter diagonal, one where three do. A triangle across a step in depth is left out:
/// one with too long an edge, or too steep. Throws InputError where none is left.
ScanMesh mesh_of(const RangeGrid& grid, const ScanOptions& options);

/// The lengths, mm, of the border loops of each component but its longest, longest first.
std::vector<double> hole_lengths(const Surface& surface);

}  // namespace repose::tools::range_scan
