#include <gtest/gtest.h>

#include "repose/solve/sensitivity.h"
#include "rest.h"
#include "solid_block.h"

/// First-order changes against the changed model solved.
namespace repose {
namespace sensitivity_test {

using model::PointSet;
using testing::Rest;

constexpr int columns = 9, rows = 7, layers = 4;

/// A solid whose depth is held and whose ends go apart; the ends' skin may be free.
model::Model stretched(double travel, bool free_skin = false) {
  model::Model m = testing::solid_block(columns, rows, layers, 0.45, 0.3, [](int i, int, int a) {
    const bool end = i == 0 || i == columns - 1;
    return a == layers - 1 || (end && a > 0) ? PointSet::held : PointSet::soft_tissue;
  });
  for (size_t i = 0; i < m.points.set.size() && !free_skin; ++i) {
    const int64_t column = m.points.column[i] % columns;
    if (column == 0 || column == columns - 1) m.points.set[i] = PointSet::held;
  }
  testing::aim(m, [&](const Vec3& x) -> Vec3 {
    return x + travel * Vec3(x.x() > 25 ? 1 : 0, 0.2 * x.z(), 0.1);
  });
  return m;
}

/// The skin above z = −3 slides on a plane that is tilted more or less.
model::Model pressed(double push) {
  model::Model m = stretched(1.0);
  m.contact.bodies.push_back(
      {"plane", -1, scene::HalfSpace{{0, 0, 0.2}, {0, 0.05, -1}}, {0, 0, -push}});
  testing::add_touching_points(m, 25);
  m.contact.stiffness = 0.05;
  return m;
}

solve::RestState rest_state(const Rest& rest) {
  solve::RestState state{rest.rows.position, {}};
  for (const model::PointField& field : rest.rows.point_fields)
    if (field.name == "contact_pressure") state.pressure = field.values;
  return state;
}

/// The largest error of the first-order change over the largest change.
double error_of_change(const model::Model& m, const model::Model& other) {
  const solve::Settings settings = testing::settings(1e-7);
  const Rest before = testing::find_rest(m, settings), after = testing::find_rest(other, settings);
  EXPECT_TRUE(before.summary.path.complete() && after.summary.path.complete());
  const std::vector<Vec3> change =
      solve::first_order_change(MPI_COMM_WORLD, other, settings.weights, rest_state(before));
  double error = 0, largest = 0;
  for (size_t i = 0; i < change.size(); ++i) {
    const Vec3 exact = after.rows.position[i] - before.rows.position[i];
    largest = std::max(largest, exact.norm());
    error = std::max(error, (change[i] - exact).norm());
  }
  const bool first = base::rank(MPI_COMM_WORLD) == 0;
  EXPECT_EQ(change.size(), first ? m.points.position.size() : 0);
  EXPECT_TRUE(!first || largest > 1e-4) << largest;
  return first ? error / largest : 0;
}

TEST(Sensitivity, OfAStifferHalfIsTheChangedModelsRestPosition) {
  const model::Model m = stretched(2);
  model::Model other = m;
  model::Prisms& prisms = other.prisms;
  for (size_t p = 0; p < prisms.points.size(); p += 2) {
    prisms.shear_modulus[p] *= 1.02;
    prisms.modulus[p] *= 1.02;
  }
  model::assemble_edges("block", other);
  EXPECT_LE(error_of_change(m, other), 0.03);
}

TEST(Sensitivity, OfPointsHeldElsewhereIsTheirWay) {
  EXPECT_LE(error_of_change(stretched(2), stretched(2.02)), 0.02);
}

TEST(Sensitivity, OfPointsLetGoIsWhereTheirForcesTakeThem) {
  EXPECT_LE(error_of_change(stretched(0.05), stretched(0.05, true)), 0.05);
}

TEST(Sensitivity, OfPointsHeldAnewIsTheWayBack) {
  EXPECT_LE(error_of_change(stretched(0.05, true), stretched(0.05)), 0.05);
}

TEST(Sensitivity, KeepsWhatPressesPressing) {
  EXPECT_LE(error_of_change(pressed(1), pressed(1.01)), 0.1);
}

}  // namespace sensitivity_test
}  // namespace repose
