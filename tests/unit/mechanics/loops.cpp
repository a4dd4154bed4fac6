#include "repose/mechanics/loops.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "states.h"

namespace repose::mechanics {
namespace loops_test {

using model::PointSet;

int64_t count(const auto& rows) { return static_cast<int64_t>(rows.size()); }

/// Counts those of the first `owned` elements that have a soft-tissue point and satisfy
/// `requested`.
template <class Elements, class Wanted>
int64_t soft(const model::Model& model, const Elements& elements, int64_t owned,
             Wanted&& requested) {
  int64_t n = 0;
  for (int64_t e = 0; e < owned; ++e)
    if (requested(e) && std::any_of(elements[e].begin(), elements[e].end(), [&](int64_t i) {
          return model.points.set[i] == PointSet::soft_tissue;
        }))
      ++n;
  return n;
}

/// The deepest two layers fixed, one column of them held by hand.
model::Model half_fixed_patch() {
  model::Model model = test::uneven_patch();
  for (size_t i = 0; i < model.points.set.size(); ++i)
    if (model.points.layer[i] == 1)
      model.points.set[i] = model.points.column[i] == 0 ? PointSet::held : PointSet::boundary;
  return model;
}

TEST(Loops, PatchHasTheSpringsOfTheModel) {
  const model::Model model = test::layered_patch({});
  constexpr int64_t v = 12, f = 12, e = 23, n = 3;
  EXPECT_EQ(v - e + f, 1);
  EXPECT_EQ(count(model.springs.points), n * e + (n - 1) * (v + 2 * e));
  EXPECT_EQ(count(model.prisms.points), f * (n - 1));
  EXPECT_GT(*std::min_element(model.prisms.rest_volume.begin(), model.prisms.rest_volume.end()), 0);
}

TEST(Loops, ElementsWithoutSoftTissueAreLeftOut) {
  const model::Model model = half_fixed_patch();
  const int64_t springs = count(model.springs.points), prisms = count(model.prisms.points);
  const Loops loops = make_loops(model, springs, prisms);
  ASSERT_EQ(loops.springs.size(), 3u);
  for (int p = 0; p <= 2; ++p) {
    const SpringLoop& loop = loops.springs[p];
    EXPECT_EQ(loop.exponent, p);
    EXPECT_EQ(loop.size(), soft(model, model.springs.points, springs,
                                [&](int64_t e) { return model.springs.exponent[e] == p; }));
    EXPECT_EQ(loop.counted, loop.size());
    for (const auto& [i, j] : loop.points)
      EXPECT_EQ(std::min(model.points.layer[i], model.points.layer[j]), 0);
  }
  EXPECT_EQ(loops.prisms.size(), prisms / 2);
  EXPECT_EQ(loops.prisms.counted, prisms / 2);
}

TEST(Loops, OnlyOwnedRowsAreCounted) {
  const model::Model model = half_fixed_patch();
  const int64_t prisms = count(model.prisms.points);
  for (int64_t owned : {0, 1, 20, 50}) {
    const Loops loops = make_loops(model, owned, std::min<int64_t>(owned, 7));
    for (const SpringLoop& loop : loops.springs)
      EXPECT_EQ(loop.counted, soft(model, model.springs.points, owned, [&](int64_t e) {
                  return model.springs.exponent[e] == loop.exponent;
                }));
    EXPECT_EQ(loops.prisms.size(), prisms / 2);
    EXPECT_EQ(loops.prisms.counted, std::min<int64_t>(owned, 7));
  }
}

TEST(Loops, CarryWhatTheModelSaysOfEachElement) {
  const model::Model model = test::uneven_patch();
  const Loops loops = make_loops(model, count(model.springs.points), count(model.prisms.points));
  int64_t found = 0;
  for (const SpringLoop& loop : loops.springs)
    for (int64_t e = 0; e < loop.size(); ++e)
      for (size_t row = 0; row < model.springs.points.size(); ++row) {
        const auto& [i, j] = model.springs.points[row];
        if (i != loop.points[e][0] || j != loop.points[e][1]) continue;
        ++found;
        EXPECT_EQ(model.springs.exponent[row], loop.exponent);
        EXPECT_EQ(model.springs.stiffness[row], loop.stiffness[e]);
        EXPECT_EQ(model.springs.rest_length[row], loop.rest_length[e]);
        EXPECT_DOUBLE_EQ(model.springs.reference[row] * loop.inverse_reference[e], 1.0);
      }
  EXPECT_EQ(found, loops.springs[0].size() + loops.springs[1].size() + loops.springs[2].size());
  ASSERT_EQ(loops.prisms.size(), count(model.prisms.points));
  for (int64_t e = 0; e < loops.prisms.size(); ++e) {
    const int64_t row = loops.prisms.row[e];
    EXPECT_EQ(loops.prisms.rest_volume[e], model.prisms.rest_volume[row]);
    EXPECT_TRUE(std::equal(loops.prisms.points[e].begin(), loops.prisms.points[e].end(),
                           model.prisms.points[row].begin()));
  }
}

TEST(Loops, NothingSoftMeansNothingToDo) {
  model::Model model = test::uneven_patch();
  std::fill(model.points.set.begin(), model.points.set.end(), PointSet::boundary);
  const Loops loops = make_loops(model, count(model.springs.points), count(model.prisms.points));
  EXPECT_TRUE(loops.springs.empty());
  EXPECT_EQ(loops.prisms.size(), 0);
}

TEST(Loops, AnEmptyPartIsAllowed) {
  const Loops loops = make_loops({}, 0, 0);
  EXPECT_TRUE(loops.springs.empty());
  EXPECT_EQ(loops.prisms.size(), 0);
}

}  // namespace loops_test
}  // namespace repose::mechanics
