#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "assembled.h"
#include "repose/mechanics/term.h"
#include "states.h"

/// One test of derivatives for every term and sum of terms, in every state: Taylor expansions
/// with gradient and Hessian, and automatic differentiation of the formulas of
/// docs/theory/model.md.
namespace repose::mechanics {
namespace derivatives_test {

using test::State;
using test::StateInfo;

/// A volume term with springs of the laws named.
template <VolumeTerm volume, int... exponents>
struct Term {
  static constexpr double min_step = 0;
  static constexpr Weights weights{0.7, volume, 1.3};

  static model::Model model() { return test::uneven_patch(); }
  static Loops loops(const model::Model& model) {
    Loops loops = make_loops(model, static_cast<int64_t>(model.springs.points.size()),
                             static_cast<int64_t>(model.prisms.points.size()));
    std::erase_if(loops.springs,
                  [](const SpringLoop& loop) { return !((loop.exponent == exponents) || ...); });
    return loops;
  }
};

constexpr VolumeTerm none = VolumeTerm::none, paper = VolumeTerm::paper,
                     penalty = VolumeTerm::penalty;
/// The neo-Hookean solid.
struct Solid {
  static constexpr double min_step = 1.0 / 1024;  // below, rounding of a larger energy shows
  static constexpr Weights weights{0.7, VolumeTerm::penalty, 1.3};
  static model::Model model() { return test::uneven_solid(); }
  static Loops loops(const model::Model& model) {
    return make_loops(model, 0, static_cast<int64_t>(model.prisms.points.size()),
                      static_cast<int64_t>(model.edges.points.size()));
  }
};

struct AveragedSolid : Solid {
  static model::Model model() { return test::averaged_solid(); }
  static Loops loops(const model::Model& model) {
    return make_loops(model, 0, static_cast<int64_t>(model.prisms.points.size()),
                      static_cast<int64_t>(model.edges.points.size()),
                      static_cast<int64_t>(model.points.position.size()));
  }
};

using Terms = testing::Types<Solid, AveragedSolid, Term<none, 0>, Term<none, 1>, Term<none, 2>,
                             Term<paper>, Term<penalty>, Term<paper, 2>, Term<penalty, 0, 1, 2>>;

template <class T>
class Derivatives : public ::testing::Test {
 protected:
  template <class Check>
  void in_every_state(Check&& check) {
    for (const StateInfo& info : test::all_states) {
      SCOPED_TRACE(info.name);
      check(test::positions(model_, info.state), info);
    }
  }
  model::Model model_ = T::model();
  Loops loops_ = T::loops(model_);
  Weights weights_ = T::weights;
};
TYPED_TEST_SUITE(Derivatives, Terms);

/// Remainders of a Taylor expansion at steps h/2 and h/4, summed over directions so that none that
/// happens to be straight is mistaken for accuracy.
struct Remainder {
  double half = 0, quarter = 0;
  template <class Left>
  void add(double step, Left&& left) {
    half += std::abs(left(0.5 * step));
    quarter += std::abs(left(0.25 * step));
  }
  double order() const { return std::log2(half / quarter); }
};

TYPED_TEST(Derivatives, TaylorRemaindersFallAsTheyShould) {
  this->in_every_state([this](const std::vector<Vec3>& x, const StateInfo& info) {
    const auto here = test::evaluate(this->loops_, this->weights_, x);
    const auto hessian = test::assemble(this->loops_, this->weights_, x, Curvature::exact);
    const double step = std::max(info.step, TypeParam::min_step);
    Remainder gradient, blocks, action;
    for (uint32_t seed = 2; seed < 8; ++seed) {
      const auto directions = test::random_directions(x.size(), seed);
      const Eigen::VectorXd d = test::flattened(directions);
      const auto product = test::hessian_action(this->loops_, this->weights_, x, directions);
      const auto first = [&](double h) {
        const auto y = test::moved(x, directions, h);
        return test::evaluate(this->loops_, this->weights_, y).value - here.value -
               h * here.gradient.dot(d);
      };
      gradient.add(step, first);
      blocks.add(step, [&](double h) { return first(h) - 0.5 * h * h * d.dot(hessian * d); });
      action.add(step, [&](double h) { return first(h) - 0.5 * h * h * d.dot(product); });
    }
    EXPECT_NEAR(gradient.order(), 2, 0.1);
    EXPECT_NEAR(blocks.order(), 3, 0.2);
    EXPECT_NEAR(action.order(), 3, 0.2);
  });
}

TYPED_TEST(Derivatives, HessianActionIsTheAssembledMatrix) {
  this->in_every_state([this](const std::vector<Vec3>& x, const StateInfo&) {
    const auto directions = test::random_directions(x.size());
    const Eigen::MatrixXd hessian =
        test::assemble(this->loops_, this->weights_, x, Curvature::exact);
    const Eigen::VectorXd d = test::flattened(directions);
    const Eigen::VectorXd action =
        test::hessian_action(this->loops_, this->weights_, x, directions);
    const double scale = (hessian.cwiseAbs() * d.cwiseAbs()).maxCoeff();
    EXPECT_LE((action - hessian * d).cwiseAbs().maxCoeff(), 1e-14 * scale);
    EXPECT_LE((hessian - hessian.transpose()).norm(), 1e-15 * hessian.norm());
  });
}

/// Sums of an oracle's elements: value, gradient, and how much was added to each to reach it.
struct OracleSums {
  double value = 0, value_scale = 0;
  Eigen::VectorXd gradient, gradient_scale;

  void add_value(double term) {
    value += term;
    value_scale += std::abs(term);
  }
  template <int points>
  void add(const std::array<int32_t, points>& rows, const Expansion<points>& element) {
    add_value(element.value);
    for (int c = 0; c < points; ++c) {
      const Vec3 part = element.gradient.template segment<3>(3 * c);
      gradient.segment<3>(3 * rows[c]) += part;
      gradient_scale.segment<3>(3 * rows[c]).array() += part.norm();
    }
  }
};

template <int p>
Expansion<2> spring_oracle(const SpringLoop& loop, int64_t e, double scale,
                           const std::vector<Vec3>& x) {
  const auto [i, j] = loop.points[e];
  return differentiate<2>({x[i], x[j]}, [&](const auto& c) {
    using Scalar = typename std::decay_t<decltype(c[0])>::Scalar;
    const Eigen::Matrix<Scalar, 3, 1> d = c[1] - c[0];
    const Scalar elongation = sqrt(d.dot(d)) - Scalar(loop.rest_length[e]);
    return Scalar(scale *
                  spring_energy<p>(elongation, loop.stiffness[e], loop.inverse_reference[e]));
  });
}

Expansion<6> prism_oracle(const PrismLoop& loop, int64_t e, const Weights& weights,
                          const std::vector<Vec3>& x) {
  std::array<Vec3, 6> corners;
  for (int c = 0; c < 6; ++c) corners[c] = x[loop.points[e][c]];
  const double target = loop.target_volume[e];
  const double factor =
      weights.volume_weight * (weights.volume == paper ? 1.0 : 0.5 / loop.compliance[e]);
  return differentiate<6>(corners, [&](const auto& c) {
    using Scalar = typename std::decay_t<decltype(c[0])>::Scalar;
    const Scalar change = model::prism_volume(c.data()) - Scalar(target);
    return Scalar(Scalar(factor) * change * change);
  });
}

template <int p>
void check_springs(const SpringLoop& loop, double scale, const std::vector<Vec3>& x,
                   OracleSums& sums) {
  for_each_spring_block(loop, x, scale, Curvature::exact, [&](int64_t e, const Mat3& block) {
    const auto oracle = spring_oracle<p>(loop, e, scale, x);
    sums.add<2>(loop.points[e], oracle);
    Eigen::Matrix<double, 6, 6> hessian;
    hessian << block, -block, -block, block;
    EXPECT_LE((hessian - oracle.hessian).norm(), 1e-12 * hessian.norm()) << "spring " << e;
  });
}

/// Derivatives of a prism's volume.
Expansion<6> volume_oracle(const std::array<int32_t, 6>& points, const std::vector<Vec3>& x) {
  std::array<Vec3, 6> corners;
  for (int c = 0; c < 6; ++c) corners[c] = x[points[c]];
  return differentiate<6>(corners, [](const auto& c) {
    using Scalar = typename std::decay_t<decltype(c[0])>::Scalar;
    return Scalar(model::prism_volume(c.data()));
  });
}

/// Averaged volumes by the chain rule: ½ e²/C of each point, e a sixth of what its prisms change
/// by. Returns by how much the energy grows with each prism's volume.
std::vector<double> check_nodal(const NodalVolumes& nodal, const Weights& weights,
                                const std::vector<Vec3>& x, OracleSums& sums) {
  std::vector<double> excess(x.size(), 0.0), slopes(nodal.rest_volume.size());
  nodal.for_each_prism([&](int64_t m, const std::array<int32_t, 6>& points) {
    for (const int32_t p : points)
      excess[p] += (volume_oracle(points, x).value - nodal.rest_volume[m]) / 6;
  });
  for (int64_t p = 0; p < nodal.counted; ++p)
    sums.add_value(weights.volume_weight * 0.5 * nodal.stiffness[p] * excess[p] * excess[p]);
  nodal.for_each_prism([&](int64_t m, const std::array<int32_t, 6>& points) {
    for (const int32_t p : points)
      slopes[m] += weights.volume_weight * nodal.stiffness[p] * excess[p] / 6;
    Expansion<6> oracle = volume_oracle(points, x);
    oracle.gradient *= slopes[m];
    oracle.value = 0;
    sums.add<6>(points, oracle);
  });
  return slopes;
}

void check_prisms(const Loops& loops, const Weights& weights, const std::vector<Vec3>& x,
                  OracleSums& sums) {
  const PrismLoop& loop = loops.prisms;
  const std::vector<double> nodal = check_nodal(loops.nodal, weights, x, sums);
  for_each_prism_block(loops, x, weights, {}, [&](int64_t e, const PrismBlocks& blocks) {
    auto oracle = prism_oracle(loop, e, weights, x);
    sums.add<6>(loop.points[e], oracle);
    if (!nodal.empty())
      oracle.hessian +=
          nodal[loops.nodal.place[loop.row[e]]] * volume_oracle(loop.points[e], x).hessian;
    Eigen::Matrix<double, 18, 18> hessian;
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) hessian.block<3, 3>(3 * i, 3 * j) = blocks[i][j];
    EXPECT_LE((hessian - oracle.hessian).norm(), 1e-12 * hessian.norm()) << "prism " << e;
  });
}

void check_edges(const EdgeLoop& loop, double scale, const std::vector<Vec3>& x, OracleSums& sums) {
  for (int64_t e = 0; e < loop.size(); ++e) {
    const auto [i, j] = loop.points[e];
    sums.add<2>(loop.points[e], differentiate<2>({x[i], x[j]}, [&](const auto& c) {
                  using Scalar = typename std::decay_t<decltype(c[0])>::Scalar;
                  const Eigen::Matrix<Scalar, 3, 1> d = c[1] - c[0];
                  return Scalar(Scalar(0.5 * scale * loop.weight[e]) * d.dot(d));
                }));
  }
}

TYPED_TEST(Derivatives, AgreeWithAutomaticDifferentiation) {
  this->in_every_state([this](const std::vector<Vec3>& x, const StateInfo&) {
    OracleSums sums;
    sums.gradient = sums.gradient_scale = Eigen::VectorXd::Zero(3 * static_cast<int64_t>(x.size()));
    for (const SpringLoop& loop : this->loops_.springs)
      with_exponent(loop.exponent,
                    [&]<int p>() { check_springs<p>(loop, this->weights_.elastic, x, sums); });
    check_edges(this->loops_.edges, this->weights_.elastic, x, sums);
    check_prisms(this->loops_, this->weights_, x, sums);
    const auto here = test::evaluate(this->loops_, this->weights_, x);
    EXPECT_GT(sums.value_scale, 0);
    EXPECT_NEAR(here.value, sums.value, 1e-12 * sums.value_scale);
    const Eigen::ArrayXd error = (here.gradient - sums.gradient).array().abs();
    EXPECT_LE((error - 1e-12 * sums.gradient_scale.array()).maxCoeff(), 0.0);
  });
}

}  // namespace derivatives_test
}  // namespace repose::mechanics
