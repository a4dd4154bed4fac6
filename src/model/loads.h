#pragma once
#include <vector>

#include "repose/model/model.h"
#include "repose/model/skin_mesh.h"
#include "repose/scene/scene.h"

/// Loads on the points: masses and external forces.
namespace repose::model {

/// Masses (kg) of a model of make_layers: each layer's mass shared over its points in proportion to
/// a third of the area of the layer's triangles around each; or with a density ρ, a sixth of ρ v_0
/// of every prism for each of its points. Without either, none. Throws InputError where the number
/// of masses is not that of the layers.
void set_masses(const scene::Tissue& tissue, const SkinMesh& mesh, Model& model);

/// Adds each force (N) of the scene, shared over the soft-tissue points of layer 0 within its
/// radius in proportion to the skin area around them, so that the shares sum to it exactly (to
/// rounding). Throws InputError where there is none within, saying how far the nearest is.
void distribute_forces(const scene::Scene& scene, const SkinMesh& mesh, Model& model);

}  // namespace repose::model
