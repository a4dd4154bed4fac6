#include "exchange.h"

#include "repose/base/agreement.h"

namespace repose::discrete {

Exchange::Exchange(MPI_Comm comm, const std::vector<std::vector<int64_t>>& rows)
    : comm_(comm), received_(rows.size()) {
  for (const std::vector<int64_t>& to_rank : rows) {
    rows_.insert(rows_.end(), to_rank.begin(), to_rank.end());
    sent_.push_back(static_cast<int>(to_rank.size()));
  }
  MPI_Alltoall(sent_.data(), 1, MPI_INT, received_.data(), 1, MPI_INT, comm);
}

Exchange Exchange::fetch(MPI_Comm comm, const std::vector<int64_t>& rows, int64_t held) {
  std::vector<int64_t> end(base::size(comm));
  MPI_Allgather(&held, 1, MPI_INT64_T, end.data(), 1, MPI_INT64_T, comm);
  std::partial_sum(end.begin(), end.end(), end.begin());
  std::vector<std::vector<int64_t>> requests(end.size());
  size_t holder = 0;
  for (size_t k = 0; k < rows.size(); ++k) {
    while (rows[k] >= end[holder]) ++holder;
    requests[holder].push_back(static_cast<int64_t>(k));
  }
  const Exchange request(comm, requests);
  Exchange answer = request;
  answer.rows_ = request(rows);
  for (int64_t& row : answer.rows_) row -= end[base::rank(comm)] - held;
  answer.sent_.swap(answer.received_);
  return answer;
}

void Exchange::send_all(const void* sent, void* received, size_t size) const {
  std::vector<int> from(sent_.size()), to(sent_.size());
  std::exclusive_scan(sent_.begin(), sent_.end(), from.begin(), 0);
  std::exclusive_scan(received_.begin(), received_.end(), to.begin(), 0);
  MPI_Datatype row;
  MPI_Type_contiguous(static_cast<int>(size), MPI_BYTE, &row);
  MPI_Type_commit(&row);
  MPI_Alltoallv(sent, sent_.data(), from.data(), row, received, received_.data(), to.data(), row,
                comm_);
  MPI_Type_free(&row);
}

std::vector<int64_t> RowIndex::sort() {
  std::vector<int64_t> rows;
  for (size_t word = 0; word < marks_.size(); ++word) {
    before_[word] = static_cast<int64_t>(rows.size());
    for (uint64_t left = marks_[word]; left != 0; left &= left - 1)
      rows.push_back(static_cast<int64_t>(64 * word) + std::countr_zero(left));
  }
  return rows;
}

}  // namespace repose::discrete
