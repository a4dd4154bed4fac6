#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

/// Finds runs in any graph, in time proportional to its elements.
namespace repose::mechanics {

/// Elements in the order in which a loop stores them.
struct Arrangement {
  std::vector<int64_t> order;    ///< [M] rows: those in runs, run after run, then the others
  std::vector<int32_t> lengths;  ///< [runs] elements of each run
  int64_t in_runs() const { return std::accumulate(lengths.begin(), lengths.end(), int64_t{0}); }
};

/// What a run may be.
struct RunLimits {
  int most;        ///< elements
  int64_t points;  ///< of the model
};

/// Numbers 0 … keys.size() − 1 ordered by key, equal ones as they were; keys are below `end`.
std::vector<int64_t> ordered_by(const std::vector<int64_t>& keys, int64_t end);

namespace detail {

/// Where the elements are that begin with a point.
struct ByFirstPoint {
  std::vector<int64_t> order, begin;
  template <size_t n>
  ByFirstPoint(std::span<const std::array<int32_t, n>> elements, int64_t points)
      : begin(points + 1, 0) {
    std::vector<int64_t> first;
    for (const auto& element : elements) {
      first.push_back(element[0]);
      ++begin[element[0] + 1];
    }
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    order = ordered_by(first, points);
  }
};

/// For each element the one that continues its run, −1 for none; nobody continues two.
template <size_t n>
std::vector<int64_t> followers(std::span<const std::array<int32_t, n>> elements, int64_t points) {
  const ByFirstPoint at(elements, points);
  std::vector<int64_t> next(elements.size(), -1);
  std::vector<bool> taken(elements.size(), false);
  for (size_t e = 0; e < elements.size(); ++e) {
    std::array<int32_t, n> wanted = elements[e];
    for (int32_t& point : wanted) ++point;
    if (wanted[0] >= points) continue;
    for (int64_t k = at.begin[wanted[0]]; k < at.begin[wanted[0] + 1]; ++k) {
      const int64_t f = at.order[k];
      if (taken[f] || elements[f] != wanted) continue;
      next[e] = f;
      taken[f] = true;
      break;
    }
  }
  return next;
}

/// Pieces of chains of elements, one after the other.
struct Pieces {
  std::vector<int64_t> rows, begin = {0};
  int64_t count() const { return static_cast<int64_t>(begin.size()) - 1; }
  int64_t length(int64_t piece) const { return begin[piece + 1] - begin[piece]; }
  void close() {
    if (static_cast<int64_t>(rows.size()) > begin.back())
      begin.push_back(static_cast<int64_t>(rows.size()));
  }
};

template <size_t n>
Pieces cut_chains(std::span<const std::array<int32_t, n>> elements, const RunLimits& limits) {
  const std::vector<int64_t> next = followers(elements, limits.points);
  std::vector<bool> follows(elements.size(), false);
  for (const int64_t f : next)
    if (f >= 0) follows[f] = true;
  Pieces pieces;
  for (size_t e = 0; e < elements.size(); ++e) {
    if (follows[e]) continue;
    for (int64_t f = static_cast<int64_t>(e); f >= 0; f = next[f]) {
      pieces.rows.push_back(f);
      if (static_cast<int64_t>(pieces.rows.size()) - pieces.begin.back() == limits.most)
        pieces.close();
    }
    pieces.close();
  }
  return pieces;
}

/// Where a piece comes in memory: by blocks of points that fit into the cache together, and within
/// a block those that go up in numbers before those that go down, because the two diagonals of a
/// quad write to the same points, one place apart, which stalls them when they meet.
template <size_t n>
int64_t place(const std::array<int32_t, n>& element) {
  constexpr int64_t points_in_block = 1024;
  const int64_t first = *std::min_element(element.begin(), element.end());
  return first / points_in_block * 2 + (element[0] > element[1]);
}

}  // namespace detail

/// Runs of at least two elements of which `allowed(element)` holds; what is in none comes last.
template <size_t n, class Allowed>
Arrangement arrange(std::span<const std::array<int32_t, n>> elements, const RunLimits& limits,
                    Allowed&& allowed) {
  constexpr int readable = 4;  // points and elements from the first of a run on
  const detail::Pieces pieces = detail::cut_chains(elements, limits);
  std::vector<int64_t> keys;
  for (int64_t k = 0; k < pieces.count(); ++k)
    keys.push_back(detail::place(elements[pieces.rows[pieces.begin[k]]]));
  Arrangement made;
  std::vector<int64_t> others;
  for (const int64_t k : ordered_by(keys, 2 * (limits.points / 1024 + 1))) {
    const auto first = pieces.rows.begin() + pieces.begin[k], last = first + pieces.length(k);
    const auto& element = elements[*first];
    const bool fits = *std::max_element(element.begin(), element.end()) + readable <= limits.points;
    const bool run = pieces.length(k) > 1 && fits && allowed(element);
    auto& rows = run ? made.order : others;
    rows.insert(rows.end(), first, last);
    if (run) made.lengths.push_back(static_cast<int32_t>(last - first));
  }
  made.order.insert(made.order.end(), others.begin(), others.end());
  int64_t in_runs = made.in_runs();
  const auto rows = static_cast<int64_t>(made.order.size());
  while (!made.lengths.empty() && in_runs - made.lengths.back() + readable > rows) {
    in_runs -= made.lengths.back();
    made.lengths.pop_back();
  }
  return made;
}

}  // namespace repose::mechanics
