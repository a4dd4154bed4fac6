#include "repose/linear/column_level.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <random>

namespace repose {
namespace column_level_test {

using linear::Lanes;

std::mt19937 engine(3);

float random_number() { return std::uniform_real_distribution<float>(-1, 1)(engine); }

/// A positive definite matrix of five columns of three points, each point coupled to some of the
/// others' at random.
struct Level {
  static constexpr int32_t points = 15;
  linear::ColumnLevel level;
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(3 * points, 3 * points);

  Level() : level({PETSC_COMM_SELF, points, {}}, place(), pattern()) {
    engine.seed(3);
    for (int32_t i = 0; i < points; ++i)
      for (int64_t k = level.diagonal(i); k < level.pattern().begin[i + 1]; ++k) {
        const int32_t j = level.pattern().column[k];
        Eigen::Matrix3f block = Eigen::Matrix3f::NullaryExpr([] { return random_number(); });
        if (i == j) block = (block * block.transpose() + 12 * Eigen::Matrix3f::Identity()).eval();
        level.add_upper(i, j, 0.25f * block);
        level.add_upper(i, j, 0.75f * block);
      }
    level.mirror_upper();
    level.factor();
    for (int32_t i = 0; i < points; ++i)
      for (int64_t k = level.pattern().begin[i]; k < level.pattern().begin[i + 1]; ++k)
        matrix.block<3, 3>(3 * i, 3 * level.pattern().column[k]) = level.block(k).cast<double>();
  }

  static std::vector<linear::Place> place() {
    std::vector<linear::Place> all;
    for (int32_t i = 0; i < points; ++i) all.push_back({i / 3, i % 3});
    return all;
  }
  static linear::BlockPattern pattern() {
    const auto coupled = [](int i, int j) {
      const bool near = i / 3 == j / 3 && std::abs(i - j) < 2;
      return near || (i / 3 != j / 3 && (i * j) % 4 < 2);
    };
    linear::BlockPattern pattern;
    for (int i = 0; i < points; ++i) {
      for (int j = 0; j < points; ++j)
        if (coupled(i, j)) pattern.column.push_back(j);
      pattern.begin.push_back(static_cast<int64_t>(pattern.column.size()));
    }
    return pattern;
  }
};

using Vector = Eigen::VectorXd;

std::vector<Lanes> lanes(const Vector& vector) {
  std::vector<Lanes> all(vector.size() / 3);
  for (Eigen::Index i = 0; i < vector.size(); ++i)
    all[i / 3][i % 3] = static_cast<float>(vector[i]);
  return all;
}

Vector vector(const std::vector<Lanes>& lanes) {
  Vector all(3 * lanes.size());
  for (Eigen::Index i = 0; i < all.size(); ++i) all[i] = lanes[i / 3][i % 3];
  return all;
}

class SweepsOfALevel : public ::testing::Test {
 protected:
  Level s_;
  const Vector some_ = Vector::LinSpaced(3 * Level::points, -1, 2).array().sin();
};

TEST_F(SweepsOfALevel, MatrixIsSymmetric) { EXPECT_EQ(s_.matrix, s_.matrix.transpose()); }

TEST_F(SweepsOfALevel, ForwardSolvesWithTheLowerPart) {
  std::vector<Lanes> x(Level::points);
  s_.level.forward(lanes(some_), x);
  Eigen::MatrixXd lower = s_.matrix;
  for (int32_t i = 0; i < Level::points; ++i)
    for (int32_t j = i + 1; j < Level::points; ++j)
      if (i / 3 != j / 3) lower.block<3, 3>(3 * i, 3 * j).setZero();
  constexpr double lift = 2e-4;  // of the diagonal, and what single precision leaves
  EXPECT_LT((lower * vector(x) - some_).norm(), lift * some_.norm());
}

TEST_F(SweepsOfALevel, ResidualIsWhatForwardLeaves) {
  std::vector<Lanes> x(Level::points), r = x;
  s_.level.forward(lanes(some_), x);
  s_.level.residual_of_forward(lanes(some_), x, r);
  EXPECT_LT((some_ - s_.matrix * vector(x) - vector(r)).norm(), 1e-5 * some_.norm());
}

TEST_F(SweepsOfALevel, BackwardKeepsTheSolution) {
  std::vector<Lanes> x = lanes(some_);
  s_.level.backward(lanes(s_.matrix * some_), x);
  EXPECT_LT((vector(x) - some_).norm(), 1e-5 * some_.norm());
}

TEST_F(SweepsOfALevel, BackwardIsForwardTransposed) {
  const Vector other = some_.reverse();
  std::vector<Lanes> down(Level::points), up = down;
  s_.level.forward(lanes(some_), down);
  s_.level.backward(lanes(other), up);
  EXPECT_NEAR(other.dot(vector(down)), some_.dot(vector(up)), 1e-5);
}

/// Each rank owns one point more than the rank before it, and its ghost is the next rank's first.
TEST(IndexMap, GhostsAreNumberedAndShared) {
  int rank = 0, ranks = 1;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  const int next = (rank + 1) % ranks;
  const int64_t ghost = next * (next + 1) / 2;
  const linear::IndexMap map(PETSC_COMM_WORLD, rank + 1, {ghost});
  EXPECT_EQ(map.first(), rank * (rank + 1) / 2);
  EXPECT_EQ(map.total(), ranks * (ranks + 1) / 2);
  EXPECT_EQ(map.global(rank), map.first() + rank);
  EXPECT_EQ(map.global(rank + 1), ghost);
  EXPECT_EQ(map.local(map.first()), 0);
  EXPECT_EQ(map.local(ghost), ranks > 1 ? rank + 1 : 0);
  const std::vector<float> own(rank + 1, static_cast<float>(rank));
  float received = static_cast<float>(next);  // stays on one rank, which shares nothing
  map.share(own.data(), &received, linear::FloatsType(1));
  EXPECT_EQ(received, static_cast<float>(next));
  std::array<int, 2> colors = {map.color(), -1};
  MPI_Allreduce(colors.data(), &colors[1], 1, MPI_INT, MPI_MAX, PETSC_COMM_WORLD);
  EXPECT_EQ(colors[1] + 1, map.colors());
}

/// Column 0 of two points is coupled to column 1, which is coupled to a ghost; column 2 is alone.
TEST(SweepOrder, BorderIsSweptFirstAndLastInReverse) {
  const linear::IndexMap points(PETSC_COMM_SELF, 4, {4});
  const linear::BlockPattern pattern{{0, 2, 5, 8, 9}, {0, 1, 0, 1, 2, 1, 2, 4, 3}};
  const linear::SweepOrder order(points, pattern, std::array{0, 2, 3, 4});
  std::vector<int32_t> down, up;
  order.forward([&](int32_t column) { down.push_back(column); }, [] {});
  order.backward([&](int32_t column) { up.push_back(column); }, [] {});
  EXPECT_EQ(down, (std::vector{1, 0, 2}));
  EXPECT_EQ(up, (std::vector{2, 0, 1}));
  EXPECT_TRUE(order.beside_border(0) && order.beside_border(1) && !order.beside_border(2));
}

/// Two columns of one point on each rank, all coupled as strongly as a column to itself, nearly:
/// where ranks swept at once, each would take away the whole residual.
TEST(ColumnLevel, NeighboringRanksSweepInTurn) {
  constexpr int32_t own = 2;
  constexpr float weak = 0.01f;
  int rank = 0, ranks = 1;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  const int32_t all = own * ranks;
  std::vector<int64_t> ghost;
  for (int32_t g = 0; g < all; ++g)
    if (g / own != rank) ghost.push_back(g);
  linear::BlockPattern pattern;
  for (int32_t i = 0; i < own; ++i) {
    for (int32_t j = 0; j < all; ++j) pattern.column.push_back(j);
    pattern.begin.push_back(static_cast<int64_t>(pattern.column.size()));
  }
  linear::ColumnLevel level({PETSC_COMM_WORLD, own, ghost}, {{0, 0}, {1, 0}}, pattern);
  for (int32_t i = 0; i < own; ++i)
    for (int32_t j = i; j < all; ++j)
      level.add_upper(i, j, (i == j ? 1 + weak : 1.0f) * Eigen::Matrix3f::Identity());
  level.mirror_upper();
  level.factor();
  const std::vector<Lanes> none(all);
  std::vector<Lanes> x(all, Lanes{1, 1, 1});
  level.backward(none, x);
  std::array<double, 2> sum{};
  for (int32_t i = 0; i < own; ++i) sum = {sum[0] + x[i][0], sum[1] + x[i][0] * x[i][0]};
  MPI_Allreduce(MPI_IN_PLACE, sum.data(), 2, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  const double energy = sum[0] * sum[0] + weak * sum[1];
  EXPECT_LT(energy, 0.1 * all * all);

  const std::vector<Lanes> b(all, Lanes{1, 2, 3});
  std::vector<Lanes> r(all);
  level.forward(b, x);
  level.residual_of_forward(b, x, r);
  Lanes product{};
  for (const Lanes& value : x) product += value;
  for (int32_t i = 0; i < own; ++i)
    for (int d = 0; d < 3; ++d) EXPECT_NEAR(r[i][d], b[i][d] - product[d] - weak * x[i][d], 1e-4);
}

TEST(ColumnLevel, WhatIsNoNumberCouplesNothing) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  for (const float number : {1e-42f, infinity, std::nanf("")}) {
    linear::ColumnLevel level({PETSC_COMM_SELF, Level::points, {}}, Level::place(),
                              Level::pattern());
    level.add_upper(0, 1, Eigen::Matrix3f::Constant(number));
    level.mirror_upper();
    EXPECT_EQ(level.block(1), Eigen::Matrix3f::Zero());
  }
}

}  // namespace column_level_test
}  // namespace repose
