#include "repose/solve/column_level.h"

#include <Eigen/LU>
#include <algorithm>
#include <cstring>

namespace repose::solve {

using base::check;

namespace {

using Mat3f = Eigen::Matrix3f;

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

FloatsType::FloatsType(int count) {
  MPI_Type_contiguous(count, MPI_FLOAT, &type_);
  MPI_Type_commit(&type_);
}

ColumnLevel::ColumnLevel(MPI_Comm comm, std::vector<Place> place, std::vector<int64_t> ghost,
                         BlockPattern pattern)
    : place_(std::move(place)),
      ghost_(std::move(ghost)),
      pattern_(std::move(pattern)),
      value_(9 * pattern_.column.size() + 1),
      damping_(place_.size()),
      inverse_(9 * place_.size() + 1) {
  find_columns();
  connect(comm);
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
  for (const int64_t number : ghost_) {
    const auto owner = std::upper_bound(first.begin(), first.end(), number) - first.begin() - 1;
    roots.push_back({static_cast<PetscInt>(owner), static_cast<PetscInt>(number - first[owner])});
  }
  check(PetscSFCreate(comm, forest_.out()));
  check(PetscSFSetGraph(forest_, own(), ghosts(), nullptr, PETSC_OWN_POINTER, roots.data(),
                        PETSC_COPY_VALUES));
}

void ColumnLevel::share(const void* own_entries, void* ghost_entries, MPI_Datatype unit) const {
  if (!forest_) return;
  check(PetscSFBcastBegin(forest_, unit, own_entries, ghost_entries, MPI_REPLACE));
  check(PetscSFBcastEnd(forest_, unit, own_entries, ghost_entries, MPI_REPLACE));
}

void ColumnLevel::clear() { std::fill(value_.begin(), value_.end(), 0.0f); }

void ColumnLevel::add(int32_t row, int32_t column, const Mat3& block) {
  const auto begin = pattern_.column.begin() + pattern_.begin[row];
  const auto at =
      std::lower_bound(begin, pattern_.column.begin() + pattern_.begin[row + 1], column);
  float* entry = this->block(at - pattern_.column.begin());
  for (int k = 0; k < 9; ++k) entry[k] += static_cast<float>(block.data()[k]);
}

void ColumnLevel::mirror() {
  std::vector<int64_t> next(pattern_.begin.begin(), pattern_.begin.end() - 1);
  for (int32_t row = 0; row < own(); ++row)
    for (int64_t k = pattern_.begin[row]; k < pattern_.begin[row + 1]; ++k) {
      const int32_t column = pattern_.column[k];
      if (column <= row || column >= own()) continue;
      Eigen::Map<Mat3f>(block(next[column]++)) = Eigen::Map<const Mat3f>(block(k)).transpose();
    }
}

void ColumnLevel::damp() {
  constexpr float lift = 1e-4f;  // of the mean diagonal: above what single precision rounds off
  for (int32_t i = 0; i < own(); ++i) {
    float stiffness = 0, beyond = 0;
    for (int64_t k = pattern_.begin[i]; k < pattern_.begin[i + 1]; ++k) {
      const Eigen::Map<const Mat3f> entries(block(k));
      if (pattern_.column[k] == i) stiffness = entries.trace() / 3;
      if (pattern_.column[k] >= own()) beyond += entries.norm();
    }
    damping_[i] = 0.5f * beyond + (stiffness > 0 ? lift * stiffness : 1.0f);
  }
}

void ColumnLevel::factor() {
  damp();
  for (size_t c = 0; c + 1 < chain_.size(); ++c) {
    Mat3 above = Mat3::Zero();  // inverse of what elimination left of the point above
    for (int32_t i = chain_[c]; i < chain_[c + 1]; ++i) {
      const bool first = i == chain_[c];
      const int64_t own_column = pattern_.begin[i] + left_[i];
      Mat3 pivot = Eigen::Map<const Mat3f>(block(own_column + !first)).cast<double>();
      if (!first) {
        const Mat3 link = Eigen::Map<const Mat3f>(block(own_column)).cast<double>();
        pivot -= link * above * link.transpose();
      }
      pivot += damping_[i] * Mat3::Identity();
      above = pivot.inverse();
      above = (0.5 * (above + above.transpose())).eval();
      Eigen::Map<Mat3f>(inverse_.data() + 9 * i) = above.cast<float>();
    }
  }
}

void ColumnLevel::solve_column(int32_t begin, int32_t end, std::span<Lanes> x) const {
  for (int32_t i = begin; i < end; ++i) {
    if (i > begin) x[i] -= times(block(pattern_.begin[i] + left_[i]), x[i - 1]);
    x[i] = times(inverse_.data() + 9 * i, x[i]);
  }
  for (int32_t i = end - 2; i >= begin; --i) {
    const int64_t below = pattern_.begin[i] + left_[i] + within_[i] - 1;
    x[i] -= times(inverse_.data() + 9 * i, times(block(below), x[i + 1]));
  }
}

void ColumnLevel::forward(std::span<const Lanes> b, std::span<Lanes> x) const {
  for (size_t c = 0; c + 1 < chain_.size(); ++c) {
    for (int32_t i = chain_[c]; i < chain_[c + 1]; ++i) {
      Lanes sum = b[i];
      const int64_t end = pattern_.begin[i] + left_[i];
      for (int64_t k = pattern_.begin[i]; k < end; ++k)
        sum -= times(block(k), x[pattern_.column[k]]);
      x[i] = sum;
    }
    solve_column(chain_[c], chain_[c + 1], x);
  }
}

void ColumnLevel::residual_of_forward(std::span<const Lanes> x, std::span<Lanes> r) const {
  for (int32_t i = 0; i < own(); ++i) {
    Lanes sum = damping_[i] * x[i];
    for (int64_t k = pattern_.begin[i] + left_[i] + within_[i]; k < pattern_.begin[i + 1]; ++k)
      sum -= times(block(k), x[pattern_.column[k]]);
    r[i] = sum;
  }
}

void ColumnLevel::backward(std::span<const Lanes> b, std::span<Lanes> x) const {
  for (size_t c = chain_.size() - 1; c-- > 0;) {
    for (int32_t i = chain_[c]; i < chain_[c + 1]; ++i) {
      Lanes sum = b[i] + damping_[i] * x[i];
      const int64_t column = pattern_.begin[i] + left_[i];
      for (int64_t k = pattern_.begin[i]; k < column; ++k)
        sum -= times(block(k), x[pattern_.column[k]]);
      for (int64_t k = column + within_[i]; k < pattern_.begin[i + 1]; ++k)
        sum -= times(block(k), x[pattern_.column[k]]);
      x[i] = sum;
    }
    solve_column(chain_[c], chain_[c + 1], x);
  }
}

}  // namespace repose::solve
