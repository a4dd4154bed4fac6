#pragma once
#include <string>
#include <vector>

#include "repose/model/skin_mesh.h"

/// Columns that cross: where tissue between neighboring columns would be folded.
namespace repose::model {

/// Returns the margin of the prisms between three columns from folding, for any layers. With the
/// column of corner i running X_i + s w_i, s in [0, 1], and N(s) the cross product of the
/// triangle's sides at s, the Jacobian of the wedge map at that corner is J_i(s) = N(s) · w_i, a
/// quadratic; returned is its least value over s and the three corners, over |N(0)| |w_i|.
/// Positive: every prism of every number of layers has positive volume and no folded corner.
double fold_margin(const std::array<Vec3, 3>& skin, const std::array<Vec3, 3>& column);

/// The triangles whose columns, directions[v] · thickness[v], have less than the margin requested.
std::vector<int64_t> folded_triangles(const SkinMesh& mesh, const std::vector<Vec3>& directions,
                                      const std::vector<double>& thickness);

/// Shortens columns (×0.9 at a time, neighbors with them so that the deep surface stays no steeper
/// than it was made) until no triangle is folded. Throws RefusedPlaces (skin_mesh.h) where columns
/// would become shorter than 0.05 mm.
void shorten_folded(const SkinMesh& mesh, const std::vector<Vec3>& directions,
                    const std::string& skin_name, std::vector<double>& thickness);

}  // namespace repose::model
