#pragma once
#include <mpi.h>

#include <cstdint>
#include <vector>

#include "repose/base/collective.h"
#include "repose/base/geometry.h"
#include "repose/discrete/part.h"

namespace repose::discrete {

/// Motion of bones: how each moves as a whole.
struct BoneMotions {
  std::vector<Mat4> transform;  ///< [bones] to load 1
  std::vector<char> straight;   ///< [bones] the points go straight to their targets
};

/// Returns how the bones of a model with all their points move. InputError.
BoneMotions bone_motions(const model::Model& model);

/// The share of a model that a rank's part is built from: at least all elements at its points, in
/// the order of the whole model.
struct Piece {
  model::Model model;
  bool solid = false;  ///< the whole model is one
  BoneMotions bones;
  std::vector<int> owner;        ///< [N] rank of each point
  std::vector<int64_t> place;    ///< [N] of each point, rank after rank, column after column
  std::vector<int64_t> unknown;  ///< [N] block number or −1
  /// Rows in the whole model: [N], [springs], [prisms], [edges]. −1 where no part needs it.
  std::vector<int64_t> point_row, spring_row, prism_row, edge_row;
  model::Counts counts;  ///< of the whole model; kinds of points are counted by build_part()
  UnknownBlocks unknowns;
};

/// Calls visit(point) for every point of an element, of whatever kind.
template <class Model, class Visit>
void for_each_point(Model& model, const Visit& visit) {
  const auto visit_all = [&](auto& elements) {
    for (auto& points : elements)
      for (auto& point : points) visit(point);
  };
  const auto visit_each = [&](auto& points) {
    for (auto& point : points) visit(point);
  };
  visit_all(model.springs.points);
  visit_all(model.prisms.points);
  visit_all(model.edges.points);
  visit_all(model.skin);
  visit_each(model.contact.pairs.point);
  visit_each(model.contact.cut_faces.point);
  for (auto& elements : model.elements) visit_each(elements.points);
}

/// Returns rows of a group of arrays (model::for_each_array).
template <class Group>
Group pick_rows(Group group, const std::vector<int64_t>& rows) {
  model::for_each_array(group,
                        [&](const char*, auto& values) { values = base::pick(values, rows); });
  return group;
}

/// Copies surfaces; their names stay behind.
void copy_surfaces(const base::Message& copy, std::vector<surface::Surface>& surfaces);

/// Returns a rank's blocks; `begin` [ranks + 1]: the first block of each rank.
UnknownBlocks unknown_blocks(const std::vector<int64_t>& begin, int rank);

/// Builds this rank's part of a model from its piece, whose points and elements it takes, with the
/// counts and normals of the whole.
/// Rows of contact are those of the piece's pairs. Collective.
LocalModel build_part(MPI_Comm comm, Piece& piece);

}  // namespace repose::discrete
