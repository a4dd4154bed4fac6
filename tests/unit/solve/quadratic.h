#pragma once
#include "../discrete/models.h"
#include "repose/discrete/function.h"

namespace repose::testing {

/// ½ Σ a_i (x_i − 1)² over the scalar unknowns, a_i = 1, 2, …, `kinds` in turn.
class Quadratic : public discrete::Function {
 public:
  Quadratic(discrete::Positions& positions, int kinds) : Function(positions), kinds_(kinds) {}
  double stiffness(PetscInt i) const { return static_cast<double>(1 + i % kinds_); }

 private:
  double value_and_gradient(Vec displacement, Vec gradient) override {
    PetscInt begin = 0, end = 0;
    const PetscScalar* x = nullptr;
    base::check(VecGetOwnershipRange(displacement, &begin, &end));
    base::check(VecGetArrayRead(displacement, &x));
    double value = 0;
    for (PetscInt i = begin; i < end; ++i) {
      const double away = x[i - begin] - 1;
      value += 0.5 * stiffness(i) * away * away;
      if (gradient) base::check(VecSetValue(gradient, i, stiffness(i) * away, INSERT_VALUES));
    }
    base::check(VecRestoreArrayRead(displacement, &x));
    if (gradient) base::check(VecAssemblyBegin(gradient));
    if (gradient) base::check(VecAssemblyEnd(gradient));
    MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_SUM, positions_.comm());
    return value;
  }

  int kinds_;
};

/// A block of tissue whose deepest layer is bone: something for positions to belong to.
inline model::Model resting_block() {
  return block(4, 4, 3, 2, [](int, int, int a) {
    return a == 2 ? model::PointSet::bone : model::PointSet::soft_tissue;
  });
}

}  // namespace repose::testing
