#include "repose/tools/bone_separation/propose_points.h"

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "../surface/shapes.h"
#include "repose/tools/bone_separation/part_bones.h"
#include "volumes.h"

namespace repose::tools::bone_separation {
using namespace imaging;
namespace propose_points_test {

constexpr double level = 226;

bool within(double value, double low, double high) { return value >= low && value <= high; }

/// A jaw of a front, two bodies and two rami, its lowest point at z = −62 mm.
bool in_jaw(const Vec3& p) {
  const double x = std::abs(p.x()), z = p.z() + 62;
  return (x < 50 && within(p.y(), -62, -50) && within(z, 0, 30)) ||
         (within(x, 32, 50) && within(p.y(), -62, 20) && within(z, 0, 15)) ||
         (within(x, 38, 50) && within(p.y(), -5, 20) && within(z, 0, 72));
}

bool in_joint(const Vec3& p) {
  return within(std::abs(p.x()), 38, 50) && within(p.y(), -5, 20) && within(p.z() + 62, 72, 75);
}

/// A skull with an upper jaw, which touches the jaw at the teeth and in both joints.
double head(const Vec3& p, double joint) {
  const double x = std::abs(p.x()), z = p.z() + 62;
  if (in_jaw(p)) return 1000;
  if (x < 28 && within(p.y(), -62, -52) && within(z, 30, 50)) return 1500;
  if (x < 28 && within(p.y(), -64, -20) && within(z, 48, 76)) return 1000;
  if (x < 58 && within(p.y(), -60, 60) && within(z, 75, 122)) return 1000;
  if (in_joint(p)) return joint;
  return -1000;
}

Volume scanned(double joint) {
  return sampled(90, 1.5 * Mat3::Identity(), [&](const Vec3& p) { return head(p, joint); });
}

TEST(ProposePoints, skull_and_jaw_are_parted_without_a_person) {
  const Volume volume = scanned(400);
  const auto points = propose_points(volume, level);
  std::array<bool, 2> joints{};
  for (const Vec3& p : points[1]) {
    EXPECT_TRUE(in_jaw(p) || p.z() + 62 < 36) << p.transpose();
    if (p.z() + 62 > 60) joints[p.x() > 0] = true;
  }
  EXPECT_TRUE(joints[0] && joints[1]);
  EXPECT_GT(points[0].size(), 10u);
  for (const Vec3& p : points[0]) EXPECT_GT(p.z() + 62, 48) << p.transpose();
  const PartedBones bones = part_bones(volume, level, points);
  int wrong = 0, all = 0;
  for (size_t v = 0; v < volume.values.size(); ++v) {
    const auto n = static_cast<int64_t>(v);
    const Vec3 at = volume.origin + volume.axes * Vec3(static_cast<double>(n % 90),
                                                       static_cast<double>(n / 90 % 90),
                                                       static_cast<double>(n / 8100));
    if (!in_jaw(at)) continue;
    ++all;
    if (bones.parts[1].values[v] < level) ++wrong;
  }
  EXPECT_LT(wrong, 0.01 * all);
}

TEST(ProposePoints, a_head_may_be_turned_in_the_scan) {
  for (const auto& [pitch, roll, yaw] :
       {std::array{0.0, 20.0, 0.0}, {0.0, -20.0, 10.0}, {14.0, 12.0, -10.0}}) {
    const Mat3 turn = (Eigen::AngleAxisd(yaw * M_PI / 180, Vec3::UnitZ()) *
                       Eigen::AngleAxisd(roll * M_PI / 180, Vec3::UnitY()) *
                       Eigen::AngleAxisd(pitch * M_PI / 180, Vec3::UnitX()))
                          .toRotationMatrix();
    const auto points =
        propose_points(sampled(116, 1.5 * Mat3::Identity(),
                               [&](const Vec3& p) { return head(turn.transpose() * p, 400); }),
                       level);
    std::array<bool, 2> joints{};
    for (const Vec3& point : points[1]) {
      const Vec3 p = turn.transpose() * point;
      EXPECT_TRUE(in_jaw(p) || p.z() + 62 < 36) << pitch << " " << roll << ": " << p.transpose();
      if (p.z() + 62 > 60) joints[p.x() > 0] = true;
    }
    EXPECT_TRUE(joints[0] && joints[1]) << pitch << " " << roll;
    for (const Vec3& point : points[0])
      EXPECT_GT((turn.transpose() * point).z() + 62, 45) << pitch << " " << roll;
  }
}

TEST(ProposePoints, a_volume_that_ends_inside_the_jaw_is_refused) {
  for (const Vec3& shift : {Vec3(0, 0, -10), Vec3(0, 60, 0)}) {
    const Volume volume =
        sampled(90, 1.5 * Mat3::Identity(), [&](const Vec3& p) { return head(p - shift, 400); });
    EXPECT_NE(surface::refusal([&] { propose_points(volume, level); }).find("ends inside the jaw"),
              std::string::npos)
        << shift.transpose();
  }
}

TEST(ProposePoints, a_jaw_that_swung_back_is_found_above_the_hyoid) {
  const Vec3 back(0, 40, 0);
  const Volume volume = sampled(90, 1.5 * Mat3::Identity(), [&](const Vec3& p) -> double {
    const Vec3 at = p - back;
    if (std::abs(p.x()) < 10 && within(p.y(), -26, -14) && p.z() + 62 < -1) return 1000;
    if (in_jaw(at)) return 1000;
    if (in_joint(at)) return 400;
    return in_jaw(p) ? -1000 : head(p, -1000);
  });
  const auto points = propose_points(volume, level);
  EXPECT_GT(points[1].size(), 10u);
  for (const Vec3& p : points[1]) EXPECT_TRUE(in_jaw(p - back) || p.z() + 62 < 36) << p.transpose();
}

TEST(ProposePoints, noise_that_joins_skull_and_jaw_is_averaged) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 450);
  const Volume volume =
      sampled(134, Mat3::Identity(), [&](const Vec3& p) { return head(p, 700) + noise(random); });
  const auto points = propose_points(volume, level);
  EXPECT_GT(points[1].size(), 10u);
  for (const Vec3& p : points[1]) EXPECT_TRUE(in_jaw(p) || p.z() + 62 < 37) << p.transpose();
}

TEST(ProposePoints, a_fused_jaw_and_a_skull_alone_are_refused) {
  const auto refused = [](const Volume& volume) {
    return surface::refusal([&] { propose_points(volume, level); });
  };
  EXPECT_NE(refused(scanned(1000)).find("give points in skull and jaw"), std::string::npos);
  const Volume skull = sampled(90, 1.5 * Mat3::Identity(), [](const Vec3& p) {
    return p.z() > 0 && p.norm() < 60 && p.norm() > 50 ? 1000 : -1000;
  });
  EXPECT_NE(refused(skull).find("jaw"), std::string::npos);
  EXPECT_NE(refused(sampled(41, 2 * Mat3::Identity(), [](const Vec3&) { return 0; })).find("226"),
            std::string::npos);
  for (const double unit : {0.001, 0.1, 1000.0})
    EXPECT_NE(refused(sampled(20, unit * Mat3::Identity(), [](const Vec3&) { return 1000; }))
                  .find("give its spacing in mm"),
              std::string::npos)
        << unit;
}

}  // namespace propose_points_test
}  // namespace repose::tools::bone_separation
