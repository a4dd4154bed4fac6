#include "repose/anatomy/propose.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "../../folder.h"
#include "repose/anatomy/picture.h"
#include "repose/scene/landmarks.h"
#include "repose/surface/read.h"

namespace repose::anatomy {
namespace {

using test::refusal;

struct Head {
  surface::Surface skin, skull, mandible;
};

const Head& shipped() {
  static const Head head{surface::read_surface(REPOSE_MESHES "/head_skin.ply"),
                         surface::read_surface(REPOSE_MESHES "/head_skull.ply"),
                         surface::read_surface(REPOSE_MESHES "/head_mandible.ply")};
  return head;
}

Head turned(const Mat3& rotation) {
  Head head = shipped();
  for (surface::Surface* part : {&head.skin, &head.skull, &head.mandible})
    for (Vec3& p : part->points) p = rotation * p;
  return head;
}

Proposal propose(const Head& head, const Landmarks& given = {}) {
  return propose_landmarks(head.skin, head.skull, head.mandible, given);
}

TEST(ProposeLandmarks, LieNearThoseOfTheShippedHead) {
  const Proposal proposal = propose(shipped());
  EXPECT_TRUE(proposal.missing.empty());
  for (const auto& [name, known] : scene::landmarks_by_name(REPOSE_MESHES "/head_landmarks.json"))
    if (proposal.found.contains(name)) {
      EXPECT_LT((proposal.found.at(name) - known).norm(), 6) << name;
    }
  ASSERT_EQ(proposal.remarks.size(), 1u);
  EXPECT_NE(proposal.remarks[0].find("mouth is open"), std::string::npos);
}

TEST(ProposeLandmarks, TurnWithTheHead) {
  const Mat3 turn =
      (Eigen::AngleAxisd(0.15, Vec3::UnitX()) * Eigen::AngleAxisd(-0.1, Vec3::UnitY()) *
       Eigen::AngleAxisd(0.12, Vec3::UnitZ()))
          .toRotationMatrix();
  const Proposal upright = propose(shipped()), tilted = propose(turned(turn));
  for (const auto& [name, place] : upright.found) {
    const bool by_height = name.starts_with("condyle") || name.starts_with("gonion");
    ASSERT_TRUE(tilted.found.contains(name)) << name;
    EXPECT_LT((tilted.found.at(name) - turn * place).norm(), by_height ? 4 : 2.5) << name;
  }
}

TEST(ProposeLandmarks, GivenOnesAreKeptAndGuide) {
  const Vec3 chin(0, -92, -58);
  const Proposal proposal = propose(shipped(), {{"pogonion_bone", chin}});
  EXPECT_EQ(proposal.found.at("pogonion_bone"), chin);
}

TEST(ProposeLandmarks, NoneThatIsGivenIsReplaced) {
  Landmarks given = {{"implant", Vec3(1, -70, -20)}};
  for (const auto& [name, place] : propose(shipped()).found) given[name] = place + Vec3(2, 1, -1.5);
  ASSERT_EQ(given.size(), scene::landmark_names().size() + 1);
  const Proposal all = propose(shipped(), given);
  EXPECT_EQ(all.found, given);
  EXPECT_TRUE(all.missing.empty());
  for (const auto& [name, place] : given)
    EXPECT_EQ(propose(shipped(), {{name, place}}).found.at(name), place) << name;
}

TEST(ProposeLandmarks, RefusesRasAndExchangedBones) {
  const Head ras = turned(Vec3(-1, -1, 1).asDiagonal());
  EXPECT_NE(refusal([&] { propose(ras); }).find("as in RAS"), std::string::npos);
  const Head& head = shipped();
  EXPECT_NE(refusal([&] {
              propose_landmarks(head.skin, head.mandible, head.skull, {});
            }).find("give the skull and the mandible in this order"),
            std::string::npos);
  Head far = head;
  for (Vec3& p : far.skin.points) p.x() += 500;
  EXPECT_NE(refusal([&] { propose(far); }).find("one head in one frame"), std::string::npos);
}

TEST(ProposeLandmarks, ASkullThatEndsLowHasNoNasion) {
  Head cut = shipped();
  std::erase_if(cut.skull.triangles, [&](const Triangle& t) {
    return std::any_of(t.begin(), t.end(), [&](int64_t v) { return cut.skull.points[v].z() > 20; });
  });
  const Proposal proposal = propose(cut);
  EXPECT_TRUE(proposal.missing.contains("nasion_bone"));
  EXPECT_TRUE(proposal.found.contains("nasal_spine"));
}

TEST(Picture, NamesEveryLandmark) {
  const Proposal proposal = propose(shipped());
  const std::string picture =
      draw_landmarks(shipped().skin, shipped().skull, shipped().mandible, proposal);
  for (const auto& [name, place] : proposal.found)
    EXPECT_NE(picture.find(">" + name + "<"), std::string::npos) << name;
}

}  // namespace
}  // namespace repose::anatomy
