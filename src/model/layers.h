#pragma once
#include <vector>

#include "repose/model/model.h"
#include "repose/model/skin_mesh.h"
#include "repose/scene/scene.h"

namespace repose::model {

/// Fractions of the thickness at which the layers lie, [layers], first 0, last 1: the scene's, or
/// even. Throws InputError where there are fewer than 2 or more than 64 layers, or the scene's
/// fractions are not as many, do not run from 0 to 1, or do not increase.
std::vector<double> layer_depths(const scene::Tissue& tissue);

/// [layers] mm: a column from the skin to its deepest point, in layers as by make_layers().
std::vector<Vec3> column_points(const Vec3& skin, const Vec3& deep,
                                const std::vector<double>& depths,
                                const std::vector<double>& depths_mm);

/// Repeats the skin in layers (docs/theory/model.md "Points", "Springs"): n layers of V vertices, E
/// edges and F triangles give nV points, nE + (n−1)(V + 2E) springs and (n−1)F prisms. Point =
/// column · n + layer; springs by set ("layer 0" … , "connecting 0" …, "diagonal 0" …), in a set by
/// edge or column; prisms by gap, ordered so that their volume is positive inwards. Everything is
/// soft tissue, without mass, force, stiffness or bone; rest lengths and volumes are the initial
/// ones. `deep` [V] are the deepest points, mm. `depths_mm`, if any, are how deep the upper layers
/// lie (scene::Tissue), in place of `depths`. A solid has no springs.
enum class Elements { springs, solid };
Model make_layers(const SkinMesh& mesh, const std::vector<Vec3>& deep,
                  const std::vector<double>& depths, const std::vector<double>& depths_mm = {},
                  Elements elements = Elements::springs);

}  // namespace repose::model
