#include "model/columns.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "model/directions.h"
#include "model/fold.h"
#include "model/smoothing.h"
#include "patches.h"
#include "repose/base/error.h"
#include "repose/model/skin_mesh.h"

namespace repose::model {
namespace columns_test {

Columns lay(const SkinMesh& mesh, const std::vector<surface::Surface>& bones,
            const scene::Tissue& tissue = {}) {
  const BoneField field(bones);
  std::vector<BoneField::Nearest> nearest;
  for (const Vec3& x : mesh.points) nearest.push_back(field.nearest(x));
  return compute_columns(mesh, field, nearest, tissue, "skin.ply");
}

void expect_unfolded(const SkinMesh& mesh, const Columns& columns) {
  for (const Triangle& t : mesh.triangles) {
    std::array<Vec3, 3> x, w;
    for (int i = 0; i < 3; ++i) {
      x[i] = mesh.points[t[i]];
      w[i] = columns.deep[t[i]] - x[i];
    }
    EXPECT_GE(fold_margin(x, w), 0.0499);
  }
}

TEST(Columns, over_a_flat_bone_are_straight_down) {
  const SkinMesh mesh = make_skin_mesh(patches::square(8, 40));
  const Columns columns = lay(mesh, {patches::box({-30, -30, -25}, {70, 70, -10})});
  for (size_t v = 0; v < mesh.points.size(); ++v) {
    EXPECT_TRUE(columns.holds[v]);
    EXPECT_NEAR(columns.thickness[v], 10, 1e-9);
    EXPECT_LT((columns.deep[v] - mesh.points[v] + Vec3(0, 0, 10)).norm(), 1e-6);
  }
  EXPECT_EQ(columns.shortened, 0);
}

TEST(Columns, over_a_ball_run_to_its_middle) {
  const SkinMesh mesh = make_skin_mesh(patches::sphere(60, 3));
  const Columns columns = lay(mesh, {patches::sphere(45, 4)});
  for (size_t v = 0; v < mesh.points.size(); ++v) {
    EXPECT_TRUE(columns.holds[v]);
    const double cosine =
        -(columns.deep[v] - mesh.points[v]).normalized().dot(mesh.points[v].normalized());
    EXPECT_GT(cosine, 0.995);
    EXPECT_NEAR(columns.deep[v].norm(), 45, 0.6);
  }
  expect_unfolded(mesh, columns);
}

TEST(Columns, beside_a_bone_end_free_and_the_depth_is_continuous) {
  const SkinMesh mesh = make_skin_mesh(patches::square(20, 100));
  const Columns columns = lay(mesh, {patches::box({-50, -50, -30}, {40, 150, -20})});
  int64_t held = 0;
  for (size_t v = 0; v < mesh.points.size(); ++v) {
    held += columns.holds[v];
    const double x = mesh.points[v].x();
    if (x < 30) {
      EXPECT_NEAR(columns.thickness[v], 20, 0.5);
    }
    if (x > 45) {
      EXPECT_FALSE(columns.holds[v]);
    }
    if (x > 95) {
      EXPECT_NEAR(columns.thickness[v], 12, 0.5);
    }
  }
  EXPECT_GT(held, 0);
  for (size_t e = 0; e < mesh.edges.size(); ++e) {
    const auto [p, q] = mesh.edges[e];
    EXPECT_LE(std::abs(columns.thickness[p] - columns.thickness[q]),
              mesh.edge_length(static_cast<int64_t>(e)) * (1 + 1e-12));
  }
}

TEST(Columns, deeper_bone_does_not_hold) {
  const SkinMesh mesh = make_skin_mesh(patches::square(8, 40));
  scene::Tissue tissue;
  tissue.attach_within = 9.9;
  const Columns columns = lay(mesh, {patches::box({-30, -30, -25}, {70, 70, -10})}, tissue);
  for (size_t v = 0; v < mesh.points.size(); ++v) {
    EXPECT_FALSE(columns.holds[v]);
    EXPECT_LE(columns.thickness[v], 9.5 + 1e-9);  // it stays out of the bone
  }
}

TEST(Columns, a_thin_sheet_of_skin_is_not_pierced) {
  surface::Surface lens = patches::sphere(60, 4);
  for (Vec3& x : lens.points) x.z() *= 0.1;  // 12 mm thick in the middle
  const SkinMesh mesh = make_skin_mesh(lens);
  const Columns columns = lay(mesh, {});
  for (size_t v = 0; v < mesh.points.size(); ++v) {
    EXPECT_GT(columns.thickness[v], 0.05);
    if (mesh.points[v].head<2>().norm() < 40) {  // the two sides do not meet
      EXPECT_GE(columns.deep[v].z() * mesh.points[v].z(), 0);
    }
  }
  expect_unfolded(mesh, columns);
}

TEST(Columns, a_sharp_ridge_is_shortened_until_nothing_is_folded) {
  surface::Surface skin = patches::square(40, 80);
  for (Vec3& x : skin.points) x.z() = -1.7 * std::abs(x.x() - 40);
  const SkinMesh mesh = make_skin_mesh(skin);
  scene::Tissue tissue;
  tissue.free_thickness = 25;
  const Columns columns = lay(mesh, {}, tissue);
  EXPECT_GT(columns.shortened, 0);
  expect_unfolded(mesh, columns);
}

TEST(Columns, where_columns_cross_they_are_shortened) {
  const SkinMesh mesh = make_skin_mesh(patches::square(10, 40));
  std::vector<Vec3> directions;
  for (const Vec3& x : mesh.points) directions.push_back((Vec3(20, 20, -6) - x).normalized());
  std::vector<double> thickness(mesh.points.size(), 20);
  EXPECT_FALSE(folded_triangles(mesh, directions, thickness).empty());
  shorten_folded(mesh, directions, "skin.ply", thickness);
  EXPECT_TRUE(folded_triangles(mesh, directions, thickness).empty());
}

TEST(Columns, where_no_length_is_short_enough_the_place_is_named) {
  const SkinMesh mesh = make_skin_mesh(patches::square(4, 40));
  std::vector<Vec3> directions(mesh.points.size(), Vec3(0, 0, -1));
  directions[12] = Vec3(0, 0, 1);  // the vertex in the middle
  std::vector<double> thickness(mesh.points.size(), 20);
  try {
    shorten_folded(mesh, directions, "skin.ply", thickness);
    FAIL() << "accepted a column that leaves the body";
  } catch (const base::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("skin.ply"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("skin vertex"), std::string::npos);
  }
}

TEST(Columns, every_place_is_named_once_and_its_triangles_are_kept) {
  const SkinMesh mesh = make_skin_mesh(patches::square(10, 100));
  try {
    refuse_places("skin.ply", mesh, {12, 13, 24, 97}, "it does not fit", "mend it");
    FAIL() << "accepted";
  } catch (const RefusedPlaces& error) {
    const std::string text = error.what();
    EXPECT_EQ(text.find("skin.ply: it does not fit in 2 places, skin vertex 12 (10.00, 10.00, "),
              0u)
        << text;
    EXPECT_NE(text.find("and 2 more around it, vertex 97 ("), std::string::npos) << text;
    EXPECT_NE(text.find("; mend it"), std::string::npos);
    const surface::Surface& places = error.places();
    EXPECT_EQ(places.triangles.size(), 13u + 6u);
    EXPECT_EQ(places.points.size(), 12u + 7u);
    for (const Triangle& t : places.triangles)
      EXPECT_LT((places.points[t[0]] - places.points[t[1]]).norm(), 15);
  }
}

TEST(Columns, with_an_edge_they_are_bent_before_they_are_shortened) {
  surface::Surface skin = patches::square(40, 80);
  for (Vec3& x : skin.points) x.z() = -1.7 * std::abs(x.x() - 40);
  const SkinMesh mesh = make_skin_mesh(skin);
  scene::Tissue tissue;
  tissue.free_thickness = 25;
  const Columns straight = lay(mesh, {}, tissue);
  EXPECT_EQ(straight.bent, 0);
  tissue.edge = 2;
  const Columns bent = lay(mesh, {}, tissue);
  EXPECT_GT(bent.bent, 0);
  EXPECT_LT(bent.shortened, straight.shortened);
  expect_unfolded(mesh, bent);
}

TEST(Columns, a_fold_of_the_skin_is_named) {
  surface::Surface skin = patches::square(2, 20);
  skin.points[4] = Vec3(25, 30, 0);  // the middle vertex pulled out over the corner
  EXPECT_THROW(inward_cones(make_skin_mesh(skin), "skin.ply"), base::InputError);
}

TEST(FoldMargin, is_the_least_relative_jacobian) {
  const std::array<Vec3, 3> x = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)};
  const Vec3 down(0, 0, -5);
  EXPECT_NEAR(fold_margin(x, {down, down, down}), 1, 1e-15);
  EXPECT_NEAR(fold_margin(x, {-down, -down, -down}), -1, 1e-15);
  // The deep triangle half the size about the first corner: an area ratio of ¼ at s = 1.
  const std::array<Vec3, 3> narrowing = {down, down - Vec3(0.5, 0, 0), down - Vec3(0, 0.5, 0)};
  EXPECT_NEAR(fold_margin(x, narrowing), 0.25 * 5 / std::hypot(5, 0.5), 1e-12);
  // Turned over about the first corner (both sides reversed): the area is zero half-way, and
  // positive again at the deep end.
  const std::array<Vec3, 3> reversing = {down, down - Vec3(2, 0, 0), down - Vec3(0, 2, 0)};
  EXPECT_NEAR(fold_margin(x, reversing), 0, 1e-12);
}

TEST(Smoothing, keeps_a_constant_and_never_leaves_the_range) {
  const SkinMesh mesh = make_skin_mesh(patches::paper_sized_annulus());
  const auto V = static_cast<int64_t>(mesh.points.size());
  const std::vector<double> weight(V, 1), length(V, 7);
  Eigen::MatrixXd field = Eigen::MatrixXd::Constant(V, 1, 3.5);
  EXPECT_LT((smooth_field(mesh, field, weight, length) - field).cwiseAbs().maxCoeff(), 1e-7);
  field(V / 2, 0) = 13.5;
  const Eigen::MatrixXd smoothed = smooth_field(mesh, field, weight, length);
  EXPECT_GT(smoothed.minCoeff(), 3.5 - 1e-4);
  EXPECT_LT(smoothed.maxCoeff(), 7);
  EXPECT_GT(smoothed(V / 2, 0), 3.51);
}

TEST(Smoothing, decays_over_the_length_given_on_any_mesh) {
  for (const int cells : {40, 80}) {
    const SkinMesh mesh = make_skin_mesh(patches::square(cells, 80));
    const auto V = static_cast<int64_t>(mesh.points.size());
    Eigen::MatrixXd step(V, 1);
    for (int64_t v = 0; v < V; ++v) step(v, 0) = mesh.points[v].x() < 40 ? -1 : 1;
    const Eigen::MatrixXd f =
        smooth_field(mesh, step, std::vector<double>(V, 1), std::vector<double>(V, 8));
    for (int64_t v = 0; v < V; ++v)
      if (std::abs(mesh.points[v].x() - 56) < 1e-9 &&
          std::abs(mesh.points[v].y() - 40) < 12) {  // two lengths from the step
        EXPECT_NEAR(f(v, 0), 1 - std::exp(-2.0), 0.02);
      }
  }
}

TEST(Smoothing, a_slope_limit_lowers_as_little_as_it_can) {
  const SkinMesh mesh = make_skin_mesh(patches::square(10, 50));
  std::vector<double> values(mesh.points.size(), 40);
  values[60] = 3;
  std::vector<int64_t> all(values.size());
  for (size_t v = 0; v < all.size(); ++v) all[v] = static_cast<int64_t>(v);
  limit_slope(mesh, 0.5, all, values);
  EXPECT_DOUBLE_EQ(values[60], 3);
  EXPECT_DOUBLE_EQ(values[61], 3 + 0.5 * 5);
  EXPECT_DOUBLE_EQ(values[72], 3 + 0.5 * 5 * std::sqrt(2));  // along a diagonal edge
  EXPECT_DOUBLE_EQ(values[50], 3 + 0.5 * 10);                // against the diagonals: two edges
}

}  // namespace columns_test
}  // namespace repose::model
