#include "repose/solve/tearing.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "../discrete/models.h"
#include "repose/base/agreement.h"
#include "repose/base/error.h"
#include "repose/model/cut.h"

namespace repose {
namespace tearing_test {

using model::PointSet;

/// A loaded point and one behind it, each held by springs along x; the tensions follow from two
/// linear equations: pulled 4.62 N, spare 1.62 N, deep 12.2 N, stay 1.2 N, back 8.8 N. Without
/// `pulled` they are spare 3 N, deep 8.3 N, stay 0.8 N and back 9.2 N.
model::Model chain() {
  model::Model m;
  const int64_t loaded = testing::add_point(m, {0, 0, 0}, PointSet::soft_tissue, 0);
  const int64_t behind = testing::add_point(m, {-10, 0, 0}, PointSet::soft_tissue, 1);
  const auto spring = [&](int64_t p, int64_t q, double stiffness, double rest_length) {
    testing::add_spring(m, p, q, stiffness, 0);
    m.springs.rest_length.back() = rest_length;
  };
  const auto anchor = [&](double x) {
    return testing::add_point(m, {x, 0, 0}, PointSet::boundary,
                              static_cast<int64_t>(m.points.position.size()));
  };
  spring(loaded, behind, 1, 4);
  spring(loaded, anchor(0), 10, 0);
  spring(behind, anchor(-20), 10, 10);
  spring(behind, anchor(-10), 1, 0);
  spring(behind, anchor(30), 1, 30);
  m.points.external_force[loaded] = {3, 0, 0};
  return m;
}

solve::Settings accurate() {
  solve::Settings settings;
  settings.path.accuracy = 1e-9;
  return settings;
}

solve::Tearing tear(model::Model& model, double limit) {
  return solve::tear(MPI_COMM_WORLD, model, limit, accurate(), {});
}

std::vector<double> stiffness_and_rest(const model::Model& m) {
  std::vector<double> numbers = m.springs.stiffness;
  numbers.insert(numbers.end(), m.springs.rest_length.begin(), m.springs.rest_length.end());
  return numbers;
}

bool on_first() { return base::rank(MPI_COMM_WORLD) == 0; }

TEST(Tearing, GoesOnFromWhatHasTorn) {
  model::Model m = chain();
  const solve::Tearing result = tear(m, 4);
  EXPECT_TRUE(result.settled);
  EXPECT_TRUE(result.torn);
  EXPECT_EQ(result.rounds, 3) << "pulled; then deep and back, which no force touches; then none";
  if (!on_first()) return;
  EXPECT_EQ(result.springs, 3);
  EXPECT_EQ(stiffness_and_rest(m), (std::vector<double>{10, 1, 0, 0})) << "spare and stay are left";
  EXPECT_NEAR(result.largest, 3, 1e-6);
  EXPECT_NEAR(result.length, 25, 1e-12) << "middles at x = -5, -15 and 10";
}

TEST(Tearing, LeavesWhatNoForceTouches) {
  model::Model m = chain();
  const solve::Tearing result = tear(m, 5);
  EXPECT_TRUE(result.settled);
  EXPECT_FALSE(result.torn);
  EXPECT_EQ(result.rounds, 1);
  EXPECT_TRUE(result.position.empty());
  if (!on_first()) return;
  EXPECT_EQ(stiffness_and_rest(m), stiffness_and_rest(chain()));
  EXPECT_NEAR(result.largest, 656. / 142, 1e-6);
}

TEST(Tearing, RefusesToTearAPointOff) {
  model::Model m = chain();
  try {
    tear(m, 2);
    FAIL() << "point 0 is torn off";
  } catch (const base::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("tearing at 2 N, round 2: point 0 at (0, 0, 0) mm"),
              std::string::npos)
        << error.what();
  }
}

TEST(Tearing, DoesNothingWithoutALimit) {
  model::Model m = chain();
  const solve::Tearing result = solve::tear(MPI_COMM_WORLD, m, {}, accurate(), {});
  EXPECT_EQ(result.rounds, 0);
  EXPECT_TRUE(result.settled);
}

/// A block of 3 × 3 columns in three layers: 18 springs sideways a layer, 8 triangles.
model::Model small_block() {
  model::Model m = testing::block(
      3, 3, 3, 0, [](int, int, int a) { return a == 2 ? PointSet::bone : PointSet::soft_tissue; });
  for (const auto& prism : m.prisms.points)
    if (m.points.layer[prism[0]] == 0) m.skin.push_back({prism[0], prism[2], prism[1]});
  return m;
}

/// Removes the spring between two points; returns all that is torn with it.
model::Tear without(model::Model& m, int64_t p, int64_t q) {
  std::vector<char> torn(m.springs.points.size(), 0);
  for (size_t j = 0; j < torn.size(); ++j) {
    const auto [a, b] = m.springs.points[j];
    torn[j] = (a == p && b == q) || (a == q && b == p);
  }
  EXPECT_EQ(std::count(torn.begin(), torn.end(), 1), 1);
  return model::remove_springs(torn, "test", m);
}

TEST(TornSpring, TakesThePrismsAndTrianglesThatHaveItForAnEdge) {
  const model::Model whole = small_block();
  const int64_t middle = 4 * 3, side = 5 * 3, layers_prisms = 8;
  model::Model m = whole;
  model::Tear gone = without(m, middle, side);
  EXPECT_EQ(gone.triangles, 2) << "an inner edge of the skin has two";
  EXPECT_EQ(gone.prisms, 2);
  EXPECT_EQ(m.springs.points.size(), whole.springs.points.size() - 1);
  m = whole;
  gone = without(m, middle + 1, side + 1);
  EXPECT_EQ(gone.triangles, 0);
  EXPECT_EQ(gone.prisms, 4) << "two above, two below";
  m = whole;
  gone = without(m, middle, middle + 1);
  EXPECT_EQ(gone.triangles, 0);
  EXPECT_EQ(gone.prisms, 6) << "those around the column";
  m = whole;
  gone = without(m, middle, side + 1);
  EXPECT_EQ(gone.prisms + gone.triangles, 0) << "a diagonal is no edge of a prism";
  EXPECT_EQ(m.prisms.points.size(), 2 * layers_prisms);
}

}  // namespace tearing_test
}  // namespace repose
