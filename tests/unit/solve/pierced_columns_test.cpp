#include <gtest/gtest.h>

#include "../model/patches.h"
#include "rest.h"
#include "solid_block.h"

/// Columns that bone enters between their points.
namespace repose {
namespace pierced_columns_test {

using model::PointSet;

/// A block of 7 × 9 columns, 5 mm apart, of layers 3 mm apart, only whose skin is free; a plate of
/// 16 × 16 × 2.8 mm, thinner than a layer, goes in by its motion between the two deepest layers. A
/// corner of the skin is moved, too, because a path is followed only where a point moves.
solve::PiercedColumns push_plate(double start, double motion) {
  model::Model m = testing::solid_block(7, 9, 4, 0.45, 0, [](int i, int j, int a) {
    if (i + j + a == 0) return PointSet::held;
    return a == 0 ? PointSet::soft_tissue : PointSet::boundary;
  });
  m.points.target[0] += Vec3(0.1, 0, 0);
  m.bones = {"plate"};
  m.bone_surfaces = {model::patches::box({7 + start, 12, -8.9}, {23 + start, 28, -6.1})};
  m.bone_transform = {scene::RigidMotion::translation({motion, 0, 0}).matrix()};
  m.contact.bodies.push_back({"plate", 0});
  m.contact.spacing = 0.25;
  m.contact.stiffness = 0.05;
  for (size_t i = 0; i < m.points.position.size(); ++i) {
    if (m.points.set[i] != PointSet::soft_tissue) continue;
    m.contact.pairs.point.push_back(static_cast<int64_t>(i));
    m.contact.pairs.body.push_back(0);
    m.contact.pairs.binding.push_back(model::Binding::touches);
    m.contact.pairs.area.push_back(25);
  }
  return testing::find_rest(m, testing::settings(1e-3)).summary.pierced;
}

TEST(PiercedColumns, APlateBetweenTheDeepestPointsIsFound) {
  const solve::PiercedColumns pierced = push_plate(-60, 60);
  EXPECT_EQ(pierced.columns, 9);
  EXPECT_EQ(pierced.body, 0);
  EXPECT_NEAR(pierced.depth, 1.4 - 0.11, 0.03);  // the grid rounds the ridge of distances
  EXPECT_NEAR(pierced.where.z(), -7.5, 1e-6);
}

TEST(PiercedColumns, APlateBesideTheBlockOrThereFromTheStartIsNot) {
  EXPECT_EQ(push_plate(-60, 5).columns, 0);
  EXPECT_EQ(push_plate(0, 0.5).columns, 0);
}

}  // namespace pierced_columns_test
}  // namespace repose
