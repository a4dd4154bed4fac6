#include "repose/solve/minimizer.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "../discrete/moved_block.h"
#include "quadratic.h"
#include "repose/base/options.h"

namespace repose {
namespace minimizer_test {

using base::check;

/// Function of one scalar unknown: value, slope and curvature.
using Curve = std::array<double, 3> (*)(double x);

/// The same function of every scalar unknown, summed up.
class Sum : public discrete::Function {
 public:
  Sum(discrete::Positions& positions, Curve curve) : Function(positions), curve_(curve) {}
  /// Computes derivative `order` of the curve at each unknown; returns their sum.
  double map(Vec displacement, int order, Vec into) const {
    const PetscScalar* x = nullptr;
    PetscScalar* y = nullptr;
    PetscInt size = 0;
    double sum = 0;
    check(VecGetLocalSize(displacement, &size));
    check(VecGetArrayRead(displacement, &x));
    check(VecGetArray(into, &y));
    for (PetscInt i = 0; i < size; ++i) sum += y[i] = curve_(x[i])[order];
    check(VecRestoreArray(into, &y));
    check(VecRestoreArrayRead(displacement, &x));
    MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, positions_.comm());
    return sum;
  }

 private:
  double value_and_gradient(Vec displacement, Vec gradient) override {
    base::VecHandle values = positions_.make_vector();
    if (gradient) map(displacement, 1, gradient);
    return map(displacement, 0, values);
  }

  Curve curve_;
};

class Curvatures : public discrete::Hessian {
 public:
  explicit Curvatures(const Sum& sum)
      : sum_(sum), at_(sum.positions().make_vector()), diagonal_(sum.positions().make_vector()) {
    PetscInt size = 0;
    check(VecGetLocalSize(at_, &size));
    check(MatCreateAIJ(sum.positions().comm(), size, size, PETSC_DETERMINE, PETSC_DETERMINE, 1,
                       nullptr, 0, nullptr, matrix_.out()));
    check(VecSet(at_, -1));
  }
  void assemble(Vec displacement) override {
    PetscBool same = PETSC_FALSE;
    check(VecEqual(displacement, at_, &same));
    if (same) return;
    check(VecCopy(displacement, at_));
    sum_.map(at_, 2, diagonal_);
    check(MatDiagonalSet(matrix_, diagonal_, INSERT_VALUES));
    ++assemblies_;
  }
  Mat exact() override { return matrix_; }
  Mat spd_approximation() override { return matrix_; }
  bool elliptic() const override { return false; }

 private:
  const Sum& sum_;
  base::VecHandle at_, diagonal_;
  base::MatHandle matrix_;
};

std::array<double, 3> quartic(double x) { return {std::pow(x, 4) / 4, x * x * x, 3 * x * x}; }

/// A search that begins with every scalar unknown at `start`.
struct Search : testing::MovedBlock {
  Sum sum;
  Curvatures curvatures{sum};
  linear::TangentSolver solver{positions, curvatures};
  base::VecHandle x = positions.make_vector();
  solve::Outcome outcome;

  Search(Curve curve, double start, double accuracy)
      : MovedBlock(testing::resting_block()), sum(positions, curve) {
    check(VecSet(x, start));
    outcome = solve::Minimizer(sum, solver, {}).run(x, accuracy);
  }
};

TEST(Estimate, KnowsHowFarRestIsInAWellFlatAtItsBottom) {
  // Newton steps from x are x/3, 2x/9, …; the second with the first one's Hessian were 8x/81.
  const Search s(quartic, 1, 2);
  EXPECT_TRUE(s.outcome.converged);
  EXPECT_NEAR(s.outcome.displacement_error, discrete::largest_block(s.x), 1e-6);
}

TEST(Estimate, IsNoShorterThanTheWayWhereNoStepWasTaken) {
  const Search s([](double x) { return std::array{x * x / 2, x, 1.0}; }, 2e-7, 1e-6);
  EXPECT_TRUE(s.outcome.converged);
  EXPECT_GT(discrete::largest_block(s.x), 3e-7);
  EXPECT_GE(s.outcome.displacement_error, discrete::largest_block(s.x));
}

TEST(Estimate, AboveTheAccuracyIsNotConverged) {
  const base::ScopedOption few("-tao_max_it", "1");
  const Search s(quartic, 1, 0.1);
  EXPECT_GT(s.outcome.displacement_error, 0.1);
  EXPECT_LT(s.outcome.displacement_error, 1);
  EXPECT_FALSE(s.outcome.converged);
}

TEST(Estimate, IsNotTrustedWhereTheSlopeDoesNotFall) {
  // Newton's step is a quarter of the way, and the next a third as long, by chance; there
  // is no minimum beyond the height of the waves.
  constexpr double height = 1.5;
  const Search s(
      [](double x) {
        constexpr double k = 2 * std::numbers::pi;
        return std::array{x * x / 2 - height / k * std::cos(k * x), x + height * std::sin(k * x),
                          1 + height * k * std::cos(k * x)};
      },
      20.195, 20);
  EXPECT_TRUE(s.outcome.converged);
  EXPECT_GE(s.outcome.displacement_error + std::sqrt(3) * height, discrete::largest_block(s.x));
}

}  // namespace minimizer_test
}  // namespace repose
