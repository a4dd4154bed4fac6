#include "repose/adapt/given_skin.h"

#include <gtest/gtest.h>

#include <map>

#include "../../layered_patch.h"

namespace repose::adapt {
namespace given_skin_test {

TEST(GivenSkin, follows_an_affine_motion_and_fades_beyond_the_rim) {
  const test::PatchSize size{
      .columns_x = 13, .columns_y = 9, .layers = 3, .spacing = 4, .thickness = 3};
  surface::Surface skin{"skin", {}, test::patch_skin(size).triangles};
  for (int64_t c = 0; c < size.columns_x * size.columns_y; ++c)
    skin.points.push_back({4.0 * static_cast<double>(c % size.columns_x),
                           4.0 * static_cast<double>(c / size.columns_x), 0});
  const auto motion = [](const Vec3& x) -> Vec3 {
    return {1 + 0.1 * x.y(), 0.2 * x.x() - 3, 0.05 * x.x() + 2};
  };
  std::vector<Vec3> displacement;
  for (const Vec3& point : skin.points) displacement.push_back(motion(point));
  const surface::Surface given{
      "given",
      {{20, 16, 0}, {21.3, 14.9, 0.4}, {30, 7, -1}, {58, 16, 0}, {70, 16, 0}},
      {{0, 1, 2}, {2, 3, 4}}};
  const surface::PointData data = displacement_of_given(given, skin, displacement);
  ASSERT_EQ(data.vectors.size(), 1u);
  const std::vector<Vec3>& carried = data.vectors[0].values;
  ASSERT_EQ(carried.size(), given.points.size());
  for (int p = 0; p < 3; ++p) {
    EXPECT_LT((carried[p] - motion(given.points[p])).norm(), 0.05) << p;
    EXPECT_EQ(data.fields[0].values[p], 1);
  }
  EXPECT_NEAR(data.fields[0].values[3], 0.5, 1e-9);  // 10 mm of 20 beyond the rim
  EXPECT_LT((carried[3] - 0.5 * motion({48, 16, 0})).norm(), 0.7);
  EXPECT_EQ(data.fields[0].values[4], 0);
  EXPECT_EQ(carried[4], Vec3::Zero());
}

/// A flat skin of 4 mm squares, slit along y = 16 from x = 16 to x = 36.
surface::Surface slit_skin() {
  const test::PatchSize size{.columns_x = 13, .columns_y = 9};
  surface::Surface skin{"skin", {}, test::patch_skin(size).triangles};
  for (int y = 0; y < 9; ++y)
    for (int x = 0; x < 13; ++x) skin.points.push_back({4.0 * x, 4.0 * y, 0});
  std::map<int64_t, int64_t> twin;
  for (size_t p = 0, count = skin.points.size(); p < count; ++p) {
    const Vec3 at = skin.points[p];
    if (at.y() != 16 || at.x() < 18 || at.x() > 34) continue;
    twin[static_cast<int64_t>(p)] = static_cast<int64_t>(skin.points.size());
    skin.points.push_back(at);
  }
  for (Triangle& t : skin.triangles) {
    const double middle =
        (skin.points[t[0]].y() + skin.points[t[1]].y() + skin.points[t[2]].y()) / 3;
    for (int64_t& p : t)
      if (middle > 16 && twin.contains(p)) p = twin[p];
  }
  return skin;
}

TEST(GivenSkin, parts_where_the_solved_skin_does) {
  const surface::Surface skin = slit_skin();
  ASSERT_EQ(skin.points.size(), 13 * 9 + 4u);
  std::vector<Vec3> displacement(skin.points.size(), Vec3::Zero());
  const auto open = [](double x) { return std::max(0.0, 1 - std::abs(x - 26) / 10); };
  for (const Triangle& t : skin.triangles)
    for (const int64_t p : t) {
      const double middle =
          (skin.points[t[0]].y() + skin.points[t[1]].y() + skin.points[t[2]].y()) / 3;
      displacement[p].y() = (middle > 16 ? 3 : -3) * open(skin.points[p].x());
    }
  surface::Surface given{"given", {}, {}};
  for (const double y : {15.9, 16.1, 14.0, 18.0})
    for (const double z : {0.0, 1.0}) given.points.push_back({26, y, z});
  given.triangles = {{0, 1, 2}};
  const surface::PointData data = displacement_of_given(given, skin, displacement);
  for (size_t p = 0; p < given.points.size(); ++p) {
    const double side = given.points[p].y() > 16 ? 1 : -1;
    EXPECT_EQ(data.fields[0].values[p], 1) << "the sides of the slit are no rim";
    EXPECT_GT(side * data.vectors[0].values[p].y(), 1.5) << given.points[p].transpose();
  }
}

}  // namespace given_skin_test
}  // namespace repose::adapt
