#include "repose/linear/column_level.h"

#include <gtest/gtest.h>

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

  Level() : level(PETSC_COMM_SELF, place(), {}, pattern()) {
    engine.seed(3);
    linear::UpperSums sums(level);
    for (int32_t i = 0; i < points; ++i)
      for (int64_t k = level.diagonal(i); k < level.pattern().begin[i + 1]; ++k) {
        const int32_t j = level.pattern().column[k];
        Eigen::Matrix3f block = Eigen::Matrix3f::NullaryExpr([] { return random_number(); });
        if (i == j) block = (block * block.transpose() + 12 * Eigen::Matrix3f::Identity()).eval();
        sums.add(i, j, 0.25f * block);
        sums.add(i, j, 0.75f * block);
      }
    level.fill(sums);
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
  s_.level.residual_of_forward(x, r);
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

TEST(ColumnLevel, WhatIsNoNumberCouplesNothing) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  for (const float number : {1e-42f, infinity, std::nanf("")}) {
    linear::ColumnLevel level(PETSC_COMM_SELF, Level::place(), {}, Level::pattern());
    linear::UpperSums sums(level);
    sums.add(0, 1, Eigen::Matrix3f::Constant(number));
    level.fill(sums);
    EXPECT_EQ(level.block(1), Eigen::Matrix3f::Zero());
  }
}

}  // namespace column_level_test
}  // namespace repose
