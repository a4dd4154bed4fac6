#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "repose/surface/surface.h"

namespace repose::surface {

/// Data at the points of a surface in a file; each empty or one entry a point.
struct PointData {
  struct Field {
    std::string name;            ///< letters, digits and _
    std::vector<double> values;  ///< [P]
  };
  struct VectorField {
    std::string name;
    std::vector<Vec3> values;  ///< [P]
  };
  std::vector<std::array<uint8_t, 3>> colors;  ///< red, green, blue
  std::vector<Field> fields;
  std::vector<VectorField> vectors;
};

/// Refuses a file whose ending is none of .ply, .stl, .obj and .vtp (in any case).
void check_surface_ending(const std::filesystem::path& file);

/// Writes a surface in the format its ending names, complete or not at all: .ply (binary little
/// endian, double coordinates), .stl (binary, float), .obj (text, exact) or .vtp (VTK's XML,
/// binary). PLY and VTP keep colors and fields, VTP vectors too, OBJ colors, STL nothing. Throws
/// InputError for another ending, more points than the format can number, or a file that cannot be
/// written.
void write_surface(const std::filesystem::path& file, const Surface& surface,
                   const PointData& data = {});

}  // namespace repose::surface
