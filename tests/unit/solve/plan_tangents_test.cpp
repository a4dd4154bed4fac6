#include <gtest/gtest.h>

#include "rest.h"
#include "solid_block.h"

/// Derivatives by the motion of a piece, against differences of rest positions.
namespace repose {
namespace {

using model::PointSet;

constexpr int columns = 9, rows = 6, layers = 4;
const Vec3 centroid(0, 12, -5);  // mm, of the piece

/// A solid whose depth is held and one end of which a piece of bone carries.
model::Model carried(const scene::Placement& placement) {
  model::Model m = testing::solid_block(columns, rows, layers, 0.45, 0.3, [](int i, int, int a) {
    return i == 0 ? PointSet::bone : a == layers - 1 ? PointSet::boundary : PointSet::soft_tissue;
  });
  const scene::RigidMotion motion = scene::motion_of(placement, centroid);
  m.bones = {"piece"};
  m.bone_surfaces.resize(1);
  m.bone_transform = {motion.matrix()};
  for (size_t i = 0; i < m.points.position.size(); ++i) {
    if (m.points.set[i] != PointSet::bone) continue;
    m.points.bone[i] = 0;
    m.points.target[i] = motion.apply(m.points.position[i]);
  }
  return m;
}

std::vector<Vec3> rest_at(const scene::Placement& placement) {
  return testing::find_rest(carried(placement), testing::settings(1e-8)).rows.position;
}

TEST(PlanTangents, AreTheDifferencesOfRestPositions) {
  constexpr double step = 1e-3;  // mm, degrees
  const scene::Placement at{{0.5, -1, 0.3}, {4, -2, 6}};
  solve::Settings settings = testing::settings(1e-8);
  settings.tangents = {{0, centroid, at}};
  const testing::Rest rest = testing::find_rest(carried(at), settings);
  std::vector<model::PointField> fields;
  for (const model::PointField& field : rest.rows.point_fields)
    if (field.name.starts_with("tangent_0_")) fields.push_back(field);
  ASSERT_EQ(fields.size(), 6);
  EXPECT_EQ(fields[0].name, "tangent_0_tx");
  EXPECT_EQ(fields[5].name, "tangent_0_rz");
  for (int c = 0; c < 6; ++c) {
    scene::Placement before = at, after = at;
    (c < 3 ? before.translation : before.rotation)[c % 3] -= step;
    (c < 3 ? after.translation : after.rotation)[c % 3] += step;
    const std::vector<Vec3> from = rest_at(before), to = rest_at(after);
    double error = 0, largest = 0;
    for (size_t i = 0; i < from.size(); ++i) {
      const Vec3 difference = (to[i] - from[i]) / (2 * step);
      const Vec3 tangent = Vec3::Map(&fields[c].values[3 * i]);
      largest = std::max(largest, difference.norm());
      error = std::max(error, (tangent - difference).norm());
    }
    EXPECT_GT(largest, c < 3 ? 0.9 : 0.05);
    EXPECT_LT(error, 1e-3 * largest) << fields[c].name;
  }
}

}  // namespace
}  // namespace repose
