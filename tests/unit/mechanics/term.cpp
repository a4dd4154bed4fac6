#include "repose/mechanics/term.h"

#include <gtest/gtest.h>

#include "repose/base/error.h"
#include "states.h"

/// Every energy term that is listed here: Taylor expansions with gradient and Hessian, and what its
/// loop makes of it.
namespace repose::mechanics {
namespace term_test {

/// A spring of no length to a place that stays.
struct Bed {
  static constexpr int points = 1, numbers = 4;
  template <class Number>
  static Number energy(const Corners<Number, points>& x, std::span<const double> n) {
    return n[3] / 2 * (x[0] - Vec3(n[0], n[1], n[2]).cast<Number>()).squaredNorm();
  }
};

/// The pressure times the volume between a triangle and the origin.
struct Pressure {
  static constexpr int points = 3, numbers = 1;
  template <class Number>
  static Number energy(const Corners<Number, points>& x, std::span<const double> n) {
    return n[0] / 6 * x[0].dot(x[1].cross(x[2]));
  }
};

/// A term that is neither convex nor a polynomial.
struct Chain {
  static constexpr int points = 3, numbers = 2;
  template <class Number>
  static Number energy(const Corners<Number, points>& x, std::span<const double> n) {
    const Number first = (x[1] - x[0]).squaredNorm(), second = (x[2] - x[1]).squaredNorm();
    return n[0] * sqrt(n[1] + first) - n[0] / 3 * log(n[1] + second) * first;
  }
};

using Energies = testing::Types<Bed, Pressure, Chain>;

template <class Energy>
class Terms : public ::testing::Test {
 protected:
  void SetUp() override {
    test::Random random(3);
    for (int p = 0; p < Energy::points; ++p) at_.push_back(2 * random.vector());
    for (int k = 0; k < Energy::numbers; ++k) numbers_.push_back(1.5 + random());
  }
  double value(const std::vector<Vec3>& x) const {
    Eigen::VectorXd unused;
    return term_.gradient(x, numbers_, unused);
  }
  std::vector<Vec3> moved(const Eigen::VectorXd& d, double h) const {
    std::vector<Vec3> x = at_;
    for (size_t p = 0; p < x.size(); ++p) x[p] += h * d.segment<3>(static_cast<long>(3 * p));
    return x;
  }
  DifferentiatedTerm<Energy> term_;
  std::vector<Vec3> at_;
  std::vector<double> numbers_;
};
TYPED_TEST_SUITE(Terms, Energies);

TYPED_TEST(Terms, TaylorRemaindersFallAsTheyShould) {
  const long n = 3 * TypeParam::points;
  Eigen::VectorXd gradient;
  const double here = this->term_.gradient(this->at_, this->numbers_, gradient);
  const Eigen::MatrixXd hessian = this->term_.hessian(this->at_, this->numbers_);
  EXPECT_LE((hessian - hessian.transpose()).norm(), 1e-12 * hessian.norm());
  Eigen::VectorXd d(n);
  test::Random random(11);
  for (double& x : d) x = random();
  const auto first = [&](double h) {
    return this->value(this->moved(d, h)) - here - h * gradient.dot(d);
  };
  const auto second = [&](double h) { return first(h) - h * h / 2 * d.dot(hessian * d); };
  const double h = 1.0 / 64, rounding = 1e-13 * (1 + std::abs(here));
  EXPECT_LE(std::abs(first(h / 2)), 0.3 * std::abs(first(h)) + rounding);
  EXPECT_LE(std::abs(second(h / 2)), 0.15 * std::abs(second(h)) + rounding);
}

TYPED_TEST(Terms, ItsLoopCountsWhatItOwnsAndShowsBlocksOfItsHessian) {
  add_term<TypeParam>("tried");
  model::Model m = test::layered_patch({});
  model::TermElements elements{"tried", TypeParam::points, TypeParam::numbers, {}, {}};
  for (const int64_t first : {1, 6}) {
    for (int64_t p = 0; p < TypeParam::points; ++p) elements.points.push_back(first + p);
    elements.numbers.insert(elements.numbers.end(), this->numbers_.begin(), this->numbers_.end());
  }
  for (model::PointSet& set : m.points.set) set = model::PointSet::soft_tissue;
  std::vector<Vec3> x = m.points.position;
  test::Random random(5);
  for (Vec3& at : x) at += Vec3(1, 2, 3) + 0.2 * random.vector();
  const TermLoop all(elements, m.points, 100), one(elements, m.points, 6),
      none(elements, m.points, 0);
  std::vector<Vec3> gradient(x.size(), Vec3::Zero());
  EXPECT_DOUBLE_EQ(all.add_gradient(x, {}, 2.0, gradient), all.value(x));
  EXPECT_EQ(none.value(x), 0);
  EXPECT_NE(one.value(x), all.value(x));
  Eigen::VectorXd slope;
  const std::vector<Vec3> corners(x.begin() + 1, x.begin() + 1 + TypeParam::points);
  EXPECT_DOUBLE_EQ(one.value(x), this->term_.gradient(corners, this->numbers_, slope));
  EXPECT_LE((gradient[1] - 2 * slope.head<3>()).norm(), 1e-14 * slope.norm());
  const auto form = [&](bool exact) {  // of one direction
    double sum = 0;
    all.for_each_block(x, {}, exact, [&](int32_t p, int32_t q, const Mat3& block) {
      sum += (p == q ? 1 : 2) *
             Vec3(1, -2, 3).normalized().dot(block * Vec3(1, -2, 3).normalized()) *
             (p % 2 ? 1 : -1) * (q % 2 ? 1 : -1);
    });
    return sum;
  };
  EXPECT_GE(form(false), -1e-12);
  EXPECT_GE(form(false), form(true) - 1e-12);
}

TEST(UnknownTerms, AreRefusedByName) {
  const model::Model m = test::layered_patch({});
  add_term<Bed>("bed");
  EXPECT_THROW(TermLoop({"sofa", 1, 4, {0}, {0, 0, 0, 1}}, m.points, 0), base::InputError);
  EXPECT_THROW(TermLoop({"bed", 2, 4, {0, 1}, {0, 0, 0, 1}}, m.points, 0), base::InputError);
}

}  // namespace term_test
}  // namespace repose::mechanics
