#pragma once
#include <string>
#include <vector>

#include "xdmf.h"

namespace repose::results {

/// Sizes of the arrays in a result file.
struct FileCounts {
  int64_t points = 0, springs = 0, prisms = 0, skin = 0;
  int64_t bone_points = 0, bone_triangles = 0;  ///< of the merged bone surfaces
  bool solid = false;                           ///< every step has the fields of a solid
};

/// An array of the points that some steps have.
struct OptionalField {
  std::string name;
  bool vector = false;
  std::vector<bool> in_step;  ///< [steps]
};

/// Returns the views of a result file for ParaView, one block a file: tissue (wedges), springs
/// (lines), skin and bones (triangles). `bones_moved` [steps]: whether the step stores moved bone
/// surfaces. Tissue and skin show the optional fields. Blocks without a cell are listed too.
std::vector<XdmfBlock> views(const FileCounts& counts, const std::vector<OptionalField>& fields,
                             const std::vector<bool>& bones_moved);

/// A bone's rows in the merged surfaces.
struct NamedBone {
  std::string name;
  int64_t first_point = 0, points = 0, triangles = 0;
};

/// The views that have cells by name, with a block for each bone in the place of that of all.
std::vector<XdmfBlock> named_blocks(const std::vector<XdmfBlock>& views,
                                    const std::vector<NamedBone>& bones);

}  // namespace repose::results
