#include "repose/anatomy/propose.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>

#include "../../folder.h"
#include "repose/anatomy/picture.h"
#include "repose/scene/landmark_names.h"
#include "repose/scene/landmarks.h"
#include "repose/surface/component.h"
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
      EXPECT_LT((proposal.found.at(name) - known).norm(), name == "menton_bone" ? 1 : 6) << name;
    }
  ASSERT_EQ(proposal.remarks.size(), 1u);
  EXPECT_NE(proposal.remarks[0].find("mouth is open"), std::string::npos);
}

TEST(ProposeLandmarks, TurnWithTheHead) {
  const Proposal upright = propose(shipped());
  for (const auto& [pitch, yaw, roll] : {std::array{45.0, 0.0, 0.0},
                                         {-45.0, 0.0, 0.0},
                                         {45.0, 30.0, -30.0},
                                         {-45.0, -30.0, -30.0}}) {
    const Mat3 turn = (Eigen::AngleAxisd(pitch * M_PI / 180, Vec3::UnitX()) *
                       Eigen::AngleAxisd(roll * M_PI / 180, Vec3::UnitY()) *
                       Eigen::AngleAxisd(yaw * M_PI / 180, Vec3::UnitZ()))
                          .toRotationMatrix();
    const Proposal tilted = propose(turned(turn));
    ASSERT_EQ(tilted.found.size(), upright.found.size());
    for (const auto& [name, place] : upright.found)
      EXPECT_LT((tilted.found.at(name) - turn * place).norm(), 0.5) << name << " " << pitch;
  }
}

TEST(ProposeLandmarks, NoiseOfVerticesHardlyMovesTheRami) {
  const Proposal smooth = propose(shipped());
  for (const unsigned seed : {0u, 1u, 2u}) {
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, 0.3);
    Head head = shipped();
    for (Vec3& p : head.mandible.points) p += Vec3(noise(random), noise(random), noise(random));
    const Proposal rough = propose(head);
    for (const char* name :
         {"gonion_right", "gonion_left", "condyle_right_center", "condyle_left_center"})
      EXPECT_LT((rough.found.at(name) - smooth.found.at(name)).norm(), 1.5) << name << seed;
  }
}

TEST(ProposeLandmarks, ACondyleThatEndsAtARimIsMissing) {
  Head head = shipped();
  std::erase_if(head.mandible.triangles, [&](const Triangle& t) {
    return std::ranges::any_of(t, [&](int64_t p) { return head.mandible.points[p].z() > -3; });
  });
  EXPECT_TRUE(propose(head).missing.contains("condyle_left_center"));
}

surface::Surface shuffled(const surface::Surface& part, std::mt19937& random) {
  std::vector<int64_t> place(part.points.size());
  std::iota(place.begin(), place.end(), 0);
  std::shuffle(place.begin(), place.end(), random);
  surface::Surface result = part;
  for (size_t i = 0; i < place.size(); ++i) result.points[place[i]] = part.points[i];
  for (Triangle& triangle : result.triangles)
    for (int64_t& corner : triangle) corner = place[corner];
  std::shuffle(result.triangles.begin(), result.triangles.end(), random);
  return result;
}

TEST(ProposeLandmarks, DoNotDependOnTheOrderOfVerticesAndTriangles) {
  const Landmarks expected = propose(shipped()).found;
  std::mt19937 random(1);
  for (int order = 0; order < 3; ++order) {
    Head head = shipped();
    for (surface::Surface* part : {&head.skin, &head.skull, &head.mandible})
      *part = shuffled(*part, random);
    const Landmarks found = propose(head).found;
    ASSERT_EQ(found.size(), expected.size());
    for (const auto& [name, place] : expected)
      EXPECT_LT((found.at(name) - place).norm(), 1e-6) << name;
  }
}

TEST(ProposeLandmarks, DoNotDependOnPointsThatCoincide) {
  Head soup = shipped();
  for (surface::Surface* part : {&soup.skin, &soup.skull, &soup.mandible}) {
    std::vector<Vec3> corners;
    for (Triangle& triangle : part->triangles)
      for (int64_t& corner : triangle) {
        corners.push_back(part->points[corner]);
        corner = static_cast<int64_t>(corners.size()) - 1;
      }
    part->points = corners;
  }
  const Landmarks expected = propose(shipped()).found, found = propose(soup).found;
  ASSERT_EQ(found.size(), expected.size());
  for (const auto& [name, place] : expected)
    EXPECT_LT((found.at(name) - place).norm(), 1e-6) << name;
}

/// A surface with triangles whose middle has z > 20 cut into four.
surface::Surface subdivided_above(const surface::Surface& part) {
  surface::Surface result{part.name, part.points, {}};
  const auto middle = [&](int64_t a, int64_t b) {
    result.points.push_back((part.points[a] + part.points[b]) / 2);
    return static_cast<int64_t>(result.points.size()) - 1;
  };
  for (const Triangle& t : part.triangles) {
    const auto& [a, b, c] = t;
    if (base::mean(base::pick(part.points, t)).z() <= 20) {
      result.triangles.push_back(t);
      continue;
    }
    const int64_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    result.triangles.insert(result.triangles.end(),
                            {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
  }
  return result;
}

TEST(ProposeLandmarks, HardlyDependOnTheSizeOfTriangles) {
  Head head = shipped();
  for (surface::Surface* part : {&head.skin, &head.skull, &head.mandible})
    for (Vec3& p : part->points) p.x() += 2 * std::tanh(p.z() / 20);
  const Landmarks expected = propose(head).found;
  const Landmarks found = propose({head.skin, subdivided_above(head.skull), head.mandible}).found;
  for (const auto& [name, place] : expected)
    EXPECT_LT((found.at(name) - place).norm(), 0.3) << name;
}

/// Adds a tetrahedron with edges of `size` along the axes.
void add_speck(surface::Surface& part, const Vec3& place, double size) {
  surface::append(
      {"",
       {place, place + Vec3(size, 0, 0), place + Vec3(0, size, 0), place + Vec3(0, 0, size)},
       {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}},
      part);
}

TEST(ProposeLandmarks, LieNotOnSpecks) {
  const Proposal clean = propose(shipped());
  const auto at = [&](const char* name, double y, double z) {
    return Vec3(clean.found.at(name) + Vec3(0, y, z));
  };
  Head head = shipped();
  add_speck(head.skin, at("pronasale", -15, 0), 0.6);
  add_speck(head.mandible, at("condyle_left_center", 0, 15), 0.6);
  add_speck(head.skull, at("nasal_spine", -5, 0), 0.6);
  const Proposal found = propose(head);
  for (const auto& [name, place] : clean.found)
    EXPECT_LT((found.found.at(name) - place).norm(), 1e-6) << name;
  EXPECT_EQ(found.remarks, clean.remarks);
  for (int i = 0; i < 15; ++i) add_speck(head.skin, at("pronasale", -15 - 9 * i, 0), 4);
  const auto remarks = propose(head).remarks;
  EXPECT_EQ(remarks.back().find("16 small separate parts of SKIN were left out, with 1.4 %"), 0u)
      << remarks.back();
}

/// Adds a rectangle in the frontal plane.
void add_wall(surface::Surface& skin, const Vec3& middle, double half_width, double half_height) {
  const auto corner = [&](double x, double z) {
    return Vec3(middle + Vec3(x * half_width, 0, z * half_height));
  };
  surface::append(
      {"", {corner(-1, -1), corner(-1, 1), corner(1, -1), corner(1, 1)}, {{0, 1, 2}, {1, 3, 2}}},
      skin);
}

TEST(ProposeLandmarks, LieOnTheSkinAroundAHole) {
  Head head = shipped();
  add_wall(head.skin, {0, 100, 0}, 60, 120);  // seen through a hole
  const Landmarks whole = propose(head).found;
  const auto with_hole = [&](const Vec3& middle, double radius) {
    Head holed = head;
    std::erase_if(holed.skin.triangles, [&](const Triangle& t) {
      return (base::mean(base::pick(head.skin.points, t)) - middle).norm() < radius;
    });
    return holed;
  };
  for (const char* name : {"pronasale", "upper_lip", "b_soft", "pogonion_soft"}) {
    const Head holed = with_hole(whole.at(name), 3);
    ASSERT_LT(holed.skin.triangles.size(), head.skin.triangles.size()) << name;
    EXPECT_LT((propose(holed).found.at(name) - whole.at(name)).norm(), 1.5) << name;
  }
  EXPECT_TRUE(propose(with_hole(whole.at("pogonion_soft"), 20)).missing.contains("pogonion_soft"));
}

TEST(ProposeLandmarks, UnevenCornersOfTheMouthAreReported) {
  Head head = shipped();
  add_wall(head.skin, propose(head).found.at("stomion") + Vec3(34, -10, 0), 26, 20);
  const Proposal covered = propose(head);
  EXPECT_TRUE(std::any_of(covered.remarks.begin(), covered.remarks.end(), [](const auto& line) {
    return line.find("corners of the mouth") != std::string::npos;
  }));
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

TEST(ProposeLandmarks, RefusesOtherFramesAndUnits) {
  const auto refused = [](const Mat3& change) { return refusal([&] { propose(turned(change)); }); };
  const Mat3 chin_up = Eigen::AngleAxisd(0.7, Vec3::UnitX()).toRotationMatrix();
  const Mat3 ras = Vec3(-1, -1, 1).asDiagonal(), feet_first = Vec3(-1, 1, -1).asDiagonal(),
             front_back = Vec3(1, -1, 1).asDiagonal(), up_down = Vec3(1, 1, -1).asDiagonal();
  Mat3 permuted = Mat3::Zero();
  permuted(0, 1) = permuted(1, 2) = permuted(2, 0) = 1;
  for (const auto& [change, expected] : std::vector<std::pair<Mat3, std::string>>{
           {ras, "along -x, -y, +z, as in RAS"},
           {chin_up * ras, "along -x, -y, +z, as in RAS"},
           {front_back, "or of y alone if the scan is mirrored"},
           {feet_first, "along -x, +y, -z; "},
           {up_down, "or of z alone if the scan is mirrored"},
           {permuted, "along +z, +x, +y; "},
           {10 * Mat3::Identity(), "reaches 832 mm from its middle, a mandible 35 to 170 mm"},
           {0.1 * Mat3::Identity(), "reaches 8.32 mm from its middle, a mandible 35 to 170 mm"}})
    EXPECT_NE(refused(change).find(expected), std::string::npos) << refused(change);
}

TEST(ProposeLandmarks, RefusesExchangedBonesAndPartsOfSeveralHeads) {
  const Head& head = shipped();
  EXPECT_NE(refusal([&] {
              propose_landmarks(head.skin, head.mandible, head.skull, {});
            }).find("give the skull and the mandible in this order"),
            std::string::npos);
  Head far = head;
  for (Vec3& p : far.skin.points) p.x() += 500;
  EXPECT_NE(refusal([&] { propose(far); }).find("one head in one frame"), std::string::npos);
  far = head;
  for (Vec3& p : far.mandible.points) p.x() += 80;
  EXPECT_NE(refusal([&] { propose(far); }).find("midsagittal plane"), std::string::npos);
}

/// A surface cut off flat at a limit of a coordinate (sign 1: above it, −1: below).
surface::Surface cut_off(surface::Surface part, int axis, double limit, int sign) {
  for (Vec3& p : part.points)
    p[axis] = sign > 0 ? std::min(p[axis], limit) : std::max(p[axis], limit);
  return part;
}

TEST(ProposeLandmarks, LieNotWhereTheScanEnds) {
  const Landmarks whole = propose(shipped()).found;
  const auto lacks = [&](const Head& head, const std::string& name, const std::string& why) {
    const auto missing = propose(head).missing;
    return missing.contains(name) && missing.at(name).find(why) != std::string::npos;
  };
  Head head = shipped();
  head.mandible = cut_off(head.mandible, 2, whole.at("condyle_left_center").z() - 8, 1);
  for (const char* name : {"condyle_left_center", "condyle_right_center"})
    EXPECT_TRUE(lacks(head, name, "is cut off")) << name;
  head.mandible = cut_off(shipped().mandible, 2, whole.at("menton_bone").z() + 8, -1);
  EXPECT_TRUE(lacks(head, "pogonion_bone", "is cut off"));
  EXPECT_EQ(propose(head).found.size() + propose(head).missing.size(),
            scene::landmark_names().size());
  head = shipped();
  head.skin = cut_off(head.skin, 1, whole.at("pronasale").y() + 8, -1);
  EXPECT_TRUE(lacks(head, "pronasale", "is cut off"));
  head = shipped();
  std::erase_if(head.mandible.triangles, [&](const Triangle& triangle) {
    return head.mandible.points[triangle[0]].z() > whole.at("condyle_left_center").z() - 8;
  });
  EXPECT_TRUE(lacks(head, "condyle_left_center", "is cut off"));
}

TEST(ProposeLandmarks, RemarksOnARamusThatIsFarShorter) {
  Head head = shipped();
  const double limit = propose(head).found.at("condyle_left_center").z() - 20;
  for (Vec3& p : head.mandible.points)
    if (p.x() > 0 && p.z() > limit) p.z() = limit + 0.1 * (p.z() - limit);
  const auto remarks = propose(head).remarks;
  EXPECT_TRUE(std::ranges::any_of(remarks, [](const std::string& line) {
    return line.find("the left ramus is") != std::string::npos;
  }));
}

TEST(ProposeLandmarks, RemarksOnRamiThatEndFarBelowTheirCoronoids) {
  const auto remarked = [](const Head& head) {
    return std::ranges::count_if(propose(head).remarks, [](const std::string& line) {
      return line.find("at the coronoid process") != std::string::npos;
    });
  };
  Head head = shipped();
  EXPECT_EQ(remarked(head), 0);
  const Vec3 condyle = propose(head).found.at("condyle_left_center");
  const double limit = condyle.z() - 12;
  for (Vec3& p : head.mandible.points)
    if (p.y() > condyle.y() - 12 && p.z() > limit) p.z() = limit + 0.1 * (p.z() - limit);
  EXPECT_EQ(remarked(head), 2);
}

TEST(ProposeLandmarks, CornersOfTheMouthAreInFrontWhereSkinIsMissing) {
  const Vec3 stomion = propose(shipped()).found.at("stomion");
  for (const double aside : {6.5, 7.0, 8.0}) {
    Head head = shipped();
    std::erase_if(head.skin.triangles, [&](const Triangle& triangle) {
      return head.skin.points[triangle[0]].x() < stomion.x() - aside &&
             head.skin.points[triangle[0]].y() < stomion.y() + 60;
    });
    add_wall(head.skin, stomion + Vec3(-45, 150, 0), 45, 60);  // the neck
    const Landmarks found = propose(head).found;
    ASSERT_TRUE(found.contains("mouth_right"));
    EXPECT_LT(found.at("mouth_right").y(), stomion.y() + 30) << aside;
  }
}

TEST(ProposeLandmarks, RemarksOnTrianglesThatPointInwards) {
  const Proposal mirrored = propose(turned(Vec3(-1, 1, 1).asDiagonal()));
  ASSERT_EQ(mirrored.remarks.size(), 2u);
  EXPECT_NE(mirrored.remarks[1].find("MANDIBLE point inwards"), std::string::npos);
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
