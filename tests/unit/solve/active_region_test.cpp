#include "solve/active_region.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "check/recompute.h"
#include "models.h"
#include "repose/base/agreement.h"
#include "repose/base/error.h"
#include "repose/solve/active_search.h"
#include "rest.h"

namespace repose {
namespace {

using model::PointSet;
using solve::Extent;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// A strip of tissue on two bones, of which the one under the first columns is lifted and pushed.
model::Model strip(int columns = 50) {
  model::Model m = testing::block(columns, 5, 4, 2, [](int, int, int layer) {
    return layer == 3 ? PointSet::bone : PointSet::soft_tissue;
  });
  m.bones = {"rest", "chin"};
  for (size_t i = 0; i < m.points.set.size(); ++i) {
    if (m.points.set[i] != PointSet::bone || m.points.position[i].x() > 17) continue;
    m.points.bone[i] = 1;
    m.points.target[i] += Vec3(-1, 0.5, 1);
  }
  return m;
}

solve::Settings wanted(Extent extent, double accuracy = 0.01) {
  solve::Settings settings;
  settings.weights = {1, mechanics::VolumeTerm::penalty, 0.5};
  settings.path.accuracy = accuracy;
  settings.extent = extent;
  return settings;
}

double apart(const std::vector<Vec3>& one, const std::vector<Vec3>& other) {
  double largest = 0;
  for (size_t i = 0; i < one.size(); ++i) largest = std::max(largest, (one[i] - other[i]).norm());
  return largest;
}

TEST(ActiveRegion, counts_thicknesses_from_what_moves) {
  const model::Model m = strip();
  const solve::ActiveRegion region(m, solve::initial_forces(m));
  EXPECT_EQ(region.uneasy(), 0);
  EXPECT_EQ(region.moved(), 5 * 5);  // four columns on the bone and one beside them
  EXPECT_EQ(region.columns(1e-9), 5 * 5);
  EXPECT_EQ(region.columns(5.0 / 9 + 1e-9), 5 * 6);  // 5 mm further, 9 mm thick
  EXPECT_NEAR(region.largest(), 45 * 5.0 / 9, 1e-9);
  EXPECT_EQ(region.columns(infinity), 250);
}

TEST(ActiveRegion, begins_where_the_tissue_is_not_at_rest) {
  model::Model m = strip();
  m.points.external_force[4 * 40] = {0, 0, 1e-6};
  const std::vector<Vec3> force = solve::initial_forces(m);
  EXPECT_EQ(force[4 * 40], Vec3(0, 0, 1e-6));
  const solve::ActiveRegion region(m, force);
  EXPECT_EQ(region.uneasy(), 1);
  const std::vector<char> near = region.points(0, 1e-9);
  EXPECT_TRUE(near[4 * 40] && near[4 * 40 + 2]);
  EXPECT_FALSE(near[4 * 40 + 3]) << "a bone point is not an unknown";
  EXPECT_FALSE(near[4 * 41]);
}

TEST(ActiveRegion, a_submodel_has_all_that_its_unknowns_feel) {
  const model::Model m = strip();
  const solve::ActiveRegion region(m, solve::initial_forces(m));
  const std::vector<char> unknown = region.points(0, 3);
  const solve::Submodel part = solve::submodel(m, unknown);
  EXPECT_EQ(model::count(part.model).soft, std::count(unknown.begin(), unknown.end(), 1));
  EXPECT_LT(part.point_row.size(), m.points.set.size() / 2);
  const auto touching = [&](const auto& elements) {
    return std::count_if(elements.begin(), elements.end(), [&](const auto& e) {
      return std::any_of(e.begin(), e.end(), [&](int64_t i) { return unknown[i] != 0; });
    });
  };
  EXPECT_EQ(model::count(part.model).springs, touching(m.springs.points));
  EXPECT_EQ(model::count(part.model).prisms, touching(m.prisms.points));
  for (size_t k = 0; k < part.point_row.size(); ++k) {
    const int64_t row = part.point_row[k];
    EXPECT_EQ(part.model.points.position[k], m.points.position[row]);
    EXPECT_EQ(part.model.points.target[k], m.points.target[row]);
    EXPECT_EQ(part.model.points.set[k] == PointSet::soft_tissue, unknown[row] != 0);
  }
  model::validate(part.model, "the submodel");
}

TEST(ActiveSearch, the_answer_is_as_near_as_it_says) {
  const model::Model m = strip();
  const testing::Rest exact = testing::find_rest(m, wanted(Extent::whole, 1e-9));
  for (const double accuracy : {0.1, 0.001}) {
    const testing::Rest found = testing::find_rest(m, wanted(Extent::region, accuracy));
    ASSERT_TRUE(found.summary.region);
    EXPECT_TRUE(found.summary.path.complete());
    EXPECT_LE(found.summary.last.displacement_error, accuracy);
    EXPECT_GT(found.summary.region->error, 0);
    EXPECT_LT(found.summary.unknowns, exact.summary.unknowns);
    EXPECT_LE(apart(found.rows.position, exact.rows.position),
              found.summary.last.displacement_error);
  }
}

TEST(ActiveSearch, grows_where_tissue_carries_further) {
  model::Model m = strip();
  for (size_t j = 0; j < m.springs.points.size(); ++j)
    if (m.points.layer[m.springs.points[j][0]] == 0 && m.points.layer[m.springs.points[j][1]] == 0)
      m.springs.stiffness[j] *= 30;
  const testing::Rest exact = testing::find_rest(m, wanted(Extent::whole, 1e-9));
  const testing::Rest found = testing::find_rest(m, wanted(Extent::region));
  ASSERT_TRUE(found.summary.region);
  EXPECT_GT(found.summary.region->rounds, 1);
  EXPECT_LT(found.summary.region->active, found.summary.region->columns);
  EXPECT_TRUE(found.summary.path.complete());
  EXPECT_LE(found.summary.last.displacement_error, 0.01);
  EXPECT_LE(apart(found.rows.position, exact.rows.position), found.summary.last.displacement_error);
}

TEST(ActiveSearch, a_step_is_one_of_the_whole_model) {
  const model::Model m = strip();
  const testing::Rest found = testing::find_rest(m, wanted(Extent::region));
  ASSERT_EQ(found.rows.position.size(), m.points.position.size());
  const check::RecomputedStep again = check::recompute(m, found.summary.last, found.rows);
  double held = 0;
  for (size_t i = 0; i < m.points.position.size(); ++i) {
    EXPECT_LE((again.rows.residual_force[i] - found.rows.residual_force[i]).norm(), 1e-12);
    if (found.rows.position[i] == m.points.position[i])
      held = std::max(held, found.rows.residual_force[i].norm());
  }
  EXPECT_GT(held, 1e-9) << "the border is not free of force";
  EXPECT_NEAR(again.gradient_max.value, found.summary.last.gradient_max, 1e-12);
  EXPECT_NEAR(again.objective.value, found.summary.last.objective, 1e-9);
  EXPECT_NEAR(found.summary.region->force, held, 0.5 * held);  // that of springs alone
}

TEST(ActiveSearch, a_region_may_be_the_whole) {
  const model::Model m = strip(8);
  const testing::Rest exact = testing::find_rest(m, wanted(Extent::whole, 1e-9));
  const testing::Rest found = testing::find_rest(m, wanted(Extent::region, 1e-9));
  ASSERT_TRUE(found.summary.region);
  EXPECT_EQ(found.summary.region->error, 0);
  EXPECT_EQ(found.summary.region->active, 40);
  EXPECT_LE(apart(found.rows.position, exact.rows.position), 1e-9);
}

TEST(ActiveSearch, takes_up_a_guess) {
  const model::Model m = strip();
  const testing::Rest exact = testing::find_rest(m, wanted(Extent::whole, 1e-6));
  base::Stages stages(MPI_COMM_WORLD);
  const solve::Start start{base::scatter(MPI_COMM_WORLD, exact.rows.position), true};
  const solve::Summary summary =
      solve::find_repose(MPI_COMM_WORLD, m, wanted(Extent::region), start, stages,
                         [](const model::StepNumbers&, const model::StepRows&) {});
  ASSERT_TRUE(summary.region);
  EXPECT_TRUE(summary.path.leapt);
  EXPECT_TRUE(summary.path.complete());
  EXPECT_LE(summary.path.iterations, 2);
}

TEST(ActiveSearch, automatic_leaves_small_and_resting_models_alone) {
  EXPECT_FALSE(testing::find_rest(strip(), wanted(Extent::automatic)).summary.region);
  model::Model m = strip();
  m.points.target = m.points.position;
  EXPECT_FALSE(testing::find_rest(m, wanted(Extent::region)).summary.region);
}

TEST(ActiveSearch, refuses_tissue_that_is_not_at_rest) {
  model::Model m = strip();
  m.gravity = {0, 0, -9.80665};
  std::fill(m.points.mass.begin(), m.points.mass.end(), 1e-6);
  EXPECT_THROW(testing::find_rest(m, wanted(Extent::region)), base::InputError);
}

TEST(ActiveSearch, says_what_it_does_and_why) {
  const auto chosen = [](Extent extent) {
    return solve::choose_region(PETSC_COMM_WORLD, strip(), wanted(extent));
  };
  EXPECT_FALSE(chosen(Extent::whole).part);
  EXPECT_FALSE(chosen(Extent::automatic).part);  // a small model
  EXPECT_TRUE(chosen(Extent::region).part);
}

}  // namespace
}  // namespace repose
