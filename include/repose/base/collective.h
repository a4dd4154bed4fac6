#pragma once
#include <mpi.h>

#include <concepts>
#include <cstdint>
#include <string>
#include <vector>

#include "repose/base/geometry.h"

/// Values of all ranks combined, and passed from rank to rank. Functions of a communicator are
/// collective but for rank() and size().
namespace repose::base {

int rank(MPI_Comm comm);
int size(MPI_Comm comm);

/// The part [begin, end) of n rows that a rank holds in natural order; sizes differ by at most one.
struct Slab {
  int64_t begin, end;
  int64_t rows() const { return end - begin; }
};
Slab slab(int64_t n, int rank, int size);

/// Returns whether a statement holds on any rank, or on all.
bool on_any_rank(MPI_Comm comm, bool here);
bool on_all_ranks(MPI_Comm comm, bool here);

/// Returns the largest of the ranks' values.
double max_over_ranks(MPI_Comm comm, double value);
int64_t max_over_ranks(MPI_Comm comm, std::integral auto value) {
  int64_t largest = static_cast<int64_t>(value);
  MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_INT64_T, MPI_MAX, comm);
  return largest;
}
/// Returns the sum of the ranks' values.
double sum_over_ranks(MPI_Comm comm, double value);
int64_t sum_over_ranks(MPI_Comm comm, std::integral auto value) {
  int64_t sum = static_cast<int64_t>(value);
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_INT64_T, MPI_SUM, comm);
  return sum;
}
/// Returns the sum of the counts of the ranks before this one.
int64_t count_before(MPI_Comm comm, size_t count);

/// A rank's value.
struct RankValue {
  double value;
  int rank;
};
/// Returns the largest (MPI_MAXLOC) or smallest (MPI_MINLOC) of the ranks' values, of the lowest
/// rank that has it.
RankValue extreme_over_ranks(MPI_Comm comm, double value, MPI_Op op);

/// Copies values, vectors and texts from one rank to another, or to all; nothing on other ranks.
/// Elements are trivially copyable, or of fixed size and Eigen's. The ranks that take part call it
/// with the same types in the same order.
class Message {
 public:
  static constexpr int all_ranks = -1;
  Message(MPI_Comm comm, int from, int to = all_ranks);
  template <class... T>
  void operator()(T&... values) const {
    (copy(values), ...);
  }

 private:
  void copy_bytes(void* data, size_t size) const;
  template <class T>
  void copy(T& value) const {
    if constexpr (requires { value.push_back(value[0]); }) {
      auto count = static_cast<int64_t>(value.size());
      copy(count);
      value.resize(count);
      copy_bytes(value.data(), value.size() * sizeof value[0]);
    } else {
      copy_bytes(&value, sizeof value);
    }
  }
  MPI_Comm comm_;
  int from_, to_, rank_;
};

/// Gives rank 0's values to all ranks.
template <class... T>
void broadcast(MPI_Comm comm, T&... values) {
  Message(comm, 0)(values...);
}

/// Returns the largest of the ranks' values, and gives all ranks what the rank has that has it.
template <class... T>
double max_over_ranks_with(MPI_Comm comm, double value, T&... of_rank) {
  const RankValue largest = extreme_over_ranks(comm, value, MPI_MAXLOC);
  Message(comm, largest.rank)(of_rank...);
  return largest.value;
}

/// Returns the arrays of all ranks one after the other, on rank 0; empty on the others.
template <class T>
std::vector<T> gather(MPI_Comm comm, std::vector<T> mine) {
  for (int from = 1; from < size(comm); ++from) {
    std::vector<T> theirs;
    if (rank(comm) == from) theirs.swap(mine);
    Message(comm, from, 0)(theirs);
    if (rank(comm) == 0) mine.insert(mine.end(), theirs.begin(), theirs.end());
  }
  return mine;
}

/// Rows that rank 0 holds, as a slab on every rank.
template <class T>
std::vector<T> scatter(MPI_Comm comm, const std::vector<T>& all) {
  auto total = static_cast<int64_t>(all.size());
  broadcast(comm, total);
  std::vector<T> rows;
  for (int to = size(comm) - 1; to >= 0; --to) {
    const Slab theirs = slab(total, to, size(comm));
    if (rank(comm) == 0) rows.assign(all.begin() + theirs.begin, all.begin() + theirs.end);
    Message(comm, 0, to)(rows);
  }
  return rows;
}

}  // namespace repose::base
