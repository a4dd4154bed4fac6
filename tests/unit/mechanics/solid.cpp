#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>

#include "assembled.h"
#include "repose/mechanics/nodal_volumes.h"
#include "repose/mechanics/stress.h"
#include "states.h"

/// Closed forms of the neo-Hookean solid (docs/theory/continuum.md).
namespace repose::mechanics {
namespace solid_test {

constexpr scene::Elasticity soft{0.015, 0.45};
constexpr int64_t across = 5, layers = 4;
constexpr double spacing = 1.0, gap = 0.8;

/// A block of one material whose inner points are moved about, so that its prisms are irregular.
model::Model block() {
  model::Model model = test::layered_patch({across, across, layers, spacing, gap});
  model.springs = {};
  test::Random random(3);
  for (size_t i = 0; i < model.points.position.size(); ++i) {
    const auto column = model.points.column[i], x = column % across, y = column / across;
    const auto layer = model.points.layer[i];
    const bool inner =
        x > 0 && x + 1 < across && y > 0 && y + 1 < across && layer > 0 && layer + 1 < layers;
    if (inner) model.points.position[i] += 0.15 * random.vector();
  }
  model.points.set.assign(model.points.set.size(), model::PointSet::soft_tissue);
  const model::Moduli moduli = model::moduli(soft);
  for (size_t m = 0; m < model.prisms.points.size(); ++m) {
    std::array<Vec3, 6> corners;
    for (int c = 0; c < 6; ++c) corners[c] = model.points.position[model.prisms.points[m][c]];
    const double volume = model::prism_volume(corners.data());
    model.prisms.rest_volume[m] = volume;
    model.prisms.shear_modulus.push_back(moduli.shear);
    model.prisms.modulus.push_back(moduli.volume);
    model.prisms.target_volume.push_back(volume * (1 + moduli.shear / moduli.volume));
  }
  model::assemble_edges("block", model);
  return model;
}

class SolidBlock : public ::testing::Test {
 protected:
  /// The forces that hold the block at x = F X, N.
  std::vector<Vec3> forces(const Mat3& f) const {
    std::vector<Vec3> x = model_.points.position;
    for (Vec3& p : x) p = f * p;
    const Eigen::VectorXd gradient = test::evaluate(loops_, weights_, x).gradient;
    std::vector<Vec3> forces(x.size());
    for (size_t i = 0; i < x.size(); ++i) forces[i] = gradient.segment<3>(3 * i);
    return forces;
  }
  bool at(size_t i, int axis, double value) const {
    return std::abs(model_.points.position[i][axis] - value) < 1e-12;
  }
  Vec3 sum_at(const std::vector<Vec3>& forces, int axis, double value) const {
    Vec3 sum = Vec3::Zero();
    for (size_t i = 0; i < forces.size(); ++i)
      if (at(i, axis, value)) sum += forces[i];
    return sum;
  }

  model::Model model_ = block();
  Weights weights_{1, VolumeTerm::penalty, 1};
  Loops loops_ = make_loops(model_, 0, static_cast<int64_t>(model_.prisms.points.size()),
                            static_cast<int64_t>(model_.edges.points.size()));
  const double shear_ = model::moduli(soft).shear, modulus_ = model::moduli(soft).volume;
  const double side_ = spacing * (across - 1), area_ = side_ * side_;
};

TEST_F(SolidBlock, ModuliAreHookesAtSmallStrains) {
  const double young = 2 * shear_ * (1 + soft.poisson);
  EXPECT_NEAR(young, soft.young, 1e-15);
  const double lame = modulus_ - shear_;
  EXPECT_NEAR(lame / (2 * (lame + shear_)), soft.poisson, 1e-14);
}

TEST_F(SolidBlock, NoForceAndNoEnergyByRigidMotion) {
  const Mat3 turn = Eigen::AngleAxisd(2.1, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
  const double rest = test::evaluate(loops_, weights_, model_.points.position).value;
  for (const Vec3& force : forces(turn)) EXPECT_LE(force.norm(), 1e-15);
  std::vector<Vec3> x = model_.points.position;
  for (Vec3& p : x) p = turn * p + Vec3(3, 4, 5);
  EXPECT_NEAR(test::evaluate(loops_, weights_, x).value, rest, 1e-14);
}

TEST_F(SolidBlock, InnerPointsOfAnyAffineMapAreInBalance) {
  Mat3 f;
  f << 1.3, 0.2, -0.1, 0.05, 0.8, 0.3, 0.1, -0.2, 1.1;
  const std::vector<Vec3> force = forces(f);
  const double bottom = -gap * (layers - 1);
  int inner = 0;
  for (size_t i = 0; i < force.size(); ++i) {
    if (at(i, 0, 0) || at(i, 0, side_) || at(i, 1, 0) || at(i, 1, side_) || at(i, 2, 0) ||
        at(i, 2, bottom))
      continue;
    EXPECT_LE(force[i].norm(), 1e-15);
    ++inner;
  }
  EXPECT_EQ(inner, (across - 2) * (across - 2) * (layers - 2));
}

TEST_F(SolidBlock, UniaxialStretch) {
  const double along = 1.4;
  double low = 0.5, high = 1.2;  // of the lateral stretch, by bisection of ∂W/∂λ₂
  for (int i = 0; i < 100; ++i) {
    const double l = 0.5 * (low + high), volume = along * l * l;
    const double slope = shear_ * l - shear_ * along * l + modulus_ * (volume - 1) * along * l;
    (slope < 0 ? low : high) = l;
  }
  const std::vector<Vec3> force = forces(Vec3(low, low, along).asDiagonal());
  const double expected =
      shear_ * along + (modulus_ * (along * low * low - 1) - shear_) * low * low;
  EXPECT_NEAR(sum_at(force, 2, 0).z(), expected * area_, 1e-12 * area_);
  for (size_t i = 0; i < force.size(); ++i) EXPECT_LE(force[i].head<2>().norm(), 1e-14);
}

TEST_F(SolidBlock, SimpleShear) {
  Mat3 f = Mat3::Identity();
  f(0, 2) = 0.7;
  EXPECT_NEAR(sum_at(forces(f), 2, 0).x(), shear_ * 0.7 * area_, 1e-14 * area_);
}

TEST_F(SolidBlock, StateOfAPrism) {
  std::array<Vec3, 6> before, now;
  const Mat3 turn = Eigen::AngleAxisd(0.4, Vec3(0, 1, 2).normalized()).toRotationMatrix();
  const Mat3 f = turn * Vec3(1.1, 0.9, 1.3).asDiagonal();
  for (int c = 0; c < 6; ++c) {
    before[c] = model_.points.position[model_.prisms.points[5][c]];
    now[c] = f * before[c];
  }
  const PrismState state =
      prism_state(shear_, modulus_ * (f.determinant() - 1) - shear_, before, now);
  EXPECT_LE((state.stretch - Vec3(1.3, 1.1, 0.9)).norm(), 1e-12);
  const double volume = 1.1 * 0.9 * 1.3;
  const Vec3 stress =
      shear_ / volume * Vec3(1.69, 1.21, 0.81) + Vec3::Constant(modulus_ * (volume - 1) - shear_);
  EXPECT_NEAR(state.pressure, -stress.mean(), 1e-12);
  const double mises =
      std::sqrt(0.5 * (std::pow(stress[0] - stress[1], 2) + std::pow(stress[1] - stress[2], 2) +
                       std::pow(stress[2] - stress[0], 2)));
  EXPECT_NEAR(state.von_mises, mises, 1e-12);
}

// F = diag(1, 1, −a): σ = μ F Fᵀ/J + φ′ with J = −a < 0.
TEST_F(SolidBlock, StateOfAnInvertedPrism) {
  const double a = 0.7, slope = modulus_ * (-a - 1) - shear_;
  std::array<Vec3, 6> before, now;
  for (int c = 0; c < 6; ++c) {
    before[c] = model_.points.position[model_.prisms.points[5][c]];
    now[c] = Vec3(1, 1, -a).asDiagonal() * before[c];
  }
  const PrismState state = prism_state(shear_, slope, before, now);
  EXPECT_LE((state.stretch - Vec3(1, 1, a)).norm(), 1e-12);
  EXPECT_NEAR(state.pressure, shear_ * (2 + a * a) / (3 * a) - slope, 1e-12);
  EXPECT_NEAR(state.von_mises, shear_ * (1 - a * a) / a, 1e-12);
}

TEST_F(SolidBlock, VolumesThatAllChangeAlikePressAlikeAveragedOrNot) {
  std::vector<Vec3> x = model_.points.position;
  for (Vec3& p : x) p = Vec3(1.1, 0.9, 1.3).asDiagonal() * p;
  const double slope = modulus_ * (1.1 * 0.9 * 1.3 - 1) - shear_;
  for (const double m : volume_slopes(model_, x)) EXPECT_NEAR(m, slope, 1e-12);
  model_.prisms.nodal_modulus.assign(model_.prisms.modulus.size(), modulus_ - shear_);
  for (const double m : volume_slopes(model_, x)) EXPECT_NEAR(m, slope, 1e-12);
}

/// Takes the last prism away, so that stacks differ in length and one of them stands alone.
model::Model without_last_prism(model::Model model) {
  model::Prisms& prisms = model.prisms;
  prisms.points.pop_back();
  for (auto* values : {&prisms.rest_volume, &prisms.shear_modulus, &prisms.modulus,
                       &prisms.target_volume, &prisms.nodal_modulus})
    values->pop_back();
  return model;
}

/// Turns the corners of the second prisms of all stacks, so that they are part of none.
model::Model with_turned_prisms(model::Model model) {
  for (auto& p : model.prisms.points)
    if (model.points.layer[p[0]] == 1) p = {p[1], p[2], p[0], p[4], p[5], p[3]};
  return model;
}

TEST(AveragedVolumes, DoNotDependOnHowPrismsAreStacked) {
  const model::Model stacked = without_last_prism(test::averaged_solid());
  const model::Model turned = with_turned_prisms(stacked);
  const auto loops_of = [](const model::Model& model) {
    return make_loops(model, 0, static_cast<int64_t>(model.prisms.points.size()),
                      static_cast<int64_t>(model.edges.points.size()),
                      static_cast<int64_t>(model.points.position.size()));
  };
  const Loops one = loops_of(stacked), other = loops_of(turned);
  EXPECT_GT(one.nodal.stacks.front().count % 2, 0);
  EXPECT_GT(one.nodal.stacks.back().prisms, other.nodal.stacks.back().prisms);
  const auto x = test::positions(stacked, test::State::stretched);
  test::Random random(5);
  std::vector<Vec3> d;
  for (size_t i = 0; i < x.size(); ++i) d.push_back(random.vector());
  const auto a = test::evaluate(one, solid_weights, x), b = test::evaluate(other, solid_weights, x);
  EXPECT_NEAR(a.value, b.value, 1e-12 * std::abs(a.value));
  EXPECT_LE((a.gradient - b.gradient).norm(), 1e-12 * a.gradient.norm());
  const Eigen::VectorXd product = test::hessian_action(one, solid_weights, x, d);
  EXPECT_LE((product - test::hessian_action(other, solid_weights, x, d)).norm(),
            1e-12 * product.norm());
  EXPECT_NEAR(nodal_energy(one.nodal, x), nodal_energy(other.nodal, x), 1e-12 * a.value);
}

/// The model whose λ is at most `max_bulk` times μ, with the same pressures at rest volumes.
model::Model with_less_bulk(model::Model model, double max_bulk) {
  model::Prisms& prisms = model.prisms;
  const bool averaged = !prisms.nodal_modulus.empty();
  for (size_t m = 0; m < prisms.points.size(); ++m) {
    const double before = prisms.modulus[m], shear = prisms.shear_modulus[m];
    const double bulk = averaged ? prisms.nodal_modulus[m] : before - shear;
    const double v0 = prisms.rest_volume[m], less = std::min(bulk, max_bulk * shear);
    prisms.modulus[m] += less - bulk;
    if (averaged) prisms.nodal_modulus[m] = less;
    prisms.target_volume[m] = v0 + (prisms.target_volume[m] - v0) * before / prisms.modulus[m];
  }
  return model;
}

TEST(LimitedBulk, IsThatOfASofterModelAndIsTakenBackBitByBit) {
  const auto loops_of = [](const model::Model& model) {
    return make_loops(model, 0, static_cast<int64_t>(model.prisms.points.size()),
                      static_cast<int64_t>(model.edges.points.size()),
                      static_cast<int64_t>(model.points.position.size()));
  };
  for (const model::Model& model : {test::uneven_solid(), test::averaged_solid()}) {
    const auto x = test::positions(model, test::State::stretched);
    const Loops before = loops_of(model);
    const double largest = largest_bulk(model, before.prisms), limit = 0.4 * largest;
    Loops loops = before;
    limit_bulk(model, limit, loops);
    const Loops softer = loops_of(with_less_bulk(model, limit));
    EXPECT_NEAR(largest_bulk(with_less_bulk(model, limit), softer.prisms), limit, 1e-12 * limit);
    const auto a = test::evaluate(loops, solid_weights, x);
    const auto b = test::evaluate(softer, solid_weights, x);
    EXPECT_LE((a.gradient - b.gradient).norm(), 1e-12 * b.gradient.norm());
    EXPECT_GT((test::evaluate(before, solid_weights, x).gradient - b.gradient).norm(),
              1e-3 * b.gradient.norm());
    EXPECT_EQ(loops.prisms.nodal_modulus.size(), softer.prisms.nodal_modulus.size());
    limit_bulk(model, std::numeric_limits<double>::infinity(), loops);
    EXPECT_EQ(loops.prisms.compliance, before.prisms.compliance);
    EXPECT_EQ(loops.prisms.target_volume, before.prisms.target_volume);
    EXPECT_EQ(loops.prisms.nodal_modulus, before.prisms.nodal_modulus);
    EXPECT_EQ(loops.prisms.shear_modulus, before.prisms.shear_modulus);
    EXPECT_EQ(loops.nodal.stiffness, before.nodal.stiffness);
  }
  Loops none = make_loops({}, 0, 0);
  EXPECT_EQ(largest_bulk({}, none.prisms), 0);
  limit_bulk({}, 1, none);
}

TEST_F(SolidBlock, LimitedSlopesMakeTheHessianSemidefinite) {
  for (const auto& info : test::all_states) {
    if (info.state == test::State::far || info.state == test::State::nearly_coincident) continue;
    SCOPED_TRACE(info.name);
    const model::Model model = test::uneven_solid();
    const Loops loops = make_loops(model, 0, static_cast<int64_t>(model.prisms.points.size()),
                                   static_cast<int64_t>(model.edges.points.size()));
    const auto x = test::positions(model, info.state);
    const std::vector<double> slopes = semidefinite_slopes(loops.prisms, model.points.position, x);
    for (size_t e = 0; e < slopes.size(); ++e) EXPECT_GT(slopes[e], 0);
    const Eigen::MatrixXd matrix =
        test::assemble(loops, weights_, x, Curvature::semidefinite, slopes);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix, Eigen::EigenvaluesOnly);
    const double minimum = solver.eigenvalues()[0] / solver.eigenvalues().tail<1>()[0];
    const bool usual = info.state == test::State::mild || info.state == test::State::stretched;
    EXPECT_GE(minimum, usual ? -1e-5 : -0.03);
  }
}

}  // namespace solid_test
}  // namespace repose::mechanics
