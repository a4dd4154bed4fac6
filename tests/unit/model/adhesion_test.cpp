#include <gtest/gtest.h>

#include "model/add_adhesion.h"
#include "patches.h"

namespace repose::model {
namespace adhesion_test {

/// The upper incisors as a box whose labial side is the plane y = 0; behind the lip at `deepest`
/// ends a column.
TermElements adhesion_at(const Vec3& deepest) {
  scene::AnatomyPlan plan;
  plan.landmarks = {{"upper_incisor_edge", Vec3(0, 0, 0)},
                    {"lower_incisor_edge", Vec3(0, 2, -1)},
                    {"mouth_right", Vec3(-25, -8, -2)},
                    {"stomion", Vec3(0, -12, -2)},
                    {"mouth_left", Vec3(25, -8, -2)}};
  Piece piece;
  piece.column = {0};
  piece.parted = {0};
  piece.jaws = {{true, 0}};
  Model model;
  model.points.position = {deepest - Vec3(0, 10, 0), deepest};
  model.contact.pairs.point = {1};
  model.contact.pairs.body = {0};
  model.contact.pairs.area = {4};
  model.contact.pairs.binding = {Binding::touches};
  add_adhesion(plan, {patches::box(Vec3(-20, 0, 0), Vec3(20, 10, 15))}, piece, model);
  return model.elements.front();
}

TEST(Adhesion, PullsOffTheToothsSurface) {
  const TermElements elements = adhesion_at({3, -1, 5});
  ASSERT_EQ(elements.size(), 1u);
  EXPECT_NEAR(elements.numbers_of(0)[1], -1, 1e-12);
}

TEST(Adhesion, APointOnATriangleHasNoDirectionAndDoesNotAdhere) {
  for (const double off : {0.0, -1e-15, 1e-15, -1e-9})
    EXPECT_EQ(adhesion_at({3, off, 5}).size(), 0u);
}

}  // namespace adhesion_test
}  // namespace repose::model
