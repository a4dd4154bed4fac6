#include "repose/base/collective.h"

#include <algorithm>

namespace repose::base {

int rank(MPI_Comm comm) {
  int r = 0;
  MPI_Comm_rank(comm, &r);
  return r;
}

int size(MPI_Comm comm) {
  int s = 1;
  MPI_Comm_size(comm, &s);
  return s;
}

Slab slab(int64_t n, int rank, int size) {
  const int64_t share = n / size, extra = n % size;
  const int64_t begin = rank * share + std::min<int64_t>(rank, extra);
  return {begin, begin + share + (rank < extra ? 1 : 0)};
}

bool on_any_rank(MPI_Comm comm, bool here) {
  MPI_Allreduce(MPI_IN_PLACE, &here, 1, MPI_C_BOOL, MPI_LOR, comm);
  return here;
}

bool on_all_ranks(MPI_Comm comm, bool here) { return !on_any_rank(comm, !here); }

double max_over_ranks(MPI_Comm comm, double value) {
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_MAX, comm);
  return value;
}

double sum_over_ranks(MPI_Comm comm, double value) {
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_SUM, comm);
  return value;
}

int64_t count_before(MPI_Comm comm, size_t count) {
  auto mine = static_cast<int64_t>(count), end = mine;
  MPI_Scan(&mine, &end, 1, MPI_INT64_T, MPI_SUM, comm);
  return end - mine;
}

RankValue extreme_over_ranks(MPI_Comm comm, double value, MPI_Op op) {
  RankValue extreme{value, rank(comm)};
  MPI_Allreduce(MPI_IN_PLACE, &extreme, 1, MPI_DOUBLE_INT, op, comm);
  return extreme;
}

Message::Message(MPI_Comm comm, int from, int to)
    : comm_(comm), from_(from), to_(to), rank_(rank(comm)) {}

void Message::copy_bytes(void* data, size_t size) const {
  constexpr size_t maximum = size_t{1} << 30;  // what fits MPI's int counts
  for (size_t at = 0; at < size && from_ != to_; at += maximum) {
    char* const piece = static_cast<char*>(data) + at;
    const int length = static_cast<int>(std::min(maximum, size - at));
    if (to_ == all_ranks)
      MPI_Bcast(piece, length, MPI_BYTE, from_, comm_);
    else if (rank_ == from_)
      MPI_Send(piece, length, MPI_BYTE, to_, 0, comm_);
    else if (rank_ == to_)
      MPI_Recv(piece, length, MPI_BYTE, from_, 0, comm_, MPI_STATUS_IGNORE);
  }
}

}  // namespace repose::base
