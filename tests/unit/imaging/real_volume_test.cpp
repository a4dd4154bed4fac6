#include <Eigen/Geometry>

#include "../surface/shapes.h"
#include "repose/imaging/extract.h"
#include "repose/surface/component.h"
#include "repose/surface/defects.h"
#include "repose/surface/read.h"
#include "repose/tools/comparison/compare.h"

/// Surfaces from the CT of a real head against those that others made of it. The data are not
/// shipped: they lie beside the project, in ../shared/data/head.
namespace repose::imaging {
using namespace surface;
using namespace meshtools;
using namespace tools::comparison;
namespace real_volume_test {

constexpr double voxel = 0.9765625;  // mm, the shorter one

class RealVolume : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::is_directory(REPOSE_HEAD_DATA)) GTEST_SKIP() << "no real head";
  }
  static std::filesystem::path data(const char* name) {
    return std::filesystem::path(REPOSE_HEAD_DATA) / name;
  }
};

double percentile_95(const Surface& from, const Surface& to) {
  return statistics(sample_distances(from, SignedDistance(to), 2)).percentile_95;
}

/// The triangles that see the skin: along their normals no bone comes before it.
Surface outside_of(const Surface& bone, const Surface& skin) {
  const DistanceTree bones(bone), skins(skin);
  Surface outside = bone;
  std::erase_if(outside.triangles, [&](const Triangle& t) {
    const Vec3 &a = bone.points[t[0]], &b = bone.points[t[1]], &c = bone.points[t[2]];
    const Vec3 normal = (b - a).cross(c - a).normalized();
    const Vec3 start = (a + b + c) / 3 + 0.01 * normal;
    constexpr double reach = 60;
    return !skins.first_hit(start, normal, reach) || bones.first_hit(start, normal, reach);
  });
  return outside;
}

void expect_closed(const Surface& surface) {
  const Defects d = inspect(surface, true);
  EXPECT_TRUE(d.outward && d.components == 1) << describe(d);
  EXPECT_EQ(d.non_manifold_edges + d.non_manifold_vertices + d.self_intersections, 0);
}

TEST_F(RealVolume, skin_lies_within_a_voxel_of_the_reference) {
  Extraction requested;
  requested.level = -300;
  requested.box = {{Vec3(-200, -500, 0), Vec3(200, -108, 900)}};  // without the headrest
  requested.largest = true;
  const Surface skin = extract(read_volume(data("head_hu.mhd")), requested).surface;
  expect_closed(skin);
  const Surface reference = read_surface(data("skin.ply"));
  EXPECT_LT(percentile_95(reference, skin), voxel);
  EXPECT_LT(percentile_95(skin, reference), voxel);
}

TEST_F(RealVolume, labels_give_skull_and_mandible_apart) {
  const Volume labels = read_volume(data("labels.nii.gz"));
  Extraction requested;
  requested.largest = true;
  requested.label = 2;
  const Surface mandible = extract(labels, requested).surface;
  requested.label = 1;
  const Surface skull = extract(labels, requested).surface;
  expect_closed(mandible);
  expect_closed(skull);
  EXPECT_LT(volume_of(mandible), 0.2 * volume_of(skull));
  const Surface jaw = read_surface(data("mandible.ply"));
  EXPECT_LT(percentile_95(jaw, mandible), voxel);
  EXPECT_LT(percentile_95(mandible, jaw), voxel);
  const Surface skin = read_surface(data("skin.ply")), bone = read_surface(data("skull.ply"));
  EXPECT_LT(percentile_95(outside_of(bone, skin), skull), voxel)
      << "the reference's braincase is filled in some slices: its outside counts";
  EXPECT_LT(percentile_95(outside_of(skull, skin), bone), voxel);
}

}  // namespace real_volume_test
}  // namespace repose::imaging
