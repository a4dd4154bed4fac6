#include "repose/linear/column_level.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstring>

namespace repose::linear {

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

}  // namespace

ColumnLevel::ColumnLevel(IndexMap points, std::vector<Place> place, BlockPattern pattern)
    : points_(std::move(points)),
      place_(std::move(place)),
      pattern_(std::move(pattern)),
      diagonal_(find_columns()),
      order_(points_, pattern_, columns_),
      numbers_{std::vector<Eigen::Matrix3f>(pattern_.column.size() + 1, Eigen::Matrix3f::Zero()),
               std::vector<float>(place_.size()), std::vector<float>(9 * place_.size() + 1)} {}

std::vector<int64_t> ColumnLevel::find_columns() {
  std::vector<int64_t> diagonal;
  for (int32_t i = 0; i < own(); ++i) {
    const int64_t k = pattern_.find(i, i);
    diagonal.push_back(k);
    const bool goes_on = i > 0 && place_[i].column == place_[i - 1].column &&
                         place_[i].layer - 1 == place_[i - 1].layer && k > pattern_.begin[i] &&
                         pattern_.column[k - 1] == i - 1;
    if (!goes_on) columns_.push_back(i);
  }
  columns_.push_back(own());
  return diagonal;
}

void ColumnLevel::add_upper(int32_t row, int32_t column, const Eigen::Matrix3f& block) {
  int64_t place = diagonal(row);  // counted all the way: a search's branches take longer
  for (int64_t k = diagonal(row); k < pattern_.begin[row + 1]; ++k)
    place += pattern_.column[k] < column;
  numbers_.block[place] += block;
}

void ColumnLevel::mirror_upper() {
  std::vector<int64_t> next(pattern_.begin.begin(), pattern_.begin.end() - 1);
  for (int32_t i = 0; i < own(); ++i)
    for (int64_t k = diagonal(i); k < pattern_.begin[i + 1]; ++k) {
      Eigen::Matrix3f& block = numbers_.block[k];
      if (!std::isnormal(block.cwiseAbs().maxCoeff())) block.setZero();
      const int32_t j = pattern_.column[k];
      if (j > i && j < own()) numbers_.block[next[j]++] = block.transpose();
    }
}

void ColumnLevel::add(int32_t row, int32_t column, const Eigen::Matrix3f& block) {
  numbers_.block[pattern_.find(row, column)] += block;
  if (row != column) numbers_.block[pattern_.find(column, row)] += block.transpose();
}

void ColumnLevel::factor_column(int32_t c) {
  constexpr float lift = 1e-4f;  // of the mean diagonal: semidefinite columns become definite
  Mat3 above = Mat3::Zero();     // inverse of what elimination left of the point above
  for (int32_t i = columns_[c]; i < columns_[c + 1]; ++i) {
    Mat3 pivot = block(diagonal(i)).cast<double>();
    const auto stiffness = static_cast<float>(pivot.trace() / 3);
    numbers_.lift[i] = stiffness > 0 ? lift * stiffness : 1.0f;
    if (i > columns_[c]) {
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
  for (int32_t c = 0; c + 1 < std::ssize(columns_); ++c) factor_column(c);
}

void ColumnLevel::factor(std::span<const int32_t> points) {
  std::ptrdiff_t last = -1;
  for (const int32_t point : points) {
    const auto column = std::ranges::upper_bound(columns_, point) - columns_.begin() - 1;
    if (column != last) factor_column(static_cast<int32_t>(column));
    last = column;
  }
}

Lanes ColumnLevel::row_product(int64_t k, int64_t end, std::span<const Lanes> x) const {
  Lanes sum{};
  for (; k < end; ++k) sum += times(block(k).data(), x[pattern_.column[k]]);
  return sum;
}

void ColumnLevel::solve_column(int32_t c, std::span<Lanes> x) const {
  const int32_t begin = columns_[c], end = columns_[c + 1];
  const float* const inverse = numbers_.inverse.data();
  for (int32_t i = begin; i < end; ++i) {
    if (i > begin) x[i] -= times(block(diagonal(i) - 1).data(), x[i - 1]);
    x[i] = times(inverse + int64_t{9} * i, x[i]);
  }
  for (int32_t i = end - 2; i >= begin; --i)
    x[i] -= times(inverse + int64_t{9} * i, times(block(diagonal(i) + 1).data(), x[i + 1]));
}

Lanes ColumnLevel::residual_around(int32_t c, int32_t i, std::span<const Lanes> b,
                                   std::span<const Lanes> x) const {
  return b[i] - row_product(pattern_.begin[i], left_end(c, i), x) -
         row_product(right_begin(c, i), pattern_.begin[i + 1], x);
}

void ColumnLevel::forward(std::span<const Lanes> b, std::span<Lanes> x) const {
  if (ghosts() > 0) std::ranges::fill(x, Lanes{});
  const auto sweep = [&](int32_t c) {
    for (int32_t i = columns_[c]; i < columns_[c + 1]; ++i)
      x[i] = order_.beside_border(c) ? residual_around(c, i, b, x)
                                     : b[i] - row_product(pattern_.begin[i], left_end(c, i), x);
    solve_column(c, x);
  };
  order_.forward(sweep, [&] { update_ghosts(x); });
}

void ColumnLevel::residual_of_forward(std::span<const Lanes> b, std::span<const Lanes> x,
                                      std::span<Lanes> r) const {
  for (int32_t c = 0; c + 1 < std::ssize(columns_); ++c)
    for (int32_t i = columns_[c]; i < columns_[c + 1]; ++i) {
      const int64_t end = pattern_.begin[i + 1];
      r[i] = order_.beside_border(c)
                 ? b[i] - row_product(pattern_.begin[i], end, x)
                 : numbers_.lift[i] * x[i] - row_product(right_begin(c, i), end, x);
    }
}

void ColumnLevel::backward(std::span<const Lanes> b, std::span<Lanes> x) const {
  const auto sweep = [&](int32_t c) {
    for (int32_t i = columns_[c]; i < columns_[c + 1]; ++i)
      x[i] = numbers_.lift[i] * x[i] + residual_around(c, i, b, x);
    solve_column(c, x);
  };
  order_.backward(sweep, [&] { update_ghosts(x); });
}

}  // namespace repose::linear
