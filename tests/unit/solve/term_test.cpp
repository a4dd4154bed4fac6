#include <gtest/gtest.h>

#include "repose/base/error.h"
#include "repose/base/options.h"
#include "repose/mechanics/term.h"
#include "rest.h"
#include "solid_block.h"

/// Models with elements of a further term, solved on the ranks of the test.
namespace repose {
namespace term_test {

using model::PointSet;
using testing::find_rest;
using testing::settings;

/// An edge of a solid.
struct Tie {
  static constexpr int points = 2, numbers = 1;
  template <class Number>
  static Number energy(const mechanics::Corners<Number, points>& x, std::span<const double> n) {
    return n[0] / 2 * (x[1] - x[0]).squaredNorm();
  }
};

struct Pressure {
  static constexpr int points = 3, numbers = 1;
  template <class Number>
  static Number energy(const mechanics::Corners<Number, points>& x, std::span<const double> n) {
    return n[0] / 6 * x[0].dot(x[1].cross(x[2]));
  }
};

/// A block of 5 × 4 columns on a base that is drawn sideways; `tie` joins points far apart in it.
model::Model drawn_block() {
  model::Model m = testing::solid_block(5, 4, 4, 0.45, 0.02, [](int, int, int layer) {
    return layer == 3 ? PointSet::held : PointSet::soft_tissue;
  });
  for (size_t i = 0; i < m.points.target.size(); ++i)
    if (m.points.set[i] == PointSet::held) m.points.target[i] += Vec3(0.3, 0.1, 0);
  return m;
}

const std::vector<std::array<int64_t, 2>> pairs = {{0, 78}, {1, 40}, {76, 4}, {33, 34}};

TEST(FurtherTerms, AnEdgeWrittenAsOneComesToTheSameFace) {
  mechanics::add_term<Tie>("tie");
  constexpr double weight = 0.01;
  model::Model as_edges = drawn_block(), as_elements = as_edges;
  model::TermElements ties{"tie", 2, 1, {}, {}};
  for (const auto& pair : pairs) {
    as_edges.edges.points.push_back(pair);
    as_edges.edges.weight.push_back(weight);
    ties.points.insert(ties.points.end(), pair.begin(), pair.end());
    ties.numbers.push_back(weight);
  }
  as_elements.elements.push_back(ties);
  const auto edges = find_rest(as_edges, settings(1e-7));
  const auto elements = find_rest(as_elements, settings(1e-7));
  const auto without = find_rest(drawn_block(), settings(1e-7));
  ASSERT_TRUE(edges.summary.path.complete() && elements.summary.path.complete());
  double apart = 0, matters = 0;
  for (size_t i = 0; i < edges.rows.position.size(); ++i) {
    apart = std::max(apart, (edges.rows.position[i] - elements.rows.position[i]).norm());
    matters = std::max(matters, (edges.rows.position[i] - without.rows.position[i]).norm());
  }
  EXPECT_LE(apart, 2e-7);
  EXPECT_GE(matters, 0.01);
  EXPECT_NEAR(edges.summary.last.objective, elements.summary.last.objective,
              1e-9 * std::abs(edges.summary.last.objective));
  EXPECT_NEAR(edges.summary.last.f_e, elements.summary.last.f_e,
              1e-9 * std::abs(edges.summary.last.f_e));
}

TEST(FurtherTerms, WhatIsNotConvexIsMinimizedByNewtonsMethodToo) {
  mechanics::add_term<Pressure>("pressure");
  model::Model m = drawn_block();
  model::TermElements pressed{"pressure", 3, 1, {}, {}};
  for (const auto& prism : m.prisms.points)
    if (m.points.layer[prism[0]] == 0) {
      pressed.points.insert(pressed.points.end(), prism.begin(), prism.begin() + 3);
      pressed.numbers.push_back(1e-3);
    }
  ASSERT_FALSE(pressed.numbers.empty());
  m.elements.push_back(pressed);
  const auto by_default = find_rest(m, settings(1e-6));
  ASSERT_TRUE(by_default.summary.path.complete());
  base::ScopedOption newton("-tao_type", "ntr");
  const auto by_newton = find_rest(m, settings(1e-6));
  ASSERT_TRUE(by_newton.summary.path.complete());
  for (size_t i = 0; i < by_newton.rows.position.size(); ++i)
    EXPECT_LE((by_newton.rows.position[i] - by_default.rows.position[i]).norm(), 2e-6);
}

TEST(FurtherTerms, TheForceFunctionalRefusesThem) {
  mechanics::add_term<Tie>("tie");
  model::Model m = drawn_block();
  m.elements.push_back({"tie", 2, 1, {0, 1}, {1.0}});
  solve::Settings force = settings(1e-3);
  force.functional = scene::Functional::force;
  EXPECT_THROW(find_rest(m, force), base::InputError);
}

}  // namespace term_test
}  // namespace repose
