#include "repose/scene/landmarks.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "folder.h"
#include "repose/scene/transform_file.h"

namespace repose::scene {
namespace landmarks_test {

std::string markups(const std::string& frame, const std::string& points) {
  return "{\"markups\": [{\"type\": \"Fiducial\"," + frame + " \"controlPoints\": [" + points +
         "]}]}";
}

std::vector<Landmark> read(const std::string& name, const std::string& text) {
  const Folder folder;
  return read_landmarks(folder.write(name, text));
}

std::string refused(const std::string& name, const std::string& text) {
  return refusal([&] { read(name, text); });
}

const std::string point = R"({"label": "chin", "position": [1.5, -2, 3e1]})";

void expect_chin(const std::vector<Landmark>& found, const Vec3& at) {
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].name, "chin");
  EXPECT_EQ(found[0].position, at);
}

TEST(Landmarks, RasAndLpsDifferByTwoSigns) {
  expect_chin(read("a.mrk.json", markups(R"("coordinateSystem": "LPS",)", point)), {1.5, -2, 30});
  expect_chin(read("a.mrk.json", markups(R"("coordinateSystem": "RAS",)", point)), {-1.5, 2, 30});
  const std::string row = "chin, 1.5, -2, 3e1\n";
  expect_chin(read("a.csv", "# CoordinateSystem = LPS\nname,x,y,z\n" + row), {1.5, -2, 30});
  expect_chin(read("a.csv", "# CoordinateSystem = RAS\r\n" + row), {-1.5, 2, 30});
  const std::string slicer = "vtkMRMLMarkupsFiducialNode_0,1.5,-2,30,0,0,0,1,1,1,0,chin,,\n";
  for (const char* lps : {"LPS", "1"})
    expect_chin(read("a.fcsv", std::string("# CoordinateSystem = ") + lps + "\n" + slicer),
                {1.5, -2, 30});
  for (const char* ras : {"RAS", "0"})
    expect_chin(read("a.fcsv", std::string("# CoordinateSystem = ") + ras + "\n" + slicer),
                {-1.5, 2, 30});
}

TEST(Landmarks, OurOwnJsonIsLpsAndMayHoldMore) {
  expect_chin(read("a.json", R"({"units": "mm", "chin": [1.5, -2, 30], "axis": {"angle": 8}})"),
              {1.5, -2, 30});
}

TEST(Landmarks, EndingsMayBeInUpperCase) {
  expect_chin(read("A.MRK.JSON", markups(R"("coordinateSystem": "LPS",)", point)), {1.5, -2, 30});
  expect_chin(read("A.CSV", "# CoordinateSystem = LPS\nchin, 1.5, -2, 30\n"), {1.5, -2, 30});
}

TEST(Landmarks, ColumnsOfFcsvMayStandElsewhere) {
  expect_chin(read("a.fcsv",
                   "# CoordinateSystem = LPS\n# columns = label,id,x,y,z\n"
                   "\"chin\",7,1.5,-2,30\n"),
              {1.5, -2, 30});
}

TEST(Landmarks, PointsThatAreNotPlacedAreLeftOut) {
  const std::string unplaced =
      R"({"label": "ear", "position": [0, 0, 0], "positionStatus": "undefined"}, )";
  expect_chin(read("a.mrk.json", markups(R"("coordinateSystem": "LPS",)", unplaced + point)),
              {1.5, -2, 30});
}

TEST(Landmarks, PointsWithoutNamesAreNumbered) {
  const auto found = read("a.csv", "# CoordinateSystem = LPS\n1,2,3\n4,5,6\n");
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[1].name, "2");
  EXPECT_EQ(found[1].position, Vec3(4, 5, 6));
}

TEST(Landmarks, AFrameThatIsNotSaidIsRefused) {
  for (const auto& [name, text] :
       {std::pair("a.mrk.json", markups("", point)), std::pair("a.csv", std::string("a,1,2,3\n")),
        std::pair("a.fcsv", std::string("a,1,2,3,0,0,0,1,1,1,0,chin,,\n"))}) {
    const std::string message = refused(name, text);
    EXPECT_NE(message.find(std::string(name) + ":1"), std::string::npos) << message;
    EXPECT_NE(message.find("LPS"), std::string::npos) << message;
  }
  EXPECT_NE(refused("a.mrk.json", markups(R"("coordinateSystem": "IJK",)", point)).find("'IJK'"),
            std::string::npos);
  EXPECT_NE(refused("a.fcsv", "# CoordinateSystem = 2\n").find("'2'"), std::string::npos);
}

TEST(Landmarks, BadFilesAreRefusedInOneLine) {
  const std::string lps = R"("coordinateSystem": "LPS",)", csv = "# CoordinateSystem = LPS\n";
  const auto expect = [](const std::string& message, const std::string& word) {
    EXPECT_NE(message.find(word), std::string::npos) << message;
  };
  expect(refused("a.mrk.json", "{\"markups\": ["), "not valid JSON");
  expect(refused("a.json", "{\"chin\": [1, 2]}"), "markups");
  expect(refused("a.json", "{\"chin\": [1, 2, \"x\"]}"), "a.json:1:");
  expect(refused("a.json", "[1, 2, 3]"), "markups");
  expect(refused("a.mrk.json", markups(lps, "")), "no landmark");
  expect(refused("a.mrk.json", markups(lps, R"({"label": "chin", "position": [1, 2]})")),
         "three numbers");
  expect(refused("a.mrk.json", markups(lps, R"({"label": "chin", "position": [1, 2, ".nan"]})")),
         "not a finite number");
  expect(refused("a.mrk.json", markups(lps + R"("coordinateUnits": "m",)", point)), "mm");
  expect(refused("a.csv", csv + "chin,1,2,3,4\n"), "a.csv:2");
  expect(refused("a.csv", csv + "a,1,2,3\nchin,1,2,x\n"), "a.csv:3");
  expect(refused("a.csv", csv), "no landmark");
  expect(refused("a.txt", csv + "a,1,2,3\n"), ".fcsv");
  expect(refusal([] { read_landmarks("nowhere.csv"); }), "nowhere.csv");
}

TEST(Landmarks, ANameAtTwoPlacesIsRefused) {
  const Folder folder;
  const std::string chin = "# CoordinateSystem = LPS\nchin, 1, 2, 3\n";
  const std::string file = folder.write("a.csv", chin + "chin, 1, 2, 43\n");
  EXPECT_EQ(read_landmarks(file).size(), 2u);
  EXPECT_NE(refusal([&] {
              landmarks_by_name(file);
            }).find("a.csv: landmark 'chin' comes twice, 40.0 mm apart; rename or remove one"),
            std::string::npos);
  EXPECT_EQ(landmarks_by_name(folder.write("b.csv", chin + "chin, 1, 2, 3.0005\n")).size(), 1u);
}

TEST(TransformFile, WhatIsWrittenIsReadAgain) {
  const Folder folder;
  for (int seed = 0; seed < 20; ++seed) {
    const Vec3 axis = Vec3(seed + 1, 7 - seed, 0.3 * seed).normalized();
    Mat4 motion = Mat4::Identity();
    motion.topLeftCorner<3, 3>() = Eigen::AngleAxisd(0.31 * seed, axis).toRotationMatrix();
    motion.topRightCorner<3, 1>() = Vec3(100.125 / (seed + 1), -seed, 1e-3);
    write_transform(folder.path("a.tfm"), motion);
    const Mat4 again = read_transform(folder.path("a.tfm")).matrix();
    EXPECT_LT((again - motion).cwiseAbs().maxCoeff(), 1e-12);
  }
  EXPECT_FALSE(std::filesystem::exists(folder.path("a.tfm.part")));
}

TEST(Landmarks, TheShippedFilesAgree) {
  const std::filesystem::path meshes = REPOSE_MESHES;
  const auto plain = landmarks_by_name(meshes / "head_landmarks.json"),
             slicer = landmarks_by_name(meshes / "head.mrk.json");
  EXPECT_GT(plain.size(), 20u);
  for (const auto& [name, position] : slicer)
    EXPECT_LT((plain.at(name) - position).norm(), 1e-3) << name;
}

}  // namespace landmarks_test
}  // namespace repose::scene
