#include "repose/surface/collision.h"

#include <cstdlib>
#include <random>
#include <unordered_map>

#include "repose/surface/read.h"
#include "shapes.h"

namespace repose::surface {
namespace collision_test {

using Corners = std::array<Vec3, 3>;

/// Tells if the segment from p to q goes through a triangle, by the signs of five volumes.
bool pierces(const Vec3& p, const Vec3& q, const Corners& t) {
  const auto volume = [](const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    return (b - a).cross(c - a).dot(d - a);
  };
  if (volume(t[0], t[1], t[2], p) * volume(t[0], t[1], t[2], q) > 0) return false;
  const double u = volume(p, q, t[0], t[1]), v = volume(p, q, t[1], t[2]),
               w = volume(p, q, t[2], t[0]);
  return (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
}

bool cross(const Corners& a, const Corners& b) {
  for (int k = 0; k < 3; ++k)
    if (pierces(a[k], a[(k + 1) % 3], b) || pierces(b[k], b[(k + 1) % 3], a)) return true;
  return false;
}

/// All pairs of triangles that share a cell of a grid, tried one by one.
class Reference {
 public:
  Reference(const Surface& surface, double cell) : surface_(surface), cell_(cell) {
    for (size_t t = 0; t < surface.triangles.size(); ++t)
      each_cell(corners(surface, t, Mat4::Identity()), [&](int64_t key) {
        cells_[key].push_back(t);
        return false;
      });
  }

  bool touched_by(const Surface& other, const Mat4& pose) const {
    for (size_t t = 0; t < other.triangles.size(); ++t) {
      const Corners moved = corners(other, t, pose);
      if (each_cell(moved, [&](int64_t key) { return any_crosses(key, moved); })) return true;
    }
    return false;
  }

 private:
  static Corners corners(const Surface& s, size_t t, const Mat4& pose) {
    Corners result;
    for (int k = 0; k < 3; ++k)
      result[k] = (pose * s.points[s.triangles[t][k]].homogeneous()).head<3>();
    return result;
  }

  bool any_crosses(int64_t key, const Corners& moved) const {
    const auto cell = cells_.find(key);
    if (cell == cells_.end()) return false;
    for (const size_t s : cell->second)
      if (cross(corners(surface_, s, Mat4::Identity()), moved)) return true;
    return false;
  }

  template <class Visit>
  bool each_cell(const Corners& t, const Visit& visit) const {
    Eigen::AlignedBox3d box;
    for (const Vec3& p : t) box.extend(p);
    const Eigen::Array3i low = (box.min() / cell_).array().floor().cast<int>(),
                         high = (box.max() / cell_).array().floor().cast<int>();
    for (int i = low[0]; i <= high[0]; ++i)
      for (int j = low[1]; j <= high[1]; ++j)
        for (int k = low[2]; k <= high[2]; ++k)
          if (visit((static_cast<int64_t>(i) * 100003 + j) * 100003 + k)) return true;
    return false;
  }

  const Surface& surface_;
  double cell_;
  std::unordered_map<int64_t, std::vector<size_t>> cells_;
};

/// A ball with bumps, longitude by latitude.
Surface bumpy(int n, double radius) {
  Surface s{"bumpy", {Vec3(0, 0, radius), Vec3(0, 0, -radius)}, {}};
  for (int j = 1; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const double a = 2 * M_PI * i / n, b = M_PI * j / n;
      const double r = radius * (1 + 0.25 * std::sin(5 * a) * std::sin(b) * std::sin(4 * b));
      s.points.push_back(r *
                         Vec3(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b)));
    }
  s.triangles = longitude_latitude(n);
  return s;
}

Mat4 shifted(const Vec3& by) {
  Mat4 pose = Mat4::Identity();
  pose.topRightCorner<3, 1>() = by;
  return pose;
}

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  Vec3 direction() {
    std::normal_distribution<double> n;
    return Vec3(n(engine_), n(engine_), n(engine_)).normalized();
  }
  Mat3 turn(double maximum = M_PI) {
    return Eigen::AngleAxisd(uniform(0, maximum), direction()).toRotationMatrix();
  }

 private:
  std::mt19937 engine_;
};

/// Brings b from far away along a direction to first contact with a and then further by up to
/// `play` mm either way: the poses in which a contact is easily missed.
Mat4 grazing_pose(const CollisionTree& a, const CollisionTree& b, const Vec3& middle_a,
                  const Vec3& middle_b, double play, Random& random) {
  Mat4 pose = Mat4::Identity();
  pose.topLeftCorner<3, 3>() = random.turn();
  const Vec3 direction = random.direction();
  const Vec3 aim = middle_a + 30 * random.uniform(0, 1) * random.direction();
  double away = 600;
  for (int step = 0; step < 400; ++step) {
    pose.topRightCorner<3, 1>() = aim + away * direction - pose.topLeftCorner<3, 3>() * middle_b;
    const double gap = nearest(a, b, pose)->distance;
    if (gap < 1e-3 || away < 0) break;
    away -= gap;
  }
  pose.topRightCorner<3, 1>() += random.uniform(-play, play) * direction;
  return pose;
}

Vec3 middle_of(const Surface& s) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& p : s.points) sum += p;
  return sum / static_cast<double>(s.points.size());
}

/// Tells how many of `poses` touch; every answer must be the reference's.
int agree(const Surface& one, const Surface& other, int poses, double play) {
  const CollisionTree a(one), b(other);
  const Reference reference(one, 3);
  Random random(5);
  int touching = 0;
  for (int i = 0; i < poses; ++i) {
    const Mat4 pose =
        grazing_pose(a, b, middle_of(one), middle_of(other), i % 4 ? play : 20 * play, random);
    const bool requested = reference.touched_by(other, pose);
    EXPECT_EQ(touch(a, b, pose), requested) << "pose " << i;
    touching += requested;
  }
  return touching;
}

TEST(Collision, touch_is_what_every_pair_says) {
  const int touching = agree(bumpy(24, 40), bumpy(18, 25), 400, 0.05);
  EXPECT_GT(touching, 100);
  EXPECT_LT(touching, 300);
}

TEST(Collision, nearest_is_the_least_of_all_pairs) {
  const Surface one = bumpy(10, 30), other = bumpy(8, 20);
  const CollisionTree a(one), b(other);
  Random random(3);
  int apart = 0;
  for (int i = 0; i < 20; ++i) {
    Mat4 pose = shifted(random.uniform(40, 80) * random.direction());
    pose.topLeftCorner<3, 3>() = random.turn();
    double minimum = std::numeric_limits<double>::infinity();
    for (const Triangle& s : one.triangles)
      for (const Triangle& t : other.triangles) {
        const CollisionTree p(
            {"one", {one.points[s[0]], one.points[s[1]], one.points[s[2]]}, {{0, 1, 2}}}),
            q({"two", {other.points[t[0]], other.points[t[1]], other.points[t[2]]}, {{0, 1, 2}}});
        minimum = std::min(minimum, nearest(p, q, pose)->distance);
      }
    EXPECT_EQ(nearest(a, b, pose)->distance, minimum);
    if (minimum == 0) continue;
    ++apart;
    EXPECT_FALSE(nearest(a, b, pose, 0.99 * minimum));
    EXPECT_EQ(pairs_within(a, b, pose, 1.01 * minimum).empty(), false);
    EXPECT_TRUE(pairs_within(a, b, pose, 0.99 * minimum).empty());
  }
  EXPECT_GT(apart, 8);
}

/// By sampling both triangles.
double sampled_distance(const Corners& a, const Corners& b, int n) {
  double minimum = std::numeric_limits<double>::infinity();
  const auto at = [n](const Corners& t, int i, int j) -> Vec3 {
    return t[0] + (t[1] - t[0]) * i / n + (t[2] - t[0]) * j / n;
  };
  for (int i = 0; i <= n; ++i)
    for (int j = 0; i + j <= n; ++j)
      for (int k = 0; k <= n; ++k)
        for (int l = 0; k + l <= n; ++l)
          minimum = std::min(minimum, (at(a, i, j) - at(b, k, l)).norm());
  return minimum;
}

TEST(Collision, distance_of_two_triangles) {
  Random random(9);
  for (int i = 0; i < 100; ++i) {
    Corners a, b;
    for (int k = 0; k < 3; ++k) {
      a[k] = 5 * random.direction();
      b[k] = 5 * random.direction() + Vec3(random.uniform(0, 8), 0, 0);
    }
    const CollisionTree p({"a", {a[0], a[1], a[2]}, {{0, 1, 2}}}),
        q({"b", {b[0], b[1], b[2]}, {{0, 1, 2}}});
    const double found = nearest(p, q, Mat4::Identity())->distance,
                 sampled = sampled_distance(a, b, 16);
    EXPECT_LE(found, sampled + 1e-12);
    EXPECT_GT(found, sampled - 0.8) << i;
    EXPECT_EQ(found == 0, cross(a, b)) << i;
  }
}

TEST(Collision, flat_and_parallel_triangles) {
  const CollisionTree a({"a", {{0, 0, 0}, {9, 0, 0}, {0, 9, 0}}, {{0, 1, 2}}}),
      b({"b", {{1, 1, 0}, {2, 1, 0}, {1, 2, 0}}, {{0, 1, 2}}}),
      needle({"needle", {{1, 1, 2}, {5, 1, 2}, {3, 1, 2}}, {{0, 1, 2}}});
  EXPECT_EQ(nearest(a, b, Mat4::Identity())->distance, 0) << "one inside the other, in one plane";
  EXPECT_EQ(nearest(a, b, shifted({0, 0, 3}))->distance, 3);
  EXPECT_EQ(nearest(a, needle, Mat4::Identity())->distance, 2);
  EXPECT_EQ(nearest(a, needle, shifted({0, 0, -2}))->distance, 0);
}

/// The load of first contact of two cubes, b moving by a twist, by small steps of next().
double first_contact(Encounter& encounter, const std::function<Mat4(double)>& pose,
                     double clearance, double tolerance) {
  for (double load = 0; load <= 1;) {
    const auto next = encounter.next(pose(load), clearance);
    if (next.approach.distance <= clearance + tolerance) return load;
    load += next.load;
  }
  return 2;
}

TEST(Collision, a_gap_within_the_margin_is_a_touch) {
  const CollisionTree a(cube()), b(cube({0, 0, 100}, 100));
  EXPECT_TRUE(touch(a, b, shifted({0, 0, 0.5 * contact_margin})));
  EXPECT_FALSE(touch(a, b, shifted({0, 0, 4 * contact_margin})));
}

TEST(Encounter, cubes_that_approach) {
  const CollisionTree a(cube()), b(cube({110, 5, 5}, 50));
  const auto pose = [](double load) { return shifted({-20 * load, 0, 0}); };
  for (const double clearance : {0.0, 2.0})
    for (const double tolerance : {0.1, 1e-3}) {
      Encounter encounter(a, b, {}, {{0, 0, 0}, {-20, 0, 0}}, clearance + 2 * tolerance);
      EXPECT_EQ(encounter.ignored_area(), 0);
      const double contact = (10 - clearance) / 20,
                   found = first_contact(encounter, pose, clearance, tolerance);
      EXPECT_LE(found, contact);
      EXPECT_GE(found, contact - tolerance / 20 - 1e-6);
    }
  Encounter leaving(a, b, {}, {{0, 0, 0}, {20, 0, 0}}, 0.1);
  EXPECT_EQ(first_contact(
                leaving,
                [](double s) {
                  return shifted({20 * s, 0, 0});
                },
                0, 0.05),
            2);
}

TEST(Encounter, a_thin_plate_that_passes_quickly_is_not_missed) {
  const CollisionTree a(cube({0, 0, 0}, 0.01)), b(cube({30, -5, -5}, 10));
  Encounter encounter(a, b, {}, {{0, 0, 0}, {-100, 0, 0}}, 0.02);
  const double found = first_contact(
      encounter,
      [](double s) {
        return shifted({-100 * s, 0, 0});
      },
      0, 0.01);
  EXPECT_NEAR(found, 0.2999, 2e-4) << "clear of it at both ends";
}

TEST(Encounter, faces_that_touch_from_the_start_may_slide_and_part) {
  const CollisionTree a(cube()), b(cube({0, 0, 100}, 100));
  for (const Vec3& direction : {Vec3(7, 0, 0), Vec3(0, 0, 9), Vec3(3, 4, 5)}) {
    Encounter encounter(a, b, {}, {Vec3::Zero(), direction}, 0.1);
    EXPECT_NEAR(encounter.ignored_area(), 2 * 5 * 100 * 100, 1e-6) << "whole triangles";
    EXPECT_EQ(first_contact(
                  encounter, [&](double s) { return shifted(s * direction); }, 0, 0.05),
              2);
  }
}

TEST(Encounter, random_screws_against_fine_steps) {
  const Surface one = bumpy(14, 30), other = bumpy(12, 25);
  const CollisionTree a(one), b(other);
  Random random(21);
  int contacts = 0;
  for (int i = 0; i < 25; ++i) {
    const Vec3 place = 75 * random.direction(),
               axis = (random.direction() - 0.04 * place).normalized(),
               center = place + 20 * random.direction();
    const double angle = random.uniform(0, 1.5), tolerance = 0.02;
    const Vec3 slide = random.uniform(20, 70) * axis;
    const Twist twist{angle * axis, slide - (angle * axis).cross(center)};
    const auto pose = [&](double s) {
      const Mat3 turn = Eigen::AngleAxisd(s * angle, axis).toRotationMatrix();
      Mat4 whole = shifted(center + s * slide - turn * center);
      whole.topLeftCorner<3, 3>() = turn;
      return whole;
    };
    Surface placed = other;
    for (Vec3& p : placed.points) p += place;
    const CollisionTree c(placed);
    if (nearest(a, c, Mat4::Identity())->distance < 1) continue;
    Encounter encounter(a, c, {}, twist, 2 * tolerance);
    const double found = first_contact(encounter, pose, 0, tolerance);
    for (int k = 0; k < 400 && k / 400.0 < found; ++k)
      EXPECT_FALSE(touch(a, c, pose(k / 400.0))) << i << " " << k;
    if (found > 1) continue;
    ++contacts;
    EXPECT_LE(nearest(a, c, pose(found))->distance, tolerance);
  }
  EXPECT_GT(contacts, 5);
  EXPECT_LT(contacts, 25);
}

TEST(Collision, refuses_what_is_no_surface) {
  EXPECT_NE(refusal([] {
              CollisionTree tree({"empty", {}, {}});
            }).find("empty: no triangle"),
            std::string::npos);
  EXPECT_NE(refusal([] {
              CollisionTree tree({"bad", {{0, 0, 0}}, {{0, 0, 1}}});
            }).find("bad: "),
            std::string::npos);
}

/// REPOSE_POSES=10000 tries as many poses of the real bones.
TEST(Collision, no_contact_of_real_bones_is_missed) {
  const std::filesystem::path folder = REPOSE_HEAD_DATA;
  if (!std::filesystem::exists(folder))
    GTEST_SKIP() << "the real head is not here (" << folder << "): not tested";
  const Surface skull = load_surface(folder / "skull.ply", Role::bone),
                mandible = load_surface(folder / "mandible.ply", Role::bone);
  const char* requested = std::getenv("REPOSE_POSES");
  const int poses = requested ? std::atoi(requested) : 200;
  const int touching = agree(skull, mandible, poses, 0.05);
  EXPECT_GT(touching, poses / 5);
  EXPECT_LT(touching, 4 * poses / 5);
}

}  // namespace collision_test
}  // namespace repose::surface
