#pragma once
#include <array>
#include <cmath>

#include "repose/discrete/function.h"

namespace repose::testing {

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

inline std::array<double, 3> quartic(double x) {
  return {std::pow(x, 4) / 4, x * x * x, 3 * x * x};
}

}  // namespace repose::testing
