#include "repose/discrete/force_functional.h"

#include <gtest/gtest.h>

#include "moved_block.h"
#include "repose/base/agreement.h"

namespace repose {
namespace force_functional_test {

using base::check;
using mechanics::VolumeTerm;
using model::PointSet;

model::Model weighty_block() {
  model::Model m = testing::held_block();
  m.gravity = {1, -2, -9.80665};
  for (size_t i = 0; i < m.points.mass.size(); ++i) m.points.mass[i] = 1e-3 * (1 + i % 7);
  for (double& l : m.springs.rest_length) l *= 0.97;
  return m;
}

mechanics::Weights weights_of(VolumeTerm term) {
  return term == VolumeTerm::none ? mechanics::Weights{} : mechanics::Weights{0.7, term, 0.3};
}

/// The force functional of a block with weight, on any number of ranks.
struct Forces : testing::MovedBlock {
  discrete::Objective elastic{positions, {}};
  discrete::Tangent tangent{elastic};
  discrete::ForceFunctional functional;

  explicit Forces(VolumeTerm term)
      : MovedBlock(weighty_block()), functional(elastic, weights_of(term)) {}
};

double dot(Vec a, Vec b) {
  PetscScalar product = 0;
  check(VecDot(a, b, &product));
  return product;
}

class ForceTerms : public ::testing::TestWithParam<std::tuple<VolumeTerm, double>> {
 protected:
  static double epsilon() { return std::get<1>(GetParam()); }
};

/// |Φ(x + h d) − Φ(x) − h ∇Φ·d| falls as h².
TEST_P(ForceTerms, GradientPassesTheTaylorTest) {
  Forces f(std::get<0>(GetParam()));
  f.functional.set_epsilon(epsilon());
  for (unsigned seed : {1u, 11u, 21u}) {
    base::VecHandle at = f.vector(seed, 0.4), direction = f.vector(seed + 1, 1.0);
    base::VecHandle gradient = f.positions.make_vector();
    const double value = f.functional.evaluate(at, gradient);
    const double slope = dot(gradient, direction);
    double h = 1.0 / 4096, before = 0;
    for (int halving = 0; halving < 4; ++halving, h /= 2) {
      base::VecHandle there = f.vector(seed, 0.4);
      check(VecAXPY(there, h, direction));
      const double rest = std::abs(f.functional.evaluate(there, nullptr) - value - h * slope);
      if (halving > 0) {
        EXPECT_NEAR(std::log2(before / rest), 2, 0.15) << "h " << h;
      }
      before = rest;
    }
  }
}

/// λ H D H d + 2 (1 − λ) Σ ∇v (∇v · d), put together from the kernels' actions.
class Reference {
 public:
  explicit Reference(Forces& f) : f_(f) {}

  base::VecHandle product(Vec at, Vec direction) {
    f_.positions.update(at);
    base::VecHandle once = action(direction);
    scale_by_metric(once);
    base::VecHandle twice = action(once);
    check(VecScale(twice, f_.functional.weights().elastic));
    if (f_.functional.volume()) check(VecAXPY(twice, 1, volume_part(direction)));
    return twice;
  }

 private:
  std::vector<Vec3> spread(Vec v) const {
    std::vector<Vec3> local(f_.part.point_row.size(), Vec3::Zero());
    f_.positions.scatter_to_local(v, local);
    return local;
  }
  base::VecHandle action(Vec direction) {
    base::VecHandle out = f_.positions.make_vector();
    f_.elastic.hessian_action(spread(direction), out);
    return out;
  }
  void scale_by_metric(Vec v) {
    std::vector<Vec3> scaled = spread(v);
    const std::vector<Vec3> force = f_.elastic.residual_force();
    for (size_t i = 0; i < force.size(); ++i) {
      const double length = std::hypot(force[i].norm(), f_.functional.epsilon());
      const Vec3 unit = force[i] / length;
      scaled[i] = (scaled[i] - unit * unit.dot(scaled[i])) / length;
    }
    f_.positions.restrict_to_owned(scaled, v);
  }
  /// v is affine in each corner: its difference quotients are its derivatives.
  static Vec3 slope(std::array<Vec3, 6> corners, int c) {
    Vec3 result;
    for (int axis = 0; axis < 3; ++axis) {
      double v[2];
      for (int side : {0, 1}) {
        corners[c][axis] += side == 0 ? -1.0 : 2.0;
        v[side] = model::prism_volume(corners.data());
      }
      corners[c][axis] -= 1.0;
      result[axis] = (v[1] - v[0]) / 2;
    }
    return result;
  }
  base::VecHandle volume_part(Vec direction) const {
    const std::vector<Vec3> d = spread(direction);
    std::vector<Vec3> sum(d.size(), Vec3::Zero());
    for (const auto& prism : f_.part.model.prisms.points) {
      std::array<Vec3, 6> corners, slopes;
      for (int c = 0; c < 6; ++c) corners[c] = f_.positions.local()[prism[c]];
      double along = 0;
      for (int c = 0; c < 6; ++c) along += (slopes[c] = slope(corners, c)).dot(d[prism[c]]);
      for (int c = 0; c < 6; ++c)
        sum[prism[c]] += 2 * f_.functional.weights().volume_weight * along * slopes[c];
    }
    base::VecHandle out = f_.positions.make_vector();
    f_.positions.restrict_to_owned(sum, out);
    return out;
  }

  Forces& f_;
};

/// |∇Φ(x + h d) − ∇Φ(x − h d) − 2 h H d| falls as h³.
TEST_P(ForceTerms, HessianPassesTheTaylorTest) {
  Forces f(std::get<0>(GetParam()));
  f.functional.set_epsilon(epsilon());
  discrete::ForceHessian hessian(f.functional, f.tangent);
  for (unsigned seed : {1u, 11u, 21u}) {
    const base::VecHandle direction = f.vector(seed + 1, 1.0);
    const base::VecHandle at = f.vector(seed, 0.4), product = f.positions.make_vector();
    hessian.assemble(at);
    check(MatMult(hessian.exact(), direction, product));
    double h = 1.0 / 1024, before = 0;
    for (int halving = 0; halving < 3; ++halving, h /= 2) {
      const base::VecHandle there = f.vector(seed, 0.4), back = f.vector(seed, 0.4);
      const base::VecHandle ahead = f.positions.make_vector(), behind = f.positions.make_vector();
      check(VecAXPY(there, h, direction));
      check(VecAXPY(back, -h, direction));
      f.functional.evaluate(there, ahead);
      f.functional.evaluate(back, behind);
      check(VecAXPY(ahead, -1, behind));
      check(VecAXPY(ahead, -2 * h, product));
      const double rest = discrete::largest_block(ahead);
      if (halving > 0) {
        EXPECT_NEAR(std::log2(before / rest), 3, 0.2) << "h " << h;
      }
      before = rest;
    }
  }
}

TEST_P(ForceTerms, GaussNewtonIsTheForcesPart) {
  Forces f(std::get<0>(GetParam()));
  f.functional.set_epsilon(epsilon());
  discrete::ForceHessian operator_of(f.functional, f.tangent);
  for (unsigned seed : {1u, 11u}) {
    base::VecHandle at = f.vector(seed, 0.4), direction = f.vector(seed + 1, 1.0);
    operator_of.assemble(at);
    base::VecHandle product = f.positions.make_vector();
    check(MatMult(operator_of.spd_approximation(), direction, product));
    base::VecHandle expected = Reference(f).product(at, direction);
    const double size = discrete::largest_block(expected);
    check(VecAXPY(expected, -1, product));
    EXPECT_LT(discrete::largest_block(expected), 1e-8 * size);
  }
}

TEST_P(ForceTerms, GaussNewtonIsSymmetricAndPositive) {
  Forces f(std::get<0>(GetParam()));
  f.functional.set_epsilon(epsilon());
  discrete::ForceHessian operator_of(f.functional, f.tangent);
  base::VecHandle at = f.vector(1, 0.4);
  operator_of.assemble(at);
  base::VecHandle from_a = f.positions.make_vector(), from_b = f.positions.make_vector();
  for (unsigned seed = 2; seed < 8; ++seed) {
    base::VecHandle a = f.vector(seed, 1.0), b = f.vector(seed + 10, 1.0);
    check(MatMult(operator_of.spd_approximation(), a, from_a));
    check(MatMult(operator_of.spd_approximation(), b, from_b));
    EXPECT_GT(dot(a, from_a), 0);
    EXPECT_NEAR(dot(a, from_b), dot(b, from_a), 1e-12 * dot(a, from_a));
  }
}

TEST_P(ForceTerms, ValueAndGradientDoNotDependOnTheRanks) {
  Forces f(std::get<0>(GetParam()));
  f.functional.set_epsilon(epsilon());
  base::VecHandle at = f.vector(1, 0.4), gradient = f.positions.make_vector();
  const double value = f.functional.evaluate(at, gradient);
  const double norm = std::sqrt(dot(gradient, gradient));
  const discrete::Part serial = discrete::build_local_from_root(MPI_COMM_SELF, f.whole).part;
  double expected[2] = {0, 0};
  if (base::rank(MPI_COMM_WORLD) == 0) {
    discrete::Positions positions(MPI_COMM_SELF, serial);
    discrete::Objective elastic(positions, {});
    discrete::ForceFunctional functional(elastic, f.functional.weights());
    functional.set_epsilon(epsilon());
    base::VecHandle same = testing::random_vector(positions, 1, 0.4);
    base::VecHandle slope = positions.make_vector();
    expected[0] = functional.evaluate(same, slope);
    expected[1] = std::sqrt(dot(slope, slope));
  }
  MPI_Bcast(expected, 2, MPI_DOUBLE, 0, MPI_COMM_WORLD);
  EXPECT_NEAR(value, expected[0], 1e-12 * expected[0]);
  EXPECT_NEAR(norm, expected[1], 1e-12 * expected[1]);
}

INSTANTIATE_TEST_SUITE_P(VolumeAndEpsilon, ForceTerms,
                         ::testing::Combine(::testing::Values(VolumeTerm::none, VolumeTerm::paper),
                                            ::testing::Values(10.0, 0.1)));

}  // namespace force_functional_test
}  // namespace repose
