#include "repose/tools/bone_separation/part_bones.h"

#include <Eigen/Geometry>

#include "../surface/shapes.h"
#include "repose/imaging/isosurface.h"
#include "repose/surface/component.h"
#include "repose/surface/defects.h"
#include "volumes.h"

namespace repose::tools::bone_separation {
using namespace imaging;
namespace part_bones_test {

constexpr double level = 200;

/// Two plates 72 mm wide, 18 mm thick and 18 mm apart, and three teeth of each, 12 mm wide and as
/// firm, that meet in the plane z = 0, where values are lower.
double jaws(const Vec3& p) {
  const double wide = std::max(std::abs(p.x()), std::abs(p.y())), z = std::abs(p.z());
  if (wide > 36 || z > 27) return -1000;
  if (z > 9) return 1000;
  const bool tooth = std::abs(p.y()) < 6 && std::abs(p.x() - 24 * std::round(p.x() / 24)) < 6;
  if (!tooth) return -1000;
  return z < 2 ? 500 : 1000;
}

const std::array<std::vector<Vec3>, 2> inside = {
    std::vector<Vec3>{{0, 18, 20}, {24, -24, 20}},
    std::vector<Vec3>{{-24, 24, -18}, {24, 24, -18}, {0, -24, -18}}};

TEST(PartBones, teeth_are_parted_where_they_meet) {
  const Mat3 axes =
      Eigen::AngleAxisd(0.3, Vec3(1, 2, 3).normalized()) * Mat3(Vec3(1.5, 2.1, 1.8).asDiagonal());
  const Volume volume = sampled(80, axes, jaws);
  const PartedBones bones = part_bones(volume, level, inside);
  const double whole = surface::volume_of(isosurface(volume, level));
  std::array<double, 2> volumes;
  for (int part = 0; part < 2; ++part) {
    const Surface surface = isosurface(bones.parts[part], level);
    const surface::Defects defects = surface::inspect(surface, false);
    EXPECT_EQ(defects.border_edges + defects.non_manifold_edges, 0);
    EXPECT_EQ(surface::components(surface).size(), 1u);
    volumes[part] = surface::volume_of(surface);
    for (const Vec3& p : surface.points) EXPECT_GT((part == 0 ? 1 : -1) * p.z(), -3) << part;
  }
  EXPECT_NEAR(volumes[0], volumes[1], 0.03 * whole);
  EXPECT_LT(volumes[0] + volumes[1], whole);
  EXPECT_NEAR(volumes[0] + volumes[1], whole, 0.02 * whole);
  EXPECT_GT(bones.cut_area, 0.9 * 3 * 144);  // three teeth of 12 mm by 12 mm,
  EXPECT_LT(bones.cut_area, 3 * 144 * 2);    // by faces along the axes
}

TEST(PartBones, away_from_the_contact_nothing_changes) {
  const Volume volume = sampled(60, 1.5 * Mat3::Identity(), jaws);
  const PartedBones bones = part_bones(volume, level, inside);
  for (size_t v = 0; v < volume.values.size(); ++v) {
    const bool first = bones.parts[0].values[v] == volume.values[v],
               second = bones.parts[1].values[v] == volume.values[v];
    EXPECT_TRUE(volume.values[v] >= level ? first != second : first && second) << v;
    EXPECT_LT(std::min(bones.parts[0].values[v], bones.parts[1].values[v]), level);
  }
}

TEST(PartBones, what_is_apart_stays_and_points_beside_bone_are_refused) {
  const Volume volume = sampled(60, 1.5 * Mat3::Identity(),
                                [](const Vec3& p) { return std::abs(p.z()) > 2 ? 1000 : -1000; });
  EXPECT_EQ(part_bones(volume, level,
                       {std::vector<Vec3>{Vec3(0, 0, 15)}, std::vector<Vec3>{Vec3(0, 0, -15)}})
                .cut_area,
            0);
  const auto refused = [&](const Vec3& first, const Vec3& second) {
    return surface::refusal([&] {
      part_bones(volume, level, {std::vector<Vec3>{first}, std::vector<Vec3>{second}});
    });
  };
  EXPECT_NE(refused({0, 0, 15}, {0, 0, 90}).find("(0.0, 0.0, 90.0) of the second bone"),
            std::string::npos);
  EXPECT_NE(refused({0, 0, 90}, {0, 0, 5}).find("of the first bone"), std::string::npos);
  EXPECT_NE(refused({0, 0, 15}, {0, 0, 12.5}).find("is 2.5 mm from a point of the second"),
            std::string::npos);
}

}  // namespace part_bones_test
}  // namespace repose::tools::bone_separation
