#include "repose/scene/landmarks.h"

#include <gtest/gtest.h>

#include "folder.h"
#include "repose/scene/landmark_fit.h"

namespace repose::scene {
namespace {

TEST(Landmarks, SlicersMarkupsTurnedToLps) {
  const Folder folder;
  const auto read = [&](const char* frame) {
    return landmarks_by_name(folder.write(
        "points.mrk.json", std::string(R"({"@schema": "x", "markups": [{"coordinateSystem": ")") +
                               frame +
                               R"(", "controlPoints": [{"id": "1", "label": "pogonion",
                                 "position": [1, 2, 3]}]}]})"));
  };
  EXPECT_EQ(read("LPS").at("pogonion"), Vec3(1, 2, 3));
  EXPECT_EQ(read("RAS").at("pogonion"), Vec3(-1, -2, 3));
}

TEST(Landmarks, TheShippedFilesAgree) {
  const std::filesystem::path meshes = REPOSE_MESHES;
  const auto plain = landmarks_by_name(meshes / "head_landmarks.json"),
             slicer = landmarks_by_name(meshes / "head.mrk.json");
  EXPECT_GT(plain.size(), 20u);
  for (const auto& [name, position] : slicer)
    EXPECT_LT((plain.at(name) - position).norm(), 1e-3) << name;
}

TEST(Landmarks, RefusesWhatHoldsNone) {
  const Folder folder;
  for (const char* text : {"{}", "[1, 2]", "{\"a\": [1, 2]}", "{\"a\": [1, 2", "\tx: :"}) {
    const std::string why = refusal([&] { read_landmarks(folder.write("a.json", text)); });
    EXPECT_NE(why.find("a.json:"), std::string::npos) << why;
  }
  EXPECT_NE(refusal([&] { read_landmarks(folder.path("none.json")); }).find("none.json"),
            std::string::npos);
}

TEST(Landmarks, FitsByTheirNumber) {
  const std::vector<Vec3> from{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}},
      to{{1, 1, 1}, {1, 5, 1}, {-3, 1, 1}};
  for (std::size_t count : {1, 2, 3}) {
    const RigidFit fit =
        fit_landmarks({from.begin(), from.begin() + count}, {to.begin(), to.begin() + count});
    EXPECT_LT(fit.residual, 1e-12) << count;
    EXPECT_LT((fit.motion.apply(from[0]) - to[0]).norm(), 1e-12) << count;
  }
  const RigidFit longer = fit_landmarks({from[0], from[1]}, {to[0], {1, 9, 1}});
  EXPECT_NEAR(longer.residual, 2, 1e-12);
  EXPECT_LT((longer.motion.apply({0, 0, 3}) - Vec3(1, 3, 4)).norm(), 1e-12) << "no turn about it";
}

}  // namespace
}  // namespace repose::scene
