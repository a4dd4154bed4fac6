#include "repose/anatomy/same_head.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "repose/anatomy/propose.h"
#include "repose/base/error.h"
#include "repose/surface/read.h"

namespace repose::anatomy {
namespace {

/// The surfaces of the shipped head with the landmarks that are proposed for it.
struct ShippedHead {
  surface::Surface skin = read("skin"), skull = read("skull"), mandible = read("mandible");
  scene::Landmarks landmarks = propose_landmarks(skin, skull, mandible, {}).found;

  static surface::Surface read(const std::string& part) {
    return surface::read_surface(REPOSE_MESHES "/head_" + part + ".ply");
  }

  /// Why the landmarks are refused, or nothing.
  std::string refused(const scene::Landmarks& changed) const {
    try {
      require_same_head(changed, "head.mrk.json", skin, {skull, mandible});
    } catch (const base::InputError& error) {
      return error.what();
    }
    return "";
  }

  std::string shifted(const Vec3& shift) const {
    scene::Landmarks changed = landmarks;
    for (auto& [name, place] : changed) place += shift;
    return refused(changed);
  }
};

const ShippedHead& shipped_head() {
  static const ShippedHead head;
  return head;
}

TEST(SameHead, LandmarksAreAcceptedAsProposedAndWithErrorsOfPlacing) {
  EXPECT_EQ(shipped_head().refused(shipped_head().landmarks), "");
  std::mt19937 random(1);
  std::normal_distribution<double> error(0, 1.5);  // mm
  for (int trial = 0; trial < 10; ++trial) {
    scene::Landmarks changed = shipped_head().landmarks;
    for (auto& [name, place] : changed) place += Vec3(error(random), error(random), error(random));
    EXPECT_EQ(shipped_head().refused(changed), "");
  }
  EXPECT_EQ(shipped_head().shifted({0, 2, 0}), "");
}

TEST(SameHead, LandmarksOfAnotherHeadAreRefused) {
  EXPECT_NE(shipped_head().shifted({0, 40, 0}).find("another head"), std::string::npos);
}

TEST(SameHead, ALandmarkOfTheSkinFarFromItsBoneIsRefused) {
  scene::Landmarks changed = shipped_head().landmarks;
  const Vec3 bone = changed.at("pogonion_bone");
  const auto away = [&](const Vec3& point) { return (point - bone).norm(); };
  changed.at("pogonion_soft") = std::ranges::max(shipped_head().skin.points, {}, away);
  EXPECT_NE(shipped_head().refused(changed).find("mm from pogonion_bone, at most 40 mm"),
            std::string::npos)
      << shipped_head().refused(changed);
}

TEST(SameHead, LandmarksThatAreShiftedAreRefused) {
  for (const Vec3& shift : {Vec3(10, 0, 0), Vec3(-10, 0, 0), Vec3(0, 10, 0), Vec3(0, -10, 0),
                            Vec3(0, 0, 10), Vec3(0, 0, -10)})
    EXPECT_NE(shipped_head().shifted(shift).find("when all are moved by ("), std::string::npos)
        << shift.transpose() << ": " << shipped_head().shifted(shift);
}

TEST(SameHead, EdgesOfIncisorsThatAreExchangedAreRefused) {
  scene::Landmarks changed = shipped_head().landmarks;
  std::swap(changed.at("upper_incisor_edge"), changed.at("lower_incisor_edge"));
  EXPECT_NE(shipped_head().refused(changed).find("they are exchanged"), std::string::npos)
      << shipped_head().refused(changed);
}

}  // namespace
}  // namespace repose::anatomy
