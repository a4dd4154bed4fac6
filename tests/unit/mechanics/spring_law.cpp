#include "repose/mechanics/spring_law.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <limits>
#include <unsupported/Eigen/AutoDiff>

namespace repose::mechanics {
namespace spring_law_test {

constexpr std::array<double, 11> elongations = {-30.0, -3.0, -0.7, -0.1, -1e-9, 0.0,
                                                1e-12, 0.02, 0.5,  2.0,  40.0};
constexpr std::array<double, 4> references = {0.05, 1.0, 3.7, 1000.0};
constexpr double k0 = 0.37;

/// The table of docs/theory/model.md "Spring laws", written with powers of the strain.
double table_tension(int p, double s, double reference) {
  return k0 * std::pow(1 + std::pow(s / reference, 2), p) * s;
}

double table_energy(int p, double s, double reference) {
  const double strain = std::abs(s / reference);
  constexpr double second[] = {0.0, 0.5, 1.0}, fourth[] = {0.0, 0.0, 1.0 / 3.0};
  return 0.5 * k0 * s * s * (1 + second[p] * std::pow(strain, 2) + fourth[p] * std::pow(strain, 4));
}

/// ∫₀ˢ T by Gauss's rule of three points, exact for the polynomials of degree 5 that tensions are.
template <int p>
double integrated_tension(double s, double inverse_reference) {
  const double node = std::sqrt(0.6);
  const auto at = [&](double t) {
    return spring_tension<p>(0.5 * s * (1 + t), k0, inverse_reference);
  };
  return s / 18 * (5 * at(-node) + 8 * at(0) + 5 * at(node));
}

template <class T>
class SpringLaw : public ::testing::Test {};
template <int exponent>
struct Exponent {
  static constexpr int p = exponent;
};
using Exponents = testing::Types<Exponent<0>, Exponent<1>, Exponent<2>>;
TYPED_TEST_SUITE(SpringLaw, Exponents);

template <class Check>
void for_all(Check&& check) {
  for (double reference : references)
    for (double s : elongations) check(s, reference);
}

void expect_relative(double value, double expected, double s, double reference) {
  EXPECT_NEAR(value, expected, 1e-13 * std::abs(expected)) << "s " << s << " s_ref " << reference;
}

TYPED_TEST(SpringLaw, IsTheTableOfTheModel) {
  constexpr int p = TypeParam::p;
  for_all([](double s, double reference) {
    expect_relative(spring_tension<p>(s, k0, 1 / reference), table_tension(p, s, reference), s,
                    reference);
    expect_relative(spring_energy<p>(s, k0, 1 / reference), table_energy(p, s, reference), s,
                    reference);
  });
}

TYPED_TEST(SpringLaw, EnergyIsTheIntegralOfTension) {
  constexpr int p = TypeParam::p;
  for_all([](double s, double reference) {
    expect_relative(spring_energy<p>(s, k0, 1 / reference), integrated_tension<p>(s, 1 / reference),
                    s, reference);
  });
}

TYPED_TEST(SpringLaw, TangentIsTheDerivativeOfTensionAndNeverNegative) {
  constexpr int p = TypeParam::p;
  using Dual = Eigen::AutoDiffScalar<Eigen::Matrix<double, 1, 1>>;
  for_all([](double s, double reference) {
    const Dual tension = spring_tension<p>(Dual(s, 1, 0), k0, 1 / reference);
    const double tangent = spring_tangent<p>(s, k0, 1 / reference);
    expect_relative(tangent, tension.derivatives()[0], s, reference);
    EXPECT_GE(tangent, k0 * (1 - 1e-15));
  });
}

TYPED_TEST(SpringLaw, IsOddAndZeroAtRest) {
  constexpr int p = TypeParam::p;
  EXPECT_EQ(spring_tension<p>(0.0, k0, 2.0), 0.0);
  EXPECT_EQ(spring_energy<p>(0.0, k0, 2.0), 0.0);
  EXPECT_EQ(spring_tangent<p>(0.0, k0, 2.0), k0);
  EXPECT_EQ(spring_tension<p>(-0.3, k0, 2.0), -spring_tension<p>(0.3, k0, 2.0));
  EXPECT_EQ(spring_energy<p>(-0.3, k0, 2.0), spring_energy<p>(0.3, k0, 2.0));
}

TYPED_TEST(SpringLaw, HugeStrainsAreHugeButNeverUndefined) {
  constexpr int p = TypeParam::p;
  for (double stiffness : {1e-9, 1.0, 1e12})
    for (double strain : {1e30, 1e80, 1e160, 1e300})
      for (const auto& [s, inverse] : {std::pair(strain, 1.0), std::pair(1.0, strain)}) {
        EXPECT_GT(spring_energy<p>(s, stiffness, inverse), 0) << strain;
        EXPECT_GT(spring_tension<p>(s, stiffness, inverse), 0) << strain;
        EXPECT_LT(spring_tension<p>(-s, stiffness, inverse), 0) << strain;
        EXPECT_GT(spring_tangent<p>(s, stiffness, inverse), 0) << strain;
      }
  EXPECT_NEAR(spring_energy<p>(1e30, 1.0, 1.0) / (0.5 * std::pow(1e30, 2 * p + 2) / (p + 1)), 1.0,
              1e-13);
}

TEST(SpringLaw, ExponentIsChosenOnceForALoop) {
  for (int p = 0; p <= 2; ++p) {
    const double tension =
        with_exponent(p, []<int q>() { return spring_tension<q>(2.0, k0, 1.0); });
    EXPECT_DOUBLE_EQ(tension, table_tension(p, 2.0, 1.0));
  }
}

}  // namespace spring_law_test
}  // namespace repose::mechanics
