#pragma once
#include "../discrete/moved_block.h"
#include "repose/discrete/tangent.h"
#include "repose/linear/tangent_solver.h"

namespace repose::testing {

/// A slab of tissue on bone, its springs at rest, large enough for several levels.
inline model::Model slab_on_bone() {
  return block(24, 24, 4, 2, [](int, int, int a) {
    return a == 3 ? model::PointSet::bone : model::PointSet::soft_tissue;
  });
}

/// Linear systems with the Hessian of a block.
struct Solved : MovedBlock {
  discrete::Objective objective;
  discrete::Tangent tangent{objective};
  linear::TangentSolver solver{positions, tangent};
  base::VecHandle rhs = vector(5, 1.0), answer = positions.make_vector();

  explicit Solved(mechanics::VolumeTerm term = mechanics::VolumeTerm::penalty,
                  model::Model model = slab_on_bone())
      : MovedBlock(std::move(model)), objective(positions, {1, term, 0.4}) {}
  /// Drawn out along x, the more the farther: springs a thousand times stiffer than others.
  base::VecHandle drawn_out() const {
    std::vector<Vec3> values = part.model.points.position;
    for (Vec3& at : values) at = {5e-3 * at.x() * at.x(), 0, 0};
    base::VecHandle v = positions.make_vector();
    positions.restrict_to_owned(values, v);
    return v;
  }
  bool solve(Vec at, double tolerance) {
    base::check(VecSet(answer, 0));
    return solver.solve(at, rhs, answer, tolerance);
  }
  /// Residual by the entries of the exact Hessian, not by its action.
  double residual(Vec at) {
    tangent.assemble(at);
    base::VecHandle left = positions.make_vector();
    base::check(MatMult(tangent.exact(), answer, left));
    base::check(VecAXPY(left, -1, rhs));
    return discrete::largest_block(left) / discrete::largest_block(rhs);
  }
};

}  // namespace repose::testing
