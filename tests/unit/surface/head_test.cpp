#include <filesystem>

#include "repose/surface/defects.h"
#include "repose/surface/distance.h"
#include "repose/surface/read.h"
#include "shapes.h"

namespace repose::surface {
namespace head_test {

class Head : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(folder_))
      GTEST_SKIP() << "the real head is not here (" << folder_ << "): not tested";
  }
  const std::filesystem::path folder_ = REPOSE_HEAD_DATA;
};

TEST_F(Head, every_surface_loads_in_its_role) {
  EXPECT_EQ(load_surface(folder_ / "face.ply", Role::skin).triangles.size(), 7958u);
  EXPECT_EQ(load_surface(folder_ / "face_fine.ply", Role::skin).triangles.size(), 40348u);
  EXPECT_EQ(load_surface(folder_ / "skin.ply", Role::skin).triangles.size(), 36000u);
  EXPECT_EQ(load_surface(folder_ / "skull.ply", Role::bone).triangles.size(), 60000u);
  EXPECT_EQ(load_surface(folder_ / "mandible.ply", Role::bone).triangles.size(), 16000u);
}

TEST_F(Head, an_open_face_is_no_bone) {
  const std::string message = refusal([&] { load_surface(folder_ / "face.ply", Role::bone); });
  EXPECT_NE(message.find("1 border loop(s)"), std::string::npos) << message;
}

TEST_F(Head, the_chin_lies_where_its_landmarks_are) {
  const DistanceTree skin(load_surface(folder_ / "skin.ply", Role::skin));
  const DistanceTree mandible(load_surface(folder_ / "mandible.ply", Role::bone));
  const Vec3 on_skin(3.3, -303.9, 343.2), on_bone(1.1, -297.7, 335.5);
  EXPECT_LT(skin.nearest(on_skin).distance, 0.5);
  EXPECT_LT(mandible.nearest(on_bone).distance, 0.5);
  EXPECT_TRUE(skin.contains(on_bone));
  EXPECT_FALSE(skin.contains(on_skin + Vec3(0, -5, 0)));
  EXPECT_TRUE(mandible.first_hit(on_skin, (on_bone - on_skin).normalized(), 15));
}

}  // namespace head_test
}  // namespace repose::surface
