#pragma once
#include <vector>

#include "repose/model/model.h"
#include "repose/model/skin_mesh.h"
#include "repose/scene/scene.h"

namespace repose::model {

/// The volume v_j (mm³) that belongs to each spring of make_layers, [S], from those of its prisms:
/// each prism's initial volume is shared equally over its 15 springs, and a spring sums the shares
/// of the prisms around it, so that Σ_j v_j is the volume of the tissue (docs/theory/model.md
/// "Spring laws").
std::vector<double> spring_volumes(const SkinMesh& mesh, const std::vector<double>& prism_volumes);

/// Mean thickness of a gap between layers over the mean length of an edge in a layer, of the
/// columns of make_layers.
double layer_slope(const SkinMesh& mesh, const std::vector<Vec3>& deep,
                   const scene::Tissue& tissue);

/// Gives each spring k0, law and s_ref by the scene's rules: for the set "layer 2" the rule of that
/// name, then "layer", then "default", then 1 N/mm, quartic, 1 mm; the first that says something
/// counts. A modulus Y gives k0 = Y v_j / r_0²; a reference of 0 gives s_ref = r_0. The model is
/// one of make_layers; `slope` is the layer_slope() of the whole tissue, which isotropic tissue
/// reads. Throws InputError for a rule whose name is no set of the model.
void set_stiffness(const scene::Tissue& tissue, const SkinMesh& mesh, double slope, Model& model);

}  // namespace repose::model
