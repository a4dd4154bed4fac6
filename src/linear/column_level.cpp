#include "repose/linear/column_level.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstring>

namespace repose::linear {

using base::check;

namespace {

/// Four numbers from anywhere, the last of which belongs to what follows and is not used.
Lanes load(const float* numbers) {
  Lanes lanes;
  std::memcpy(&lanes, numbers, sizeof lanes);
  return lanes;
}

Lanes times(const float* block, Lanes x) {
  return load(block) * x[0] + load(block + 3) * x[1] + load(block + 6) * x[2];
}

/// [ranks] Numbers that differ between neighbors, as low as a greedy coloring finds them; `beside`
/// [ranks]: which are this rank's neighbors. Collective.
std::vector<int> find_turns(MPI_Comm comm, const std::vector<char>& beside) {
  const size_t ranks = beside.size();
  std::vector<char> coupled(ranks * ranks);
  MPI_Allgather(beside.data(), static_cast<int>(ranks), MPI_CHAR, coupled.data(),
                static_cast<int>(ranks), MPI_CHAR, comm);
  std::vector<int> turn;
  for (size_t r = 0; r < ranks; ++r) {
    std::vector<char> taken(ranks, 0);
    for (size_t s = 0; s < r; ++s)
      if (coupled[r * ranks + s] || coupled[s * ranks + r]) taken[turn[s]] = 1;
    turn.push_back(static_cast<int>(std::ranges::find(taken, 0) - taken.begin()));
  }
  return turn;
}

}  // namespace

FloatsType::FloatsType(int count) {
  MPI_Type_contiguous(count, MPI_FLOAT, &type_);
  MPI_Type_commit(&type_);
}

ColumnLevel::ColumnLevel(MPI_Comm comm, std::vector<Place> place, std::vector<int64_t> ghost,
                         BlockPattern pattern)
    : place_(std::move(place)),
      ghost_(std::move(ghost)),
      pattern_(std::move(pattern)),
      numbers_{std::vector<Eigen::Matrix3f>(pattern_.column.size() + 1),
               std::vector<float>(place_.size()), std::vector<float>(9 * place_.size() + 1)} {
  find_columns();
  connect(comm);
  find_border();
}

void ColumnLevel::find_columns() {
  const auto coupled = [&](int32_t row, int32_t column) {
    const auto begin = pattern_.column.begin() + pattern_.begin[row];
    return std::binary_search(begin, pattern_.column.begin() + pattern_.begin[row + 1], column);
  };
  for (int32_t i = 0; i < own(); ++i) {
    const bool goes_on = i > 0 && place_[i].column == place_[i - 1].column &&
                         place_[i].layer == place_[i - 1].layer + 1 && coupled(i, i - 1);
    if (!goes_on) chain_.push_back(i);
  }
  chain_.push_back(own());
  for (size_t c = 0; c + 1 < chain_.size(); ++c)
    for (int32_t i = chain_[c]; i < chain_[c + 1]; ++i) {
      const auto begin = pattern_.column.begin() + pattern_.begin[i],
                 end = pattern_.column.begin() + pattern_.begin[i + 1];
      const auto first = std::lower_bound(begin, end, chain_[c]);
      left_.push_back(static_cast<int32_t>(first - begin));
      within_.push_back(static_cast<int32_t>(std::lower_bound(first, end, chain_[c + 1]) - first));
      diagonal_.push_back(static_cast<int32_t>(std::lower_bound(first, end, i) - begin));
    }
}

void ColumnLevel::connect(MPI_Comm comm) {
  int ranks = 1;
  MPI_Comm_size(comm, &ranks);
  std::vector<int64_t> first(ranks + 1, 0);
  const int64_t mine = own();
  MPI_Allgather(&mine, 1, MPI_INT64_T, first.data() + 1, 1, MPI_INT64_T, comm);
  for (int r = 0; r < ranks; ++r) first[r + 1] += first[r];
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  first_ = first[rank];
  total_ = first[ranks];
  if (ranks == 1) return;
  std::vector<PetscSFNode> roots;
  std::vector<char> beside(ranks, 0);
  for (const int64_t number : ghost_) {
    const auto owner = std::upper_bound(first.begin(), first.end(), number) - first.begin() - 1;
    roots.push_back({static_cast<PetscInt>(owner), static_cast<PetscInt>(number - first[owner])});
    beside[owner] = 1;
  }
  const std::vector<int> turn = find_turns(comm, beside);
  turn_ = turn[rank];
  turns_ = 1 + *std::ranges::max_element(turn);
  check(PetscSFCreate(comm, forest_.out()));
  check(PetscSFSetGraph(forest_, own(), ghosts(), nullptr, PETSC_OWN_POINTER, roots.data(),
                        PETSC_COPY_VALUES));
}

void ColumnLevel::find_border() {
  const size_t columns = chain_.size() - 1;
  is_border_.assign(columns, 0);
  beside_.assign(columns, 0);
  std::vector<char> at_border(own() + ghosts(), 0);  // [points] ghosts, then columns of the border
  std::fill(at_border.begin() + own(), at_border.end(), 1);
  const auto is_beside = [&](size_t c) {
    return std::any_of(pattern_.column.begin() + pattern_.begin[chain_[c]],
                       pattern_.column.begin() + pattern_.begin[chain_[c + 1]],
                       [&](int32_t j) { return at_border[j] != 0; });
  };
  for (size_t c = columns; c-- > 0;)  // up the numbers, so that the others go down from the border
    if (is_beside(c)) border_.push_back(c);
  for (const size_t c : border_) {
    is_border_[c] = 1;
    std::fill(at_border.begin() + chain_[c], at_border.begin() + chain_[c + 1], 1);
  }
  for (size_t c = 0; c < columns; ++c) beside_[c] = is_beside(c);
}

void ColumnLevel::share(const void* own_entries, void* ghost_entries, MPI_Datatype unit) const {
  if (!forest_) return;
  check(PetscSFBcastBegin(forest_, unit, own_entries, ghost_entries, MPI_REPLACE));
  check(PetscSFBcastEnd(forest_, unit, own_entries, ghost_entries, MPI_REPLACE));
}

void ColumnLevel::fill(const UpperSums& sums) {
  std::vector<int64_t> next(pattern_.begin.begin(), pattern_.begin.end() - 1);
  for (int32_t i = 0; i < own(); ++i) {
    int64_t k = diagonal(i);
    for (const Eigen::Matrix3f& sum : sums.row(i)) {
      numbers_.block[k] = std::isnormal(sum.cwiseAbs().maxCoeff()) ? sum : Eigen::Matrix3f::Zero();
      const int32_t j = pattern_.column[k];
      if (j > i && j < own()) numbers_.block[next[j]++] = numbers_.block[k].transpose();
      ++k;
    }
  }
}

void ColumnLevel::add(int32_t row, int32_t column, const Eigen::Matrix3f& block) {
  const auto at = [&](int32_t i, int32_t j) -> Eigen::Matrix3f& {
    const auto begin = pattern_.column.begin() + pattern_.begin[i];
    return numbers_
        .block[std::lower_bound(begin, pattern_.column.begin() + pattern_.begin[i + 1], j) -
               pattern_.column.begin()];
  };
  at(row, column) += block;
  if (row != column) at(column, row) += block.transpose();
}

void ColumnLevel::factor_column(size_t c) {
  constexpr float lift = 1e-4f;  // of the mean diagonal: semidefinite columns become definite
  Mat3 above = Mat3::Zero();     // inverse of what elimination left of the point above
  for (int32_t i = chain_[c]; i < chain_[c + 1]; ++i) {
    Mat3 pivot = block(diagonal(i)).cast<double>();
    const auto stiffness = static_cast<float>(pivot.trace() / 3);
    numbers_.lift[i] = stiffness > 0 ? lift * stiffness : 1.0f;
    if (i > chain_[c]) {
      const Mat3 link = block(diagonal(i) - 1).cast<double>();
      pivot -= link * above * link.transpose();
    }
    pivot += numbers_.lift[i] * Mat3::Identity();
    above = pivot.inverse();
    above = (0.5 * (above + above.transpose())).eval();
    Eigen::Map<Eigen::Matrix3f>(numbers_.inverse.data() + int64_t{9} * i) = above.cast<float>();
  }
}

void ColumnLevel::factor() {
  for (size_t c = 0; c + 1 < chain_.size(); ++c) factor_column(c);
}

void ColumnLevel::factor(std::span<const int32_t> points) {
  auto last = chain_.end();
  for (const int32_t point : points) {
    const auto column = std::upper_bound(chain_.begin(), chain_.end(), point) - 1;
    if (column != last) factor_column(column - chain_.begin());
    last = column;
  }
}

Lanes ColumnLevel::row_product(int64_t k, int64_t end, std::span<const Lanes> x) const {
  Lanes sum{};
  for (; k < end; ++k) sum += times(numbers_.block[k].data(), x[pattern_.column[k]]);
  return sum;
}

void ColumnLevel::solve_column(int64_t column, std::span<Lanes> x) const {
  const int32_t begin = chain_[column], end = chain_[column + 1];
  for (int32_t i = begin; i < end; ++i) {
    const int64_t above = pattern_.begin[i] + left_[i];
    if (i > begin) x[i] -= row_product(above, above + 1, x);
    x[i] = times(numbers_.inverse.data() + int64_t{9} * i, x[i]);
  }
  for (int32_t i = end - 2; i >= begin; --i) {
    const int64_t right = pattern_.begin[i] + left_[i] + within_[i];
    x[i] -= times(numbers_.inverse.data() + int64_t{9} * i, row_product(right - 1, right, x));
  }
}

Lanes ColumnLevel::residual_around(int32_t i, std::span<const Lanes> b,
                                   std::span<const Lanes> x) const {
  const int64_t column = pattern_.begin[i] + left_[i];
  return b[i] - row_product(pattern_.begin[i], column, x) -
         row_product(column + within_[i], pattern_.begin[i + 1], x);
}

void ColumnLevel::forward(std::span<const Lanes> b, std::span<Lanes> x) const {
  if (turns_ > 1) std::fill(x.begin(), x.end(), Lanes{});
  const auto sweep = [&](size_t c) {
    for (int32_t i = chain_[c]; i < chain_[c + 1]; ++i)
      x[i] = beside_[c] ? residual_around(i, b, x)
                        : b[i] - row_product(pattern_.begin[i], pattern_.begin[i] + left_[i], x);
    solve_column(c, x);
  };
  for (int turn = 0; turn < turns_; ++turn) {
    if (turn == turn_) std::ranges::for_each(border_, sweep);
    update_ghosts(x);
  }
  for (size_t c = 0; c + 1 < chain_.size(); ++c)
    if (!is_border_[c]) sweep(c);
}

void ColumnLevel::residual_of_forward(std::span<const Lanes> b, std::span<const Lanes> x,
                                      std::span<Lanes> r) const {
  for (size_t c = 0; c + 1 < chain_.size(); ++c)
    for (int32_t i = chain_[c]; i < chain_[c + 1]; ++i) {
      const int64_t right = pattern_.begin[i] + left_[i] + within_[i];
      r[i] = beside_[c] ? b[i] - row_product(pattern_.begin[i], pattern_.begin[i + 1], x)
                        : numbers_.lift[i] * x[i] - row_product(right, pattern_.begin[i + 1], x);
    }
}

void ColumnLevel::backward_column(size_t c, std::span<const Lanes> b, std::span<Lanes> x) const {
  for (int32_t i = chain_[c]; i < chain_[c + 1]; ++i)
    x[i] = numbers_.lift[i] * x[i] + residual_around(i, b, x);
  solve_column(c, x);
}

void ColumnLevel::backward(std::span<const Lanes> b, std::span<Lanes> x) const {
  for (size_t c = chain_.size() - 1; c-- > 0;)
    if (!is_border_[c]) backward_column(c, b, x);
  for (int turn = turns_; turn-- > 0;) {
    if (turn == turn_)
      for (size_t k = border_.size(); k-- > 0;) backward_column(border_[k], b, x);
    if (turn > 0) update_ghosts(x);
  }
}

UpperSums::UpperSums(const ColumnLevel& level) : level_(level), begin_(level.own() + 1, 0) {
  for (int32_t i = 0; i < level.own(); ++i)
    begin_[i + 1] = begin_[i] + level.pattern().begin[i + 1] - level.diagonal(i);
  sum_.assign(begin_.back(), Eigen::Matrix3f::Zero());
}

void UpperSums::add(int32_t row, int32_t column, const Eigen::Matrix3f& block) {
  const int32_t* const columns = level_.pattern().column.data() + level_.diagonal(row);
  const int64_t count = begin_[row + 1] - begin_[row];
  int64_t before = 0;  // counted all the way: a search's branches take longer
  for (int64_t k = 0; k < count; ++k) before += columns[k] < column;
  sum_[begin_[row] + before] += block;
}

}  // namespace repose::linear
