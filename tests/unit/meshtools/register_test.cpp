#include "repose/tools/registration/register.h"

#include <Eigen/LU>
#include <cmath>
#include <random>

#include "../surface/shapes.h"

namespace repose::tools::registration {
using namespace surface;
namespace register_test {

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  Vec3 normal(double scale) {
    return {scale * normal_(engine_), scale * normal_(engine_), scale * normal_(engine_)};
  }
  Similarity transform(bool with_scale) {
    const Vec3 axis = normal(1).normalized();
    return {with_scale ? 1 + 0.2 * normal_(engine_) : 1,
            Eigen::AngleAxisd(3 * normal_(engine_), axis).toRotationMatrix(), normal(100)};
  }

 private:
  std::mt19937 engine_;
  std::normal_distribution<double> normal_;
};

std::vector<Vec3> cloud(Random& random, int n) {
  std::vector<Vec3> points;
  for (int i = 0; i < n; ++i) points.push_back(random.normal(50));
  return points;
}

std::vector<Vec3> mapped(const Similarity& transform, const std::vector<Vec3>& points) {
  std::vector<Vec3> result;
  for (const Vec3& p : points) result.push_back(transform.apply(p));
  return result;
}

double difference(const Similarity& a, const Similarity& b) {
  return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff();
}

TEST(Register, recovers_any_transform_from_three_points_on) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    Random random(seed);
    const bool with_scale = seed % 2 == 1;
    const auto points = cloud(random, 3 + seed % 5);
    const Similarity truth = random.transform(with_scale);
    const Similarity fit = base::fit_similarity(points, mapped(truth, points), with_scale);
    EXPECT_LT(difference(fit, truth), 1e-9);
    EXPECT_NEAR(fit.rotation.determinant(), 1, 1e-12);
  }
}

// No small turn, shift or scaling about the fit lowers the sum of squares.
TEST(Register, the_fit_is_a_minimum) {
  Random random(5);
  const auto moving = cloud(random, 8);
  auto fixed = mapped(random.transform(false), moving);
  for (Vec3& p : fixed) p += random.normal(2);
  const auto sum = [&](const Similarity& t) {
    double s = 0;
    for (size_t i = 0; i < moving.size(); ++i) s += (t.apply(moving[i]) - fixed[i]).squaredNorm();
    return s;
  };
  for (const bool with_scale : {false, true}) {
    const Similarity fit = base::fit_similarity(moving, fixed, with_scale);
    for (int k = 0; k < 50; ++k) {
      Similarity other = fit;
      const Vec3 turn = random.normal(1e-3);
      other.rotation = Eigen::AngleAxisd(turn.norm(), turn.normalized()) * fit.rotation;
      other.translation += random.normal(1e-2);
      if (with_scale) other.scale *= 1 + random.normal(1e-4).x();
      EXPECT_GT(sum(other), sum(fit));
    }
  }
}

TEST(Register, never_a_reflection_but_its_error_is_known) {
  Random random(6);
  const auto moving = cloud(random, 6);
  auto fixed = moving;
  for (Vec3& p : fixed) p.x() = -p.x();
  const LandmarkFit fit = fit_landmarks(moving, fixed, false);
  EXPECT_NEAR(fit.transform.rotation.determinant(), 1, 1e-12);
  EXPECT_LT(fit.rms_mirrored, 1e-9);
  EXPECT_GT(fit.rms_all, 10);
}

TEST(Register, a_bad_landmark_is_left_out_and_a_noisy_set_is_not_thinned) {
  int false_alarms = 0;
  for (unsigned seed = 0; seed < 300; ++seed) {
    Random random(seed);
    const int n = 5 + seed % 6;
    const auto moving = cloud(random, n);
    const Similarity truth = random.transform(false);
    auto fixed = mapped(truth, moving);
    for (Vec3& p : fixed) p += random.normal(0.5);
    const LandmarkFit good = fit_landmarks(moving, fixed, false);
    for (const bool out : good.left_out) false_alarms += out;
    if (n < 6) continue;
    const size_t bad = seed % n;
    fixed[bad] += 60 * random.normal(1).normalized();
    const LandmarkFit fit = fit_landmarks(moving, fixed, false);
    EXPECT_TRUE(fit.left_out[bad]) << seed;
    EXPECT_GT(fit.residual[bad], 40);
    EXPECT_LT(fit.rms, 1.5);
    EXPECT_GT(fit.rms_all, 5);
  }
  EXPECT_LE(false_alarms, 4);  // 0.1 % of 300 sets expected
}

TEST(Register, leave_one_out_is_the_error_of_the_fit_of_the_others) {
  Random random(9);
  const auto moving = cloud(random, 5);
  auto fixed = moving;
  for (Vec3& p : fixed) p += random.normal(1);
  const LandmarkFit fit = fit_landmarks(moving, fixed, false);
  for (size_t i = 0; i < 5; ++i) {
    auto x = moving, y = fixed;
    x.erase(x.begin() + static_cast<std::ptrdiff_t>(i));
    y.erase(y.begin() + static_cast<std::ptrdiff_t>(i));
    const Similarity others = base::fit_similarity(x, y, false);
    EXPECT_NEAR(fit.predicted[i], (others.apply(moving[i]) - fixed[i]).norm(), 1e-9);
    EXPECT_GT(fit.predicted[i], fit.residual[i]);
  }
}

TEST(Register, too_few_or_collinear_landmarks_are_refused) {
  const std::vector<Vec3> two = {{0, 0, 0}, {10, 0, 0}};
  EXPECT_NE(refusal([&] { fit_landmarks(two, two, false); }).find("2 landmark(s)"),
            std::string::npos);
  std::vector<Vec3> line;
  for (int i = 0; i < 5; ++i) line.emplace_back(i, 2 * i, 0.001 * (i % 2));
  const auto message = refusal([&] { fit_landmarks(line, line, false); });
  EXPECT_NE(message.find("on a line"), std::string::npos);
  EXPECT_NE(message.find("moving"), std::string::npos);
  auto bent = line;
  bent[2].y() += 3;
  EXPECT_NE(refusal([&] { fit_landmarks(bent, line, false); }).find("fixed"), std::string::npos);
  EXPECT_EQ(refusal([&] { fit_landmarks(bent, bent, false); }), "");
}

TEST(Register, landmarks_in_another_unit_are_refused_but_by_a_fit_of_the_scale) {
  Random random(7);
  const auto fixed = cloud(random, 6);
  for (const double factor : {0.001, 0.1, 1 / 25.4, 10.0, 1000.0}) {
    const auto moving = mapped({factor, Mat3::Identity(), Vec3::Zero()}, fixed);
    const std::string message = refusal([&] { fit_landmarks(moving, fixed, false); });
    EXPECT_NE(message.find("not in mm"), std::string::npos) << factor;
    EXPECT_NEAR(fit_landmarks(moving, fixed, true).transform.scale * factor, 1, 1e-9);
  }
  auto strayed = fixed;
  strayed[2] += Vec3(5000, 0, 0);
  for (const double factor : {0.5, 2.0})
    EXPECT_EQ(
        refusal([&] {
          fit_landmarks(mapped({factor, Mat3::Identity(), Vec3::Zero()}, strayed), fixed, false);
        }),
        "");
}

/// A waved sheet of n × n squares of 4 mm that has no symmetry.
Surface sheet(int n) {
  Surface s = patch(n);
  for (Vec3& p : s.points) {
    p *= 0.4;
    p.z() = 9 * std::sin(0.13 * p.x()) + 6 * std::cos(0.17 * p.y() + 0.02 * p.x());
  }
  return s;
}

TEST(Register, landmarks_off_their_mesh_get_a_remark) {
  const Surface mesh = sheet(40);
  const std::vector<std::string> names = {"a", "b", "c", "d"};
  const auto& p = mesh.points;
  const std::vector<Vec3> on = {p[20], p[700], p[1000], p[1500]};
  const auto remark = [&](const std::vector<Vec3>& moving, const std::vector<Vec3>& fixed,
                          double scale = 1) {
    return remark_on_distance(names, moving, mesh, fixed, mesh, scale);
  };
  auto deep = on, off = on, far = on;
  deep[1].z() -= 40;  // a landmark of bone
  off[2].z() += 30;
  for (Vec3& point : far) point.z() += 100;
  EXPECT_EQ(remark(on, on), "");
  EXPECT_EQ(remark(deep, deep), "");
  EXPECT_NE(remark(off, on).find("landmark c lies 2"), std::string::npos) << remark(off, on);
  EXPECT_EQ(remark(off, on, 0.1), "");
  EXPECT_NE(remark(on, far).find("landmark"), std::string::npos);
  EXPECT_NE(remark(far, far), "");
}

TEST(Register, icp_finds_the_place_of_a_part) {
  const Surface fixed = sheet(40);
  Surface part = sheet(40);
  std::erase_if(part.triangles, [&](const Triangle& t) { return part.points[t[0]].x() < 60; });
  const Similarity away{
      1, Eigen::AngleAxisd(0.06, Vec3(1, 2, 3).normalized()).toRotationMatrix(), {1, -2, 1.5}};
  const Surface moving = moved(part, away);
  const IcpResult icp = refine_by_icp(moving, fixed, {}, {});
  EXPECT_TRUE(icp.converged);
  EXPECT_LT(icp.rms, 1e-3);
  const Similarity whole = icp.transform.after(away);
  EXPECT_LT(difference(whole, {}), 5e-3);
}

// Half of the moving part lies beyond the fixed one's border, to which all of it would be pulled.
TEST(Register, icp_leaves_out_what_lies_beyond_a_border) {
  Surface fixed = sheet(40), part = sheet(40);
  const auto side = [](Surface& s, double low, double high) {
    std::erase_if(s.triangles, [&](const Triangle& t) {
      return s.points[t[0]].x() < low || s.points[t[0]].x() > high;
    });
  };
  side(fixed, 0, 110);
  side(part, 50, 160);
  const Similarity away{1, Mat3::Identity(), {1, 1, 1}};
  const IcpResult icp = refine_by_icp(moved(part, away), fixed, {}, {.trim = 1});
  EXPECT_LT(difference(icp.transform.after(away), {}), 0.05);
}

TEST(Register, icp_ignores_a_bump_that_the_other_lacks) {
  const Surface fixed = sheet(40);
  Surface moving = sheet(40);
  for (Vec3& p : moving.points)
    if ((p - Vec3(80, 80, 0)).head<2>().norm() < 25) p.z() += 8;
  const Similarity away{1, Mat3::Identity(), {0.5, 0.5, 1}};
  const Surface start = moved(moving, away);
  const auto error = [&](double trim) {
    return difference(refine_by_icp(start, fixed, {}, {.trim = trim}).transform.after(away), {});
  };
  EXPECT_LT(error(0.7), 0.02);
  EXPECT_GT(error(1.0), 0.1);
}

TEST(Register, icp_without_partners_is_refused) {
  const Mat3 upright = Eigen::AngleAxisd(1.5, Vec3::UnitY()).toRotationMatrix();
  const Surface far = moved(sheet(5), {1, upright, {0, 0, 5000}});
  EXPECT_NE(refusal([&] { refine_by_icp(far, sheet(5), {}, {}); }).find("give landmarks"),
            std::string::npos);
}

TEST(Register, icp_of_a_mesh_that_faces_the_other_way_is_refused) {
  Surface turned = sheet(20);
  for (auto& t : turned.triangles) turn(t);
  turned.name = "turned.ply";
  EXPECT_NE(refusal([&] {
              refine_by_icp(turned, sheet(20), {}, {});
            }).find("triangles of turned.ply face the other way"),
            std::string::npos);
}

TEST(Register, transforms_compose_as_matrices) {
  Random random(3);
  const Similarity a = random.transform(true), b = random.transform(true);
  EXPECT_LT((a.after(b).matrix() - a.matrix() * b.matrix()).cwiseAbs().maxCoeff(), 1e-11);
}

}  // namespace register_test
}  // namespace repose::tools::registration
