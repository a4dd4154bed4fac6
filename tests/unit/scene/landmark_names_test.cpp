#include "repose/scene/landmark_names.h"

#include <gtest/gtest.h>

#include "folder.h"
#include "repose/scene/landmarks.h"

namespace repose::scene {
namespace {

TEST(LandmarkNames, SpellingsStandForOneName) {
  EXPECT_EQ(standard_name("ANS"), "nasal_spine");
  EXPECT_EQ(standard_name("Labrale  superius"), "upper_lip");
  EXPECT_EQ(standard_name("Pog\xE2\x80\xB2"), "pogonion_soft");
  EXPECT_EQ(standard_name("Pog"), "pogonion_bone");
  EXPECT_EQ(standard_name("mouth-corner_LEFT"), "mouth_left");
  EXPECT_EQ(standard_name("wart"), "");
}

TEST(LandmarkNames, NoSpellingStandsForTwo) {
  std::map<std::string, std::string> owner;
  for (const LandmarkName& landmark : landmark_names())
    for (const std::string& spelling : landmark.aliases) {
      EXPECT_TRUE(owner.try_emplace(spelling, landmark.name).second) << spelling;
      EXPECT_EQ(standard_name(spelling), landmark.name) << spelling;
    }
}

TEST(LandmarkNames, TwoPlacesOfOneAreRefused) {
  const Vec3 here(1, 2, 3), there(1, 2, 5);
  EXPECT_EQ(with_standard_names({{"B", here}, {"wart", there}}, "a.json"),
            (Landmarks{{"b_point", here}, {"wart", there}}));
  EXPECT_NE(refusal([&] {
              with_standard_names({{"B", here}, {"b_point", there}}, "a.json");
            }).find("a.json: landmarks 'B' and 'b_point' are both b_point, 2.0 mm apart"),
            std::string::npos);
}

TEST(LandmarkNames, WrittenOnesAreReadAgain) {
  const Folder folder;
  const Landmarks written{{"b_point", {1, -2.5, 3}}, {"scar \"old\" \\\t\x01", {4, 5, 6}}};
  EXPECT_EQ(landmarks_by_name(folder.write("a.mrk.json", markups_text(written))), written);
}

}  // namespace
}  // namespace repose::scene
