#pragma once
#include "repose/discrete/part.h"

namespace repose::discrete {

/// Columns given to a rank, and their place in the whole model.
struct RankColumns {
  model::Piece piece;
  std::vector<int> owner;        ///< [C] rank of each column
  std::vector<int64_t> place;    ///< [C] of its first point, as Piece::place
  std::vector<int64_t> unknown;  ///< [C] block number of its first unknown
  UnknownBlocks unknowns;
  int64_t layers = 0, columns = 0, triangles = 0, edges = 0;  ///< of the whole
  /// Cuts of the whole; those meet whose sides this rank holds.
  std::vector<model::Cut> cuts;
  std::vector<model::DoubledColumn> doubled;  ///< of the whole
};

/// Distributes the `geometry`, which rank 0 alone reads: to every rank its piece, and the bones; to
/// rank 0 the model's global metadata. Columns are shared out as by build_local() of a model.
/// Collective.
RankColumns distribute_columns(MPI_Comm comm, const model::ColumnGeometry* geometry,
                               model::Model& global_metadata, std::vector<surface::Surface>& bones);

}  // namespace repose::discrete
