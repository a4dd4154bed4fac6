#pragma once
#include <vector>

#include "columns.h"
#include "repose/model/build.h"
#include "repose/model/skin_mesh.h"
#include "repose/scene/scene.h"

/// Loads on the points: masses, external forces and instruments.
namespace repose::model {

/// Loads of all columns of a scene's tissue. `rim` [V] is 1 at columns that are held in whole.
/// Throws InputError where an instrument reaches no free point of the skin, a force has none within
/// its radius, or the number of masses is not that of the layers.
ColumnLoads column_loads(const scene::Scene& scene, const SkinMesh& mesh, const Columns& columns,
                         const std::vector<char>& rim);

/// Gives a model of make_layers its loads: each layer's mass (kg) shared over its points in
/// proportion to a third of the area of the layer's triangles around each, or with a density ρ a
/// sixth of ρ v_0 of every prism for each of its points; the forces (N) on the points of the skin;
/// and the points that instruments hold, with their targets. `mesh` has the model's triangles.
void set_loads(const scene::Tissue& tissue, const SkinMesh& mesh, const ColumnLoads& loads,
               Model& model);

/// Returns the area, mm², that each point of a layered model stands for in its layer.
std::vector<double> point_areas(const SkinMesh& mesh, const Model& model);

}  // namespace repose::model
