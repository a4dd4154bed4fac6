#pragma once
#include <mpi.h>

#include <bit>
#include <cstdint>
#include <numeric>
#include <vector>

namespace repose::discrete {

/// Sends rows of arrays from every rank to every rank.
class Exchange {
 public:
  /// `rows` [ranks] are those of this rank's arrays that each rank is to receive. Collective.
  Exchange(MPI_Comm comm, const std::vector<std::vector<int64_t>>& rows);
  /// Fetches `rows`, by the ranks that hold them, of arrays whose rows follow one another from rank
  /// to rank, of which this rank holds as many as `held`. Collective.
  static Exchange fetch(MPI_Comm comm, const std::vector<int64_t>& rows, int64_t held);

  /// Returns the received rows of an array, by sending ranks. Collective.
  template <class Array, class T = typename Array::value_type>
  std::vector<T> operator()(const Array& mine) const {
    std::vector<T> sent;
    sent.reserve(rows_.size());
    for (const int64_t row : rows_) sent.push_back(mine[row]);
    std::vector<T> received(std::accumulate(received_.begin(), received_.end(), size_t{0}));
    send_all(sent.data(), received.data(), sizeof(T));
    return received;
  }

 private:
  void send_all(const void* sent, void* received, size_t size) const;
  MPI_Comm comm_;
  std::vector<int64_t> rows_;         // that are sent, by receiving ranks
  std::vector<int> sent_, received_;  // [ranks] rows
};

/// Ascending rows of a list, and the place of each among them. Holds a quarter of a byte for each
/// row of the list.
class RowIndex {
 public:
  explicit RowIndex(int64_t total) : marks_(total / 64 + 1), before_(total / 64 + 1) {}
  void add(int64_t row) { marks_[row / 64] |= bit(row); }
  /// Returns the rows that were added, each once; to be called before place().
  std::vector<int64_t> sort();
  int64_t place(int64_t row) const {
    return before_[row / 64] + std::popcount(marks_[row / 64] & (bit(row) - 1));
  }

 private:
  static uint64_t bit(int64_t row) { return uint64_t{1} << (row % 64); }
  std::vector<uint64_t> marks_;
  std::vector<int64_t> before_;  // rows before those of each mark
};

}  // namespace repose::discrete
