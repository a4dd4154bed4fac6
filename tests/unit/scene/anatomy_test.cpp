#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "folder.h"
#include "repose/scene/landmarks.h"
#include "repose/scene/scene.h"

namespace repose::scene::by_landmarks {
namespace {

/// A head whose axes are those of the scan, for it has no nasion: upper incisors 5 mm in front of
/// the lower and 2 mm below their edge.
Landmarks head() {
  return {{"nasal_spine", {0, -88, 0}},          {"upper_incisor_edge", {0, -90, -26}},
          {"lower_incisor_edge", {0, -85, -24}}, {"b_point", {0, -84, -44}},
          {"pogonion_bone", {0, -86, -60}},      {"menton_bone", {0, -80, -66}},
          {"condyle_right_center", {-50, 0, 0}}, {"condyle_left_center", {50, 0, 0}},
          {"mouth_right", {-25, -90, -24}},      {"mouth_left", {25, -90, -24}}};
}

Scene read(const Landmarks& landmarks, const std::string& more, const std::string& anatomy = "",
           const std::string& tissue = "layers: 4") {
  static const Folder folder;
  folder.write("head.mrk.json", markups_text(landmarks));
  return read_scene(folder.write("scene.yaml",
                                 "skin: face.ply\n"
                                 "bones:\n"
                                 "  - {name: skull, file: skull.ply}\n"
                                 "  - {name: mandible, file: mandible.ply}\n"
                                 "tissue: {" +
                                     tissue + "}\nanatomy: {landmarks: head.mrk.json" + anatomy +
                                     "}\n" + more));
}

const std::string le_fort = "osteotomies: [{bone: skull, piece: maxilla, template: le_fort_1}]\n";
const std::string split = "osteotomies: [{bone: mandible, piece: jaw, template: sagittal_split}]\n";
const std::string chin = "osteotomies: [{bone: mandible, piece: chin, template: genioplasty}]\n";

std::string refused(Landmarks landmarks, const std::string& more = "") {
  return refusal([&] { read(landmarks, more); });
}

void expect_near(const Vec3& a, const Vec3& b) {
  EXPECT_LT((a - b).norm(), 1e-9) << a.transpose() << " against " << b.transpose();
}

TEST(Anatomy, TheGapOfLowerTeethIsHalfTheOverjetOrWhatTheSceneSays) {
  const auto gap = [](const Landmarks& landmarks, const std::string& anatomy = "") {
    return gap_of_lower_teeth(*read(landmarks, "", anatomy).anatomy);
  };
  Landmarks edge_to_edge = head(), far = head(), toothless = head();
  edge_to_edge["lower_incisor_edge"].y() = -90;
  far["lower_incisor_edge"].y() = -75;
  toothless.erase("lower_incisor_edge");
  EXPECT_DOUBLE_EQ(gap(head()), 2.5);
  EXPECT_EQ(gap(head(), ", gap: 3"), 3);
  EXPECT_EQ(gap(edge_to_edge), 1);
  EXPECT_EQ(gap(far), 4);
  EXPECT_EQ(gap(far, ", lower_gap: 0.5"), 0.5);
  EXPECT_EQ(gap(toothless), 1);
}

TEST(Anatomy, LandmarksHaveStandardNamesAndServeMoves) {
  Landmarks spelled = head();
  spelled.erase("b_point");
  spelled["Point B"] = {0, -84, -44};
  const Scene scene =
      read(spelled, "moves: [{bone: mandible, landmark: {from: b_point, to: [0, -90, -44]}}]\n");
  EXPECT_TRUE(scene.anatomy->part_lips && scene.anatomy->vestibule);
  expect_near(scene.moves[1].apply({0, 0, 0}), {0, -6, 0});
}

TEST(Anatomy, RefusesLandmarksOfNoHead) {
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  Landmarks exchanged = head();
  std::swap(exchanged["mouth_right"], exchanged["mouth_left"]);
  has(refused(exchanged), "they are exchanged");
  Landmarks ras = head();
  for (auto& [name, place] : ras) place = Vec3(-place.x(), -place.y(), place.z());
  has(refused(ras), "as in RAS");
  Landmarks lone = head();
  lone.erase("condyle_left_center");
  has(refused(lone), "has condyle_right_center without condyle_left_center");
  Landmarks misspelled = head();
  misspelled["lower_lpi"] = misspelled["lower_lip"];
  EXPECT_EQ(refused(misspelled), "accepted") << "a point of the user's own beside the landmark";
  misspelled.erase("lower_lip");
  has(refused(misspelled),
      "has 'lower_lpi', which is no landmark's name, and lacks lower_lip; rename it");
  misspelled.erase("lower_lpi");
  misspelled["left side"] = {0, 0, 0};
  misspelled["porion_left"] = {50, -10, 5};  // of the Frankfort plane, beside a missing gonion_left
  EXPECT_EQ(refused(misspelled), "accepted");
  Landmarks in_cm = head();
  for (auto& [name, place] : in_cm) place /= 10;
  has(refused(in_cm, le_fort), "landmarks must be in mm; multiply them by 10 if they are in cm");
  Landmarks low = head();
  low["b_point"].z() = -10;
  has(refused(low), "lower_incisor_edge at z = -24.0 mm, not above b_point");
  Landmarks swapped = head();
  swapped["lower_lip"] = {0, -100, -42};
  swapped["b_soft"] = {0, -95, -32};
  has(refused(swapped), "lower_lip at z = -42.0 mm, not above b_soft");
}

TEST(Septum, StiffensTheNoseBelowTheScenesOwnRegions) {
  Landmarks marks = head();
  EXPECT_NE(refusal([&] {
              read(marks, "", ", septum: 1");
            }).find("anatomy.septum needs the landmark pronasale, which"),
            std::string::npos);
  marks["pronasale"] = {0, -112, 15};
  marks["nasion_bone"] = {0, -85, 50};
  const Scene scene = read(marks, "", ", septum: 0.8",
                           "layers: 4, material: {poisson: 0.4, regions: [{sphere: {center: [0, 0, "
                           "0], radius: 1}, young: 2}]}");
  const std::vector<MaterialRegion>& regions = scene.tissue.material->regions;
  ASSERT_EQ(regions.size(), 2u);
  const auto& edges = std::get<CurveRegion>(std::get<Region>(regions[0].where));
  ASSERT_EQ(edges.path.size(), 3u);
  expect_near(edges.path[0], marks["nasal_spine"]);
  expect_near(edges.path[1], marks["pronasale"]);
  expect_near(edges.path[2], marks["nasion_bone"]);
  EXPECT_EQ(regions[0].elasticity.young, 0.8);
  EXPECT_EQ(regions[0].elasticity.poisson, 0.4);
  EXPECT_TRUE(read(marks, "").tissue.material->regions.empty());
  ASSERT_EQ(scene.tissue.attach_regions.size(), 1u);
  EXPECT_EQ(scene.tissue.attach_regions[0].attach, Attach::contact);
  expect_near(std::get<Sphere>(scene.tissue.attach_regions[0].where).center, marks["nasal_spine"]);
  EXPECT_NE(refusal([&] {
              read(marks, "", ", septum: 1",
                   "layers: 4, springs: {default: {stiffness: 1.0, law: "
                   "quartic, reference: 1.0}}");
            }).find("anatomy.septum needs a solid"),
            std::string::npos);
}

TEST(OsteotomyTemplate, LeFortLiesAboveTheNasalFloor) {
  const Scene scene = read(head(), le_fort);
  ASSERT_EQ(scene.osteotomies[0].planes.size(), 2u);
  expect_near(scene.osteotomies[0].planes[0].point, {0, -88, 5});
  expect_near(scene.osteotomies[0].planes[0].normal, {0, 0, -1});
  expect_near(scene.osteotomies[0].planes[1].normal, {0, -1, 0});
  EXPECT_TRUE(scene.remarks.empty()) << scene.remarks[0];
}

TEST(OsteotomyTemplate, ChinIsCutBelowPointB) {
  const CutPlane plane = read(head(), chin).osteotomies[0].planes[0];
  const Vec3 below(0, -84, -48);
  EXPECT_LT((plane.point - below).norm(), 0.05);
  EXPECT_NEAR((plane.point - head()["b_point"]).norm(), 4, 1e-9);
  EXPECT_LT(plane.normal.z(), -0.9);
}

TEST(OsteotomyTemplate, CutsOfTheJawFollowAnOpenOne) {
  const Mat3 open = Eigen::AngleAxisd(0.2, Vec3::UnitX()).toRotationMatrix();
  Landmarks opened = head();
  for (const char* name : {"lower_incisor_edge", "b_point", "pogonion_bone", "menton_bone"})
    opened[name] = open * opened[name];
  const CutPlane plane = read(head(), chin).osteotomies[0].planes[0],
                 turned = read(opened, chin).osteotomies[0].planes[0];
  const auto expect_turned = [&](const Vec3& now, const Vec3& before) {
    EXPECT_LT((now - open * before).norm(), 1e-3) << now.transpose();  // files round landmarks
  };
  expect_turned(turned.point, plane.point);
  expect_turned(turned.normal, plane.normal);
  const CutSheet sheet = *read(head(), split).osteotomies[0].sheet,
                 turned_sheet = *read(opened, split).osteotomies[0].sheet;
  for (size_t i = 0; i < sheet.points.size(); ++i)
    expect_turned(turned_sheet.points[i], sheet.points[i]);
}

TEST(OsteotomyTemplate, SplitIsAlikeOnBothSides) {
  const CutSheet sheet = *read(head(), split).osteotomies[0].sheet;
  const size_t half = sheet.points.size() / 2;
  for (size_t i = 0; i < half; ++i)
    expect_near(sheet.points[i + half], sheet.points[i].cwiseProduct(Vec3(-1, 1, 1)));
}

/// Rotations of a scan about x, y and z, degrees.
std::vector<Mat3> scans() {
  constexpr double degree = M_PI / 180;
  std::vector<Mat3> turns;
  for (const Vec3& by : {Vec3(-15, 0, 0), Vec3(10, 0, 0), Vec3(-10, 5, -8)})
    turns.push_back((Eigen::AngleAxisd(by.z() * degree, Vec3::UnitZ()) *
                     Eigen::AngleAxisd(by.y() * degree, Vec3::UnitY()) *
                     Eigen::AngleAxisd(by.x() * degree, Vec3::UnitX()))
                        .toRotationMatrix());
  return turns;
}

/// The head with a nasion, by which its level is known.
Landmarks level_head(const Mat3& turn = Mat3::Identity()) {
  Landmarks turned = head();
  turned["nasion_bone"] = {0, -85, 50};
  for (auto& [name, place] : turned) place = turn * place;
  return turned;
}

constexpr double digits = 1e-3;  // mm, to which landmarks with six digits place what follows

TEST(OsteotomyTemplate, TurnsWithTheHead) {
  const CutSheet sheet = *read(level_head(), split).osteotomies[0].sheet;
  for (const Mat3& turn : scans()) {
    const CutSheet turned = *read(level_head(turn), split).osteotomies[0].sheet;
    for (size_t i = 0; i < 16; ++i)
      EXPECT_LT((turned.points[i] - turn * sheet.points[i]).norm(), digits) << i;
  }
  for (const std::string& cut : {le_fort, chin}) {
    const std::vector<CutPlane> planes = read(level_head(), cut).osteotomies[0].planes;
    for (const Mat3& turn : scans()) {
      const std::vector<CutPlane> turned = read(level_head(turn), cut).osteotomies[0].planes;
      ASSERT_EQ(turned.size(), planes.size());
      for (size_t k = 0; k < planes.size(); ++k) {
        EXPECT_LT((turned[k].point - turn * planes[k].point).norm(), digits) << cut;
        EXPECT_LT((turned[k].normal - turn * planes[k].normal).norm(), 1e-5) << cut;
      }
    }
  }
}

TEST(HeadAxes, TurnWithTheHeadAndNeedCondylesAndALevel) {
  const Mat3 axes = read(level_head(), "").anatomy->axes;
  EXPECT_LT((axes * axes.transpose() - Mat3::Identity()).norm(), 1e-12);
  for (const Mat3& turn : scans())
    EXPECT_LT((read(level_head(turn), "").anatomy->axes * turn - axes).norm(), 1e-5);
  // Both directions from the condyles rise by 14° together.
  const auto rise = [&](const char* name) {
    const Vec3 way = axes * level_head().at(name);
    return std::atan2(way.z(), -way.y());
  };
  EXPECT_NEAR((rise("nasion_bone") + rise("upper_incisor_edge")) * 180 / M_PI, 14, 1e-9);
  EXPECT_EQ(read(head(), "").anatomy->axes, Mat3(Mat3::Identity()));
  Landmarks bare = level_head(scans()[0]);
  bare.erase("condyle_left_center");
  bare.erase("condyle_right_center");
  EXPECT_EQ(read(bare, "").anatomy->axes, Mat3(Mat3::Identity()));
}

TEST(ClinicalMove, TurnsWithTheHead) {
  const std::string more = le_fort +
                           "moves: [{bone: maxilla, clinical: {advance: 5, impaction: 2, left: 1, "
                           "yaw: 3, roll: -2, pitch: 4}}]\n";
  const RigidMotion level = read(level_head(), more).moves[2];
  const Vec3 place(10, -80, -20);
  for (const Mat3& turn : scans())
    EXPECT_LT(
        (read(level_head(turn), more).moves[2].apply(turn * place) - turn * level.apply(place))
            .norm(),
        digits);
}

TEST(ClinicalMove, NoAngleOutOfRangeIsAdvised) {
  const std::string line =
      refused(head(), le_fort + "moves: [{bone: maxilla, clinical: {yaw: -45.5}}]\n");
  EXPECT_NE(line.find("-45 … 45, it is '-45.5'"), std::string::npos) << line;
  EXPECT_EQ(line.find("write"), std::string::npos) << line;
}

TEST(OsteotomyTemplate, ExcludesCutsOfOnesOwn) {
  const std::string both =
      "osteotomies: [{bone: skull, piece: a, template: le_fort_1, planes: [{point: [0, 0, 0], "
      "normal: [0, 0, 1]}]}]\n";
  EXPECT_NE(refused(head(), both).find("exclude each other"), std::string::npos);
  Landmarks bare = head();
  bare.erase("nasal_spine");
  EXPECT_NE(refused(bare, le_fort).find("landmark nasal_spine is missing"), std::string::npos);
}

std::vector<std::string> warnings(const std::string& bone, double z) {
  return read(head(), fmt::format("osteotomies: [{{bone: {}, piece: a, planes: [{{point: [0, -80, "
                                  "{}], normal: [0, 0, -1]}}]}}]\n",
                                  bone, z))
      .warnings;
}

TEST(OsteotomyWarnings, NamePalateRootsAndCanal) {
  EXPECT_TRUE(warnings("skull", 5).empty());
  const auto palate = warnings("skull", -4);
  ASSERT_EQ(palate.size(), 2u);
  EXPECT_EQ(palate[0].find("osteotomies[0]: its plane passes 4.0 mm below the nasal spine, through "
                           "the hard palate"),
            0u);
  EXPECT_NE(palate[1].find("22.0 mm above the edge of the upper incisors"), std::string::npos);
  const auto roots = warnings("mandible", -45);
  ASSERT_EQ(roots.size(), 2u);
  EXPECT_NE(roots[0].find("by rule roots end 25 mm below it"), std::string::npos);
  EXPECT_NE(roots[1].find("mental foramen"), std::string::npos);
}

TEST(OsteotomyWarnings, NameNoRootsOfEdentulousJaws) {
  Landmarks edentulous = head();
  edentulous["lower_incisor_edge"] = edentulous["menton_bone"] + Vec3(0, 0, 26);
  edentulous["upper_incisor_edge"] = edentulous["nasal_spine"] - Vec3(0, 0, 14);
  const auto lines = [&](const char* bone, const Vec3& point) {
    return read(edentulous,
                fmt::format("osteotomies: [{{bone: {}, piece: a, planes: [{{point: [{}, {}, {}], "
                            "normal: [0, 0, -1]}}]}}]\n",
                            bone, point.x(), point.y(), point.z()))
        .warnings;
  };
  EXPECT_TRUE(lines("skull", edentulous["nasal_spine"] + Vec3(0, 0, 5)).empty());
  for (const std::string& line :
       lines("mandible", edentulous["lower_incisor_edge"] - Vec3(0, 0, 14)))
    EXPECT_EQ(line.find("roots"), std::string::npos) << line;
}

Vec3 moved(const std::string& cut, const std::string& bone, const std::string& clinical,
           const Vec3& point, size_t row = 2) {
  return read(head(),
              cut + fmt::format("moves: [{{bone: {}, clinical: {{{}}}}}]\n", bone, clinical))
      .moves[row]
      .apply(point);
}

TEST(ClinicalMove, GoesAlongTheHeadsAxes) {
  expect_near(moved(le_fort, "maxilla", "advance: 5, impaction: 2, left: 1", {0, 0, 0}),
              {1, -5, 2});
  expect_near(moved(split, "jaw", "set_back: 4, lower: 1", {0, 0, 0}), {0, 4, -1});
}

TEST(ClinicalMove, TurnsAboutTheIncisors) {
  const Vec3 edge = head()["upper_incisor_edge"];
  for (const char* turn : {"yaw: 5", "roll: 5", "pitch: 5"})
    expect_near(moved(le_fort, "maxilla", turn, edge), edge);
  EXPECT_GT(moved(le_fort, "maxilla", "roll: 5", edge + Vec3(30, 0, 0)).z(), edge.z() + 2);
  EXPECT_GT(moved(le_fort, "maxilla", "yaw: 5, pivot: [0, 0, 0]", edge).x(), 5);
  EXPECT_LT(moved(le_fort, "maxilla", "pitch: 5, pivot: [0, 0, 0]", edge).z(), edge.z() - 5);
}

TEST(ClinicalMove, OpensAboutTheHinge) {
  const Vec3 menton = head()["menton_bone"];
  const Vec3 opened = moved("", "mandible", "open: 8", menton, 1);
  EXPECT_LT(opened.z(), menton.z() - 5);
  expect_near(moved("", "mandible", "open: 8", {50, 0, 0}, 1), {50, 0, 0});
}

TEST(ClinicalMove, ReachesTargetsFromWhereTheOtherJawIs) {
  const Vec3 upper = head()["upper_incisor_edge"], lower = head()["lower_incisor_edge"];
  expect_near(moved(split, "jaw", "overjet: 2, overbite: 1", lower), upper + Vec3(0, 2, 1));
  expect_near(moved(le_fort, "maxilla", "overjet: 2, overbite: 1", upper), lower - Vec3(0, 2, 1));
  const Scene both = read(head(),
                          "osteotomies:\n"
                          "  - {bone: skull, piece: maxilla, template: le_fort_1}\n"
                          "  - {bone: mandible, piece: jaw, template: sagittal_split}\n"
                          "moves:\n"
                          "  - {bone: maxilla, clinical: {advance: 4, impaction: 3}}\n"
                          "  - {bone: jaw, clinical: {overjet: 2, overbite: 2}}\n");
  expect_near(both.moves[3].apply(lower), both.moves[2].apply(upper) + Vec3(0, 2, 2));
}

constexpr const char* upper_by_planes =
    "osteotomies:\n"
    "  - {bone: skull, piece: maxilla, planes: [{point: [0, -80, 10], normal: [0, 0, -1]}]}\n"
    "  - {bone: mandible, piece: jaw, template: sagittal_split}\n";

TEST(ClinicalMove, ReachesTargetsFromAPieceThatPlanesCut) {
  const Vec3 upper = head()["upper_incisor_edge"], lower = head()["lower_incisor_edge"];
  const Scene scene = read(head(), std::string(upper_by_planes) +
                                       "moves:\n"
                                       "  - {bone: maxilla, translate: [0, -5, 1]}\n"
                                       "  - {bone: jaw, clinical: {overjet: 2, overbite: 2}}\n");
  expect_near(scene.moves[3].apply(lower), upper + Vec3(0, -5, 1) + Vec3(0, 2, 2));
  const Scene second =
      read(head(), std::string(upper_by_planes) +
                       "moves:\n"
                       "  - {bone: jaw, clinical: {advance: 3}}\n"
                       "  - {bone: maxilla, clinical: {overjet: 2, overbite: 2}}\n");
  expect_near(second.moves[2].apply(upper), lower + Vec3(0, -3, 0) - Vec3(0, 2, 2));
}

TEST(ClinicalMove, TurnsAboutLandmarksWhereTheirBoneIs) {
  const Vec3 condyle = head()["condyle_left_center"], upper = head()["upper_incisor_edge"];
  const std::string both =
      "osteotomies:\n"
      "  - {bone: skull, piece: maxilla, template: le_fort_1}\n"
      "  - {bone: mandible, piece: jaw, template: sagittal_split}\n"
      "moves:\n"
      "  - {bone: maxilla, clinical: {advance: 6}}\n"
      "  - {bone: jaw, clinical: {advance: 6}}\n";
  const auto turned = [&](const char* turn) {
    const Scene scene =
        read(head(), both + fmt::format("  - {{bone: jaw, clinical: {{{}}}}}\n", turn));
    return scene.moves[3].after(RigidMotion::translation({0, 6, 0}));
  };
  for (const char* turn : {"open: 5", "yaw: 5, pivot: condyle_left_center"})
    expect_near(turned(turn).apply(condyle), condyle);
  const Vec3 advanced = upper + Vec3(0, -6, 0);
  expect_near(turned("yaw: 5, pivot: upper_incisor_edge").apply(advanced), advanced);
}

TEST(ClinicalMove, TurnsAChinCutByItsOwnPlaneAboutPogonion) {
  const Vec3 pogonion = head()["pogonion_bone"];
  const Scene scene = read(head(), fmt::format("osteotomies:\n"
                                               "  - {{bone: mandible, piece: chin, planes: "
                                               "[{{point: [0, 0, {}], normal: [0, 0, -1]}}]}}\n"
                                               "moves: [{{bone: chin, clinical: {{yaw: 3}}}}]\n",
                                               pogonion.z() + 5));
  expect_near(scene.moves[2].apply(pogonion), pogonion);
}

TEST(ClinicalMove, RefusesTargetsBesideAnUnknownJaw) {
  const std::string by_disc =
      "osteotomies:\n"
      "  - {bone: skull, piece: maxilla, template: le_fort_1}\n"
      "  - {bone: mandible, piece: jaw, planes: [{point: [0, -40, -30], normal: [0, -1, 0], "
      "radius: 60}]}\n";
  const std::string target = "  - {bone: maxilla, clinical: {overjet: 2}}\n";
  const auto says = [&](const std::string& moves) {
    return refused(head(), by_disc + "moves:\n" + moves);
  };
  EXPECT_NE(says("  - {bone: jaw, translate: [0, -6, 0]}\n" + target)
                .find("needs to know whether 'jaw', which has moved, carries the landmark "
                      "lower_incisor_edge"),
            std::string::npos);
  const Vec3 upper = head()["upper_incisor_edge"], lower = head()["lower_incisor_edge"];
  const Scene unmoved = read(head(), by_disc + "moves:\n" + target);
  EXPECT_NEAR((lower - unmoved.moves[2].apply(upper)).y(), 2, 1e-9);
  EXPECT_NE(refused(head(), split + "moves: [{bone: mandible, clinical: {overjet: 2}}]\n")
                .find("needs a jaw with incisors"),
            std::string::npos);
  EXPECT_NE(refused(head(), std::string(upper_by_planes) +
                                "moves: [{bone: [maxilla, jaw], clinical: {overjet: 2}}]\n")
                .find("cannot be reached by moving both jaws as one"),
            std::string::npos);
}

/// The motions of mandible and chin by one entry, after `before`.
std::pair<RigidMotion, RigidMotion> moved_together(const std::string& bones,
                                                   const std::string& form,
                                                   const std::string& before = "") {
  const Scene scene =
      read(head(), chin + "moves:\n" + before + fmt::format("  - {{bone: {}, {}}}\n", bones, form));
  return {scene.moves[1], scene.moves[2]};
}

TEST(SharedMove, IsOneRigidMotion) {
  for (const char* form :
       {"clinical: {roll: 4, pitch: 5}", "clinical: {open: 10, yaw: 3}",
        "clinical: {roll: 4, pivot: menton}", "clinical: {pitch: 5, overjet: 2, overbite: 1}",
        "rotate: {axis: [1, 0, 0], center: [0, 10, 20], angle: 8}", "translate: [0, -5, 1]"})
    for (const char* bones : {"[mandible, chin]", "[chin, mandible]"}) {
      const auto [jaw, piece] = moved_together(bones, form);
      EXPECT_EQ(jaw.matrix(), piece.matrix()) << bones << form;
      EXPECT_NE(jaw.matrix(), Mat4(Mat4::Identity())) << bones << form;
    }
}

TEST(SharedMove, TurnsAboutThePivotOfTheFirstBoneThatHasOne) {
  const Vec3 edge = head()["lower_incisor_edge"], pogonion = head()["pogonion_bone"];
  const std::string roll = "clinical: {roll: 4, pitch: 5}";
  expect_near(moved_together("[mandible, chin]", roll).second.apply(edge), edge);
  expect_near(moved_together("[chin, mandible]", roll).first.apply(pogonion), pogonion);
  const Scene with_skull = read(head(), "moves: [{bone: [skull, mandible], " + roll + "}]\n");
  expect_near(with_skull.moves[0].apply(edge), edge);
}

TEST(SharedMove, FollowsEarlierMovesOfItsBonesAsOneMotion) {
  const std::string before = "  - {bone: chin, translate: [0, -6, 0]}\n";
  for (const char* form : {"clinical: {roll: 4}",
                           "landmark: {from: [0, -86, -60], to: [1, -90, "
                           "-61]}"}) {
    const auto [jaw, piece] = moved_together("[mandible, chin]", form, before);
    EXPECT_LT((piece.matrix() - jaw.after(RigidMotion::translation({0, -6, 0})).matrix()).norm(),
              1e-12)
        << form;
  }
}

TEST(ClinicalMove, RefusesWhatHasNoMeaning) {
  const auto says = [](const std::string& more) { return refused(head(), more); };
  EXPECT_NE(says(split + "moves: [{bone: jaw, clinical: {overjet: 2, advance: 3}}]\n")
                .find("exclude each other"),
            std::string::npos);
  EXPECT_NE(says("moves: [{bone: skull, clinical: {overjet: 2}}]\n").find("needs a jaw"),
            std::string::npos);
  EXPECT_NE(says("moves: [{bone: skull, clinical: {yaw: 2}}]\n").find("give pivot"),
            std::string::npos);
}

}  // namespace
}  // namespace repose::scene::by_landmarks
