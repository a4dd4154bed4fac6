#include "by_column.h"

#include <numeric>

#include "exchange.h"

namespace repose::discrete {

ColumnRows rows_by_column(MPI_Comm comm, int64_t columns, const std::vector<int64_t>& column,
                          const std::vector<char>& owned) {
  std::vector<int64_t> known, own, count;
  for (size_t i = 0; i < column.size(); ++i) {
    const int64_t c = column[i];
    if (known.empty() || known.back() != c) known.push_back(c);
    if (!owned[i]) continue;
    if (own.empty() || own.back() != c) own.push_back(c), count.push_back(0);
    ++count.back();
  }
  std::vector<int64_t> first = gather_by_column(comm, columns + 1, own, count);
  if (base::rank(comm) == 0) std::exclusive_scan(first.begin(), first.end(), first.begin(), 0L);
  const std::vector<int64_t> begin = Exchange::fetch(comm, known, std::ssize(first))(first);
  ColumnRows rows;
  if (base::rank(comm) == 0) rows.total = first.back();
  base::broadcast(comm, rows.total);
  size_t k = 0;
  int64_t next = 0;
  for (const int64_t c : column) {
    if (known[k] != c) ++k, next = 0;
    rows.row.push_back(begin[k] + next++);
  }
  return rows;
}

}  // namespace repose::discrete
