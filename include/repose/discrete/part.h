#pragma once
#include <mpi.h>

#include <cstdint>
#include <vector>

#include "repose/mechanics/rigid_body.h"
#include "repose/model/build.h"
#include "repose/model/model.h"

/// Distribution of a model over ranks: columns are the unit, nothing is ever added across ranks.
namespace repose::discrete {

/// Unknown points of a model, each a block of three unknowns, numbered rank after rank.
struct UnknownBlocks {
  int64_t first = 0, owned = 0;  ///< first block of this rank, and how many it owns
  int64_t total = 0;             ///< of all ranks
  bool operator==(const UnknownBlocks&) const = default;
};

/// Part of a model on one rank. `model` is a model in local numbers: the points of its own columns
/// come first, column after column, then ghosts; springs, edges and prisms whose first point it
/// owns come first (they count in energies and are written here), then those that merely touch a
/// soft-tissue point it owns, and of a solid the other prisms around its points and, where volumes
/// are averaged around points, around those of its prisms. Bones that do not move rigidly appear as
/// held points.
struct Part {
  model::Model model;
  bool solid = false;  ///< the whole model is one, whatever is here
  /// The whole model has contact. What `model` has of it are points that this rank owns; the sides
  /// of cuts are all on one rank.
  bool contact = false;
  std::vector<mechanics::RigidBody> bodies;  ///< [model.contact.bodies], on every rank
  /// [bodies] triangles of each body at load 0, on every rank; empty for closed forms.
  std::vector<surface::Surface> body_meshes;
  int64_t owned_points = 0, owned_springs = 0, owned_prisms = 0, owned_edges = 0;
  std::vector<int64_t> point_row;   ///< [local points] row in the whole model
  std::vector<int64_t> spring_row;  ///< [owned_springs]
  std::vector<int64_t> prism_row;   ///< [owned_prisms]
  std::vector<int64_t> edge_row;    ///< [owned_edges]
  std::vector<int64_t> pair_row;    ///< [pairs of the contact]
  /// [owned points] as in the whole model, where bones that do not move rigidly have bone points.
  std::vector<model::PointSet> original_set;
  std::vector<int64_t> unknown;  ///< [local points] block number of its unknowns, −1 if fixed
  UnknownBlocks unknowns;
  int64_t total_points = 0, total_springs = 0, total_prisms = 0;
};

/// A rank's part of a model, and global numbers of it.
struct LocalModel {
  Part part;
  /// The model without points, springs, prisms, edges and contact's pairs, on rank 0.
  model::Model global_metadata;
  model::Counts counts;          ///< of the whole model, on all ranks
  int64_t contact_pairs = 0;     ///< rows of contact of the whole model
  std::vector<Vec3> outward;     ///< [this rank's slab of points] outward_normals()
  double effective_modulus = 0;  ///< N/mm², on rank 0, of a scene's model
};

/// Builds the parts of a model by a graph partition of its columns (PT-Scotch through
/// MatPartitioning). Points, springs, prisms and edges lie on the ranks in any consecutive rows, in
/// order of the ranks; rank 0 alone may have them all, and has all else. Contact's pairs of points
/// that are not free to move are left out: they have no effect. Takes `rows`. InputError.
/// Collective.
LocalModel build_local(MPI_Comm comm, model::Model&& rows);
/// Builds the parts of a model that rank 0 has; what other ranks pass is not read. Collective.
LocalModel build_local_from_root(MPI_Comm comm, model::Model model);

/// Builds the parts of a scene's model, equal to those of a model that rank 0 builds: rank 0, which
/// alone has the `geometry`, gives every rank the columns that it owns and those around them, and
/// the rank makes the model of these. `scene` is read on all ranks; its moves are rank 0's.
/// `balanced` is the same model without the incisions that its tension opens, in its initial
/// equilibrium; null where there are none. Throws InputError. Collective.
LocalModel build_local(MPI_Comm comm, const model::ColumnGeometry* geometry, scene::Scene scene,
                       const LocalModel* balanced = nullptr);

}  // namespace repose::discrete
