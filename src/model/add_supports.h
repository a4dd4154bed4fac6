#pragma once
#include "repose/model/build.h"
#include "repose/model/material.h"
#include "repose/model/skin_mesh.h"

namespace repose::model {

/// Adds elastic supports of columns to a model of make_layers, as elements of the term
/// "elastic_support" at the deepest points, or at all points of a column that is supported_whole:
/// stiffness × area of the point / compliance of the column, N/mm. `mesh` with the model's
/// triangles. Reads the meshes and volumes of the material's regions.
void add_supports(const ColumnEnds& ends, const scene::Material& material, const SkinMesh& mesh,
                  Model& model);

/// Shares supports between points and their doubles beyond a cut (`twins`, rows of both).
void share_supports(const std::vector<std::array<int64_t, 2>>& twins, Model& model);

}  // namespace repose::model
