#pragma once
#include "column_layout.h"
#include "repose/model/model.h"

namespace repose::model {

/// Adds the contact of a model of make_layers or of a part of it, point by point: bones that the
/// tissue may reach as they move, unless the scene's contact leaves them out; bones that it slides
/// along; instruments on which the skin slides or, where bones touch, that hold it.
void add_contact(const scene::Scene& scene, const SkinMesh& mesh, const ColumnEnds& ends,
                 Model& model);

/// Returns the spacing of the grids of distances, mm: the scene's, or 0.5 where bones are cut, or
/// half the thickness of thin bone near the tissue, but 0.5 at least and 0.6 at most.
double grid_spacing(const scene::Scene& scene, const ColumnLayout& layout);

/// Doubled points, whose pairs are given, touch what the points touched, with half the area each.
void share_pairs(const std::vector<std::array<int64_t, 2>>& pairs, Model& model);

/// The sides of a cut made by cut_along, whose pairs of doubled points are given, do not pass one
/// another any more.
void add_cut_faces(const Cut& cut, const std::vector<std::array<int64_t, 2>>& pairs, Model& model);

}  // namespace repose::model
