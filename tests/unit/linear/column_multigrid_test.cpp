#include "repose/linear/column_multigrid.h"

#include <gtest/gtest.h>

#include "../discrete/moved_block.h"
#include "repose/base/agreement.h"
#include "repose/discrete/tangent.h"
#include "repose/linear/tangent_solver.h"

namespace repose {
namespace column_multigrid_test {

using base::check;

/// A sheet of so many columns a side, held at one end, its springs at rest.
model::Model sheet(int columns) {
  return testing::block(columns, columns, 3, 2, [](int i, int, int) {
    return i == 0 ? model::PointSet::bone : model::PointSet::soft_tissue;
  });
}

/// A slab of so many columns a side, held by bone below, its springs at rest.
model::Model slab(int columns) {
  return testing::block(columns, columns, 4, 2, [](int, int, int a) {
    return a == 3 ? model::PointSet::bone : model::PointSet::soft_tissue;
  });
}

struct Preconditioned : testing::MovedBlock {
  discrete::Objective objective;
  discrete::Tangent tangent{objective};
  linear::BlockSource blocks = [this](const discrete::BlockVisitor& visit) {
    tangent.visit_spd_blocks(visit);
  };
  base::VecHandle at = vector(1, 0.05);

  explicit Preconditioned(model::Model model)
      : MovedBlock(std::move(model)),
        objective(positions, {1, mechanics::VolumeTerm::penalty, 0.4}) {
    tangent.assemble(at);
  }
  linear::ColumnMultigrid make() const { return {MPI_COMM_WORLD, part, blocks}; }
  /// Conjugate gradients' iterations to 1e-8 of the right-hand side, on the convex Hessian.
  int64_t iterations() {
    linear::TangentSolver solver(positions, tangent);
    base::VecHandle answer = positions.make_vector();
    linear::KspHandle krylov;
    solver.prepare(at);
    tangent.renew();
    check(KSPCreate(MPI_COMM_WORLD, krylov.out()));
    check(KSPSetType(krylov, KSPCG));
    check(KSPSetPC(krylov, solver.preconditioner()));
    check(KSPSetOperators(krylov, tangent.spd_approximation(), tangent.spd_approximation()));
    check(KSPSetTolerances(krylov, 1e-8, 0, PETSC_DEFAULT, 500));
    check(KSPSolve(krylov, vector(3, 1.0), answer));
    PetscInt iterations = 0;
    KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
    check(KSPGetConvergedReason(krylov, &reason));
    EXPECT_GT(reason, 0);
    check(KSPGetIterationNumber(krylov, &iterations));
    return iterations;
  }
};

double product(Vec a, Vec b) {
  PetscScalar value = 0;
  check(VecDot(a, b, &value));
  return value;
}

// First: Scotch's random numbers, and so the parts of a sheet, depend on the partitions that a
// process has made before.
TEST(ColumnMultigrid, IterationsGrowLittleWithTheTissue) {
  EXPECT_LT(Preconditioned(slab(12)).iterations(), 25);
  EXPECT_LT(Preconditioned(slab(48)).iterations(), 30);
  EXPECT_LT(Preconditioned(sheet(36)).iterations(), 60);
  EXPECT_LT(Preconditioned(sheet(72)).iterations(), 85);
}

TEST(ColumnMultigrid, IsSymmetricAndPositive) {
  Preconditioned s(slab(16));
  linear::ColumnMultigrid multigrid = s.make();
  const base::VecHandle a = s.vector(4, 1.0), b = s.vector(5, 1.0);
  base::VecHandle of_a = s.positions.make_vector(), of_b = s.positions.make_vector();
  multigrid.apply(a, of_a);
  multigrid.apply(b, of_b);
  const double size = std::sqrt(product(a, of_a) * product(b, of_b));
  EXPECT_GT(product(a, of_a), 0);
  EXPECT_NEAR(product(a, of_b), product(b, of_a), 1e-5 * size);
}

TEST(ColumnMultigrid, SolvesColumnsThatAreNotCoupledAtOnce) {
  Preconditioned s(slab(24));  // too many points for factors
  const discrete::Part& part = s.part;
  Mat3 link;
  link << 1, 0.3, 0, -0.2, 1.1, 0.1, 0, 0.4, 0.9;
  const auto for_each_point = [&](auto&& visit) {  // with a point below it or not
    for (int32_t i = 0; i < part.owned_points; ++i)
      if (part.unknown[i] >= 0)
        visit(i, part.unknown[i + 1] >= 0 && part.model.points.layer[i] < 2);
  };
  const linear::BlockSource columns = [&](const discrete::BlockVisitor& visit) {
    for_each_point([&](int32_t i, bool above) {
      visit(i, i, 4 * Mat3::Identity());
      if (above) visit(i, i + 1, link);
    });
  };
  linear::ColumnMultigrid multigrid(MPI_COMM_WORLD, part, columns);
  const base::VecHandle rhs = s.vector(7, 1.0);
  base::VecHandle answer = s.positions.make_vector();
  multigrid.apply(rhs, answer);
  std::vector<Vec3> x(part.point_row.size(), Vec3::Zero()), left = x;
  s.positions.scatter_to_local(answer, x);
  for_each_point([&](int32_t i, bool above) {
    left[i] += 4 * x[i];
    if (!above) return;
    left[i] += link * x[i + 1];
    left[i + 1] += link.transpose() * x[i];
  });
  s.positions.restrict_to_owned(left, answer);
  check(VecAXPY(answer, -1, rhs));
  EXPECT_LT(discrete::largest_block(answer), 1e-3);
}

TEST(ColumnMultigrid, TakesTheNumbersAnew) {
  Preconditioned s(slab(12));
  linear::ColumnMultigrid multigrid = s.make();
  const base::VecHandle a = s.vector(4, 1.0);
  base::VecHandle before = s.positions.make_vector(), after = s.positions.make_vector();
  multigrid.apply(a, before);
  multigrid.refill([&](const discrete::BlockVisitor& visit) {
    s.blocks([&](int32_t p, int32_t q, const Mat3& block) { visit(p, q, 4 * block); });
  });
  multigrid.apply(a, after);
  check(VecAXPY(after, -0.25, before));
  EXPECT_LT(discrete::largest_block(after), 1e-5 * discrete::largest_block(before));
}

TEST(ColumnMultigrid, AddsAndTakesBackExtraBlocksOnEachLevel) {
  Preconditioned s(slab(12));
  linear::ColumnMultigrid multigrid = s.make();
  const auto few = [&](double weight) {
    return [&s, weight](const discrete::BlockVisitor& visit) {
      for (int32_t p = 0; p < s.part.owned_points; p += 7)
        if (s.part.unknown[p] >= 0) visit(p, p, weight * Mat3::Identity());
    };
  };
  const base::VecHandle a = s.vector(4, 1.0);
  base::VecHandle plain = s.positions.make_vector(), refilled = s.positions.make_vector(),
                  added = s.positions.make_vector();
  multigrid.apply(a, plain);
  multigrid.refill([&](const discrete::BlockVisitor& visit) {
    s.blocks(visit);
    few(3)(visit);
  });
  multigrid.apply(a, refilled);
  multigrid.refill(s.blocks);
  multigrid.set_extra(few(50));
  multigrid.set_extra(few(3));
  multigrid.apply(a, added);
  const double length = discrete::largest_block(refilled);
  check(VecAXPY(added, -1, refilled));
  EXPECT_LT(discrete::largest_block(added), 1e-4 * length);
  check(VecAXPY(refilled, -1, plain));
  EXPECT_GT(discrete::largest_block(refilled), 0.01 * length);
}

TEST(ColumnMultigrid, IsThatOfTwoSlabsWhereNothingButLinksCouplesThem) {
  Preconditioned s(slab(24));  // lips that are parted, and may touch
  const auto is_left = [&](int32_t p) { return s.part.model.points.position[p].x() < 23; };
  const auto parted = [&](bool linked) {
    return [&, linked](const discrete::BlockVisitor& visit) {
      s.blocks([&](int32_t p, int32_t q, const Mat3& block) {
        const bool own = std::max(p, q) < s.part.owned_points;
        if (is_left(p) == is_left(q))
          visit(p, q, block);
        else if (linked && own)
          visit(p, q, Mat3::Zero());
      });
    };
  };
  const base::VecHandle a = s.vector(4, 1.0);
  base::VecHandle bare = s.positions.make_vector(), linked = s.positions.make_vector();
  linear::ColumnMultigrid(MPI_COMM_WORLD, s.part, parted(false)).apply(a, bare);
  linear::ColumnMultigrid(MPI_COMM_WORLD, s.part, parted(true)).apply(a, linked);
  check(VecAXPY(linked, -1, bare));
  EXPECT_LT(discrete::largest_block(linked), 1e-6 * discrete::largest_block(bare));
}

TEST(ColumnMultigrid, ServesGraphsWithoutLayers) {
  model::Model graph = slab(12);
  for (int64_t p = 0; p + 2 < static_cast<int64_t>(graph.points.position.size()); p += 4)
    testing::add_spring(graph, p, p + 2, 5.0, 2);
  EXPECT_LT(Preconditioned(graph).iterations(), 80);
}

TEST(ColumnMultigrid, LivesWithPointsThatNothingHolds) {
  model::Model loose = slab(8);
  testing::add_point(loose, {50, 50, 50}, model::PointSet::soft_tissue, 64);
  EXPECT_LT(Preconditioned(loose).iterations(), 60);
}

}  // namespace column_multigrid_test
}  // namespace repose
