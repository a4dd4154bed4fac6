#include "repose/anatomy/complete.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "../../folder.h"
#include "repose/anatomy/propose.h"
#include "repose/scene/landmark_names.h"
#include "repose/surface/edges.h"
#include "repose/surface/read.h"
#include "repose/surface/triangle_tree.h"

namespace repose::anatomy {
namespace {

using test::refusal;

struct Completed {
  scene::Scene scene;
  std::vector<std::string> remarks;
};

/// A head completed by those landmarks that are proposed for it, but for `without`, with its own
/// overjet or another one.
Completed complete_head(const std::string& skin_file, const std::string& skull_file,
                        const std::string& mandible_file, const std::vector<std::string>& without,
                        std::optional<double> overjet = {}) {
  const surface::Surface skin = surface::read_surface(skin_file),
                         skull = surface::read_surface(skull_file),
                         mandible = surface::read_surface(mandible_file);
  Completed done;
  scene::AnatomyPlan plan;
  plan.file = "head.mrk.json";
  plan.landmarks = propose_landmarks(skin, skull, mandible, {}).found;
  for (const std::string& name : without) plan.landmarks.erase(name);
  if (overjet)
    plan.landmarks["lower_incisor_edge"].y() = plan.landmarks["upper_incisor_edge"].y() + *overjet;
  done.scene.anatomy = plan;
  done.scene.tissue.material = scene::Material{};
  done.scene.tissue.attach_regions.push_back(
      {scene::Sphere{Vec3::Zero(), 1}, scene::Attach::slide, 0});
  complete(skin, done.scene, done.remarks);
  return done;
}

Completed complete_shipped(const std::vector<std::string>& without = {},
                           std::optional<double> overjet = {}) {
  const std::string head = REPOSE_MESHES "/head_";
  return complete_head(head + "skin.ply", head + "skull.ply", head + "mandible.ply", without,
                       overjet);
}

bool says(const Completed& done, const std::string& part) {
  return std::any_of(done.remarks.begin(), done.remarks.end(),
                     [&](const std::string& line) { return line.find(part) != std::string::npos; });
}

/// The remarks on the shipped head, turned with its landmarks about the x axis.
Completed complete_turned(double degrees) {
  const std::string head = REPOSE_MESHES "/head_";
  surface::Surface skin = surface::read_surface(head + "skin.ply"),
                   skull = surface::read_surface(head + "skull.ply"),
                   mandible = surface::read_surface(head + "mandible.ply");
  Completed done;
  scene::AnatomyPlan& plan = done.scene.anatomy.emplace();
  plan.landmarks = propose_landmarks(skin, skull, mandible, {}).found;
  const Mat3 turn = Eigen::AngleAxisd(degrees * M_PI / 180, Vec3::UnitX()).toRotationMatrix();
  for (auto& [name, place] : plan.landmarks) place = turn * place;
  plan.axes = scene::head_axes(plan.landmarks);
  for (surface::Surface* surface : {&skin, &skull, &mandible})
    for (Vec3& place : surface->points) place = turn * place;
  plan.part_lips = plan.vestibule = false;
  complete(skin, done.scene, done.remarks);
  return done;
}

/// The number before " degrees chin `way`" in the remarks; 0 where there is none.
int pitch_reported(const Completed& done, const std::string& way) {
  const std::string before = "the head lies about ";
  for (const std::string& line : done.remarks)
    if (const size_t at = line.find(before);
        at != std::string::npos && line.find(" degrees chin " + way) != std::string::npos)
      return std::stoi(line.substr(at + before.size()));
  return 0;
}

TEST(CompleteScene, AHeadThatIsPitchedInTheScanIsReported) {
  EXPECT_NEAR(pitch_reported(complete_turned(-10), "up in the scan"), 10, 1);
  EXPECT_NEAR(pitch_reported(complete_turned(10), "down"), 10, 1);
  EXPECT_FALSE(says(complete_turned(0), "degrees chin"));
  EXPECT_FALSE(says(complete_turned(4), "degrees chin"));
}

TEST(CompleteScene, AnOpenMouthIsNotParted) {
  const Completed done = complete_shipped();
  EXPECT_TRUE(done.scene.incisions.empty());
  EXPECT_TRUE(says(done, "the mouth is open in the scan"));
}

/// Closes the openings of a skin whose border lies within `reach` mm of a place.
surface::Surface closed_near(surface::Surface skin, const Vec3& place, double reach) {
  const surface::EdgeTable edges(skin.triangles);
  skin.points.push_back(place);
  for (int64_t e = 0; e < edges.edges(); ++e) {
    const surface::HalfEdge& half = edges[e].front();
    if (edges[e].size() > 1 || (skin.points[half.low] - place).norm() > reach) continue;
    skin.triangles.push_back({half.low, half.high, std::ssize(skin.points) - 1});
  }
  return skin;
}

TEST(FitLips, AMouthThatTheSolvedSkinClosesIsParted) {
  const surface::Surface given = surface::read_surface(REPOSE_MESHES "/head_skin.ply");
  Completed open = complete_shipped(), closed = open;
  fit_lips(given, open.scene, open.remarks);
  EXPECT_TRUE(open.scene.incisions.empty());
  const Vec3 stomion = closed.scene.anatomy->landmarks.at("stomion");
  const surface::Surface solved = closed_near(given, stomion, 40);
  fit_lips(solved, closed.scene, closed.remarks);
  ASSERT_EQ(closed.scene.incisions.size(), 1u);
  EXPECT_TRUE(closed.scene.incisions[0].parts_lips());
  EXPECT_GT(closed.scene.incisions[0].path.size(), 10u);
  fit_lips(solved, closed.scene, closed.remarks);
  EXPECT_EQ(closed.scene.incisions.size(), 1u) << "parted already";
}

TEST(FitLips, ACreaseThatTheGivenSkinHasDeeperIsBroughtForward) {
  const surface::Surface given = surface::read_surface(REPOSE_MESHES "/head_skin.ply");
  Completed done = complete_shipped();
  scene::AnatomyPlan& plan = *done.scene.anatomy;
  plan.lip_gap.clear();
  const std::array on_skin{plan.landmarks.at("pronasale"), plan.landmarks.at("pogonion_soft")};
  scene::Incision& cut = done.scene.incisions.emplace_back();
  for (const double behind : {0.5, 8.0})
    for (const bool by_landmarks : {false, true}) {
      cut.by_landmarks = by_landmarks;
      cut.path = {on_skin[0] + Vec3(0, behind, 0), on_skin[1] + Vec3(0, behind, 0)};
      fit_lips(given, done.scene, done.remarks);
      for (const int i : {0, 1}) {
        const Vec3 moved = cut.path[i] - on_skin[i];
        EXPECT_NEAR(moved.y(), by_landmarks && behind > 2 ? 0 : behind, 0.3);
        EXPECT_NEAR(std::hypot(moved.x(), moved.z()), 0, 1e-9);
      }
    }
}

TEST(CompleteScene, TheVestibuleComesBeforeRegionsOfTheScene) {
  const Completed done = complete_shipped({}, 5);
  ASSERT_EQ(done.scene.tissue.attach_regions.size(), 3u);
  EXPECT_EQ(done.scene.tissue.attach_regions[0].attach, scene::Attach::contact);
  EXPECT_EQ(done.scene.tissue.attach_regions[1].attach, scene::Attach::contact);
  EXPECT_EQ(done.scene.tissue.attach_regions[2].attach, scene::Attach::slide);
}

TEST(CompleteScene, LowerTeethHaveAGapOfTheirOwnBelowStomion) {
  const Completed done = complete_shipped({}, 5);
  const scene::AttachRegion &whole = done.scene.tissue.attach_regions.at(0),
                            &lower = done.scene.tissue.attach_regions.at(1);
  const auto &outer = std::get<scene::TurnedBox>(whole.where).box,
             &inner = std::get<scene::TurnedBox>(lower.where).box;
  const double stomion = done.scene.anatomy->landmarks.at("stomion").z();
  EXPECT_NEAR(inner.center.z() + inner.size.z() / 2, stomion, 1e-9);
  EXPECT_NEAR(inner.center.z() - inner.size.z() / 2, outer.center.z() - outer.size.z() / 2, 1e-9);
  EXPECT_EQ(whole.gap, 1);
  EXPECT_EQ(lower.gap, scene::gap_of_lower_teeth(*done.scene.anatomy));
  EXPECT_GT(lower.gap, whole.gap);
}

/// The first region of a scene, a box, lies between the heights of two of its landmarks.
void expect_between(const Completed& done, const char* low, const char* high) {
  const auto& box = std::get<scene::TurnedBox>(done.scene.tissue.attach_regions.at(0).where).box;
  const scene::Landmarks& marks = done.scene.anatomy->landmarks;
  EXPECT_NEAR(box.center.z() + box.size.z() / 2, marks.at(high).z(), 1e-9);
  EXPECT_NEAR(box.center.z() - box.size.z() / 2, marks.at(low).z(), 1e-9);
}

TEST(CompleteScene, TheVestibuleEndsWithTheLips) {
  const Completed done = complete_shipped();
  const scene::Landmarks& marks = done.scene.anatomy->landmarks;
  ASSERT_LT(marks.at("subnasale").z(), marks.at("nasal_spine").z());
  ASSERT_GT(marks.at("b_soft").z(), marks.at("b_point").z());
  expect_between(done, "b_soft", "subnasale");
  expect_between(complete_shipped({"subnasale", "b_soft"}), "b_point", "nasal_spine");
}

TEST(CompleteScene, AMissingSulcusLeavesTheVestibuleOut) {
  const Completed done = complete_shipped({"b_point"});
  EXPECT_EQ(done.scene.tissue.attach_regions.size(), 1u);
  EXPECT_TRUE(says(done, "landmark b_point is missing"));
}

TEST(CompleteScene, TheToneIsStatedOrWhyThereIsNone) {
  EXPECT_TRUE(says(complete_shipped(), "ring muscle by landmarks: a tone of up to 0.006 N/mm²"));
  const Completed without = complete_shipped({"b_soft"});
  EXPECT_TRUE(says(without, "landmark b_soft is missing, so the ring muscle has no tone"));
}

TEST(CompleteScene, TheCreaseIsFoundByTheCornersAlone) {
  const std::string head = REPOSE_HEAD_DATA "/";
  if (!std::filesystem::exists(head + "skin.ply")) GTEST_SKIP() << "no real head";
  const surface::Surface skin = surface::read_surface(head + "skin.ply");
  const surface::TriangleTree tree(skin);
  const Completed done = complete_head(head + "skin.ply", head + "skull.ply", head + "mandible.ply",
                                       {"stomion", "upper_incisor_edge"});
  ASSERT_EQ(done.scene.incisions.size(), 1u);
  const scene::Incision& mouth = done.scene.incisions[0];
  EXPECT_EQ(mouth.name, "mouth");
  ASSERT_GT(mouth.path.size(), 15u);
  for (const Vec3& point : mouth.path) {
    EXPECT_LT(std::sqrt(tree.nearest(point).squared), 1.5);
    EXPECT_NEAR(point.z(), 367, 5);  // placed by hand: 366 to 369
  }
  EXPECT_GT(mouth.path.back().x() - mouth.path.front().x(), 45);
}

}  // namespace
}  // namespace repose::anatomy
