#pragma once
#include <mpi.h>

#include <cstdint>
#include <vector>

#include "repose/base/collective.h"

namespace repose::discrete {

/// Rows in a list of the whole model that is sorted by column.
struct ColumnRows {
  std::vector<int64_t> row;
  int64_t total = 0;
};

/// Returns the global rows of items; `column` [items] is ascending. The items of a column count on
/// one rank, where they are `owned` [items], and may be known on others. O(all columns) on rank 0.
/// Collective.
ColumnRows rows_by_column(MPI_Comm comm, int64_t columns, const std::vector<int64_t>& column,
                          const std::vector<char>& owned);

/// [columns] on rank 0 the values of all ranks' own columns; collective.
template <class Value>
std::vector<Value> gather_by_column(MPI_Comm comm, int64_t columns, const std::vector<int64_t>& own,
                                    const std::vector<Value>& values) {
  const std::vector<int64_t> column = base::gather(comm, own);
  const std::vector<Value> value = base::gather(comm, values);
  std::vector<Value> all(base::rank(comm) == 0 ? columns : 0);
  for (size_t k = 0; k < column.size(); ++k) all[column[k]] = value[k];
  return all;
}

}  // namespace repose::discrete
