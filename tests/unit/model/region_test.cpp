#include "model/region.h"

#include <gtest/gtest.h>

#include "../../folder.h"
#include "patches.h"
#include "repose/surface/read.h"

namespace repose::model {
namespace region_test {

/// A region with 10 mm from the origin to its border along x.
class Regions : public ::testing::Test {
 protected:
  std::vector<scene::Region> every_kind() const {
    const surface::Surface box = patches::box({-10, -10, -10}, {10, 10, 10});
    surface::write_ply(folder_.path("box.ply"), box);
    return {scene::Sphere{{0, 0, 0}, 10}, scene::Box{{0, 0, 0}, {20, 40, 60}},
            scene::CurveRegion{{{0, -5, 0}, {0, 0, 0}, {0, 5, 0}}, 10},
            scene::ClosedMesh{folder_.path("box.ply")}};
  }
  test::Folder folder_;
};

TEST_F(Regions, reach_to_their_border_and_as_far_beyond_as_asked) {
  for (const scene::Region& region : every_kind()) {
    const Contains bare = contains_of(region), near = contains_of(region, 3);
    EXPECT_TRUE(bare({9.9, 0, 0})) << region.index();
    EXPECT_FALSE(bare({10.1, 0, 0})) << region.index();
    EXPECT_TRUE(near({12.9, 0, 0})) << region.index();
    EXPECT_FALSE(near({13.1, 0, 0})) << region.index();
  }
}

}  // namespace region_test
}  // namespace repose::model
