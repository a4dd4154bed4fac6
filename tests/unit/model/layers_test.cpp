#include "model/layers.h"

#include <gtest/gtest.h>

#include <map>
#include <numeric>
#include <set>

#include "patches.h"
#include "repose/base/error.h"
#include "repose/model/stiffness.h"

namespace repose::model {
namespace layers_test {

Model flat_model(const SkinMesh& mesh, int layers, double thickness) {
  std::vector<Vec3> deep = mesh.points;
  for (Vec3& x : deep) x.z() -= thickness;
  scene::Tissue tissue;
  tissue.layers = layers;
  return make_layers(mesh, deep, layer_depths(tissue));
}

std::map<std::string, int64_t> springs_by_set(const Model& model) {
  std::map<std::string, int64_t> counts;
  for (const int32_t set : model.springs.set) ++counts[model.spring_sets[set]];
  return counts;
}

TEST(Layers, counts_follow_the_formula_for_any_number) {
  const SkinMesh mesh = make_skin_mesh(patches::square(5, 50));
  const auto V = static_cast<int64_t>(mesh.points.size());
  const auto E = static_cast<int64_t>(mesh.edges.size());
  const auto F = static_cast<int64_t>(mesh.triangles.size());
  ASSERT_EQ(V, 36);
  ASSERT_EQ(E, 85);
  ASSERT_EQ(F, 50);
  for (int n = 2; n <= 64; ++n) {
    const Model model = flat_model(mesh, n, 10);
    EXPECT_EQ(std::ssize(model.points.position), n * V) << n;
    EXPECT_EQ(std::ssize(model.springs.points), n * E + (n - 1) * (V + 2 * E)) << n;
    EXPECT_EQ(std::ssize(model.prisms.points), (n - 1) * F) << n;
    EXPECT_EQ(std::ssize(model.spring_sets), 3 * n - 2) << n;
  }
}

TEST(Layers, table_1_of_the_paper) {
  const SkinMesh mesh = make_skin_mesh(patches::paper_sized_annulus());
  ASSERT_EQ(mesh.points.size(), 477u);
  ASSERT_EQ(mesh.edges.size(), 1351u);
  ASSERT_EQ(mesh.triangles.size(), 874u);
  ASSERT_EQ(mesh.border_loops.size(), 2u);
  const int64_t rows[3][4] = {{2, 954, 5881, 874}, {4, 1908, 14941, 2622}, {6, 2862, 24001, 4370}};
  for (const auto& [layers, points, springs, prisms] : rows) {
    const Model model = flat_model(mesh, static_cast<int>(layers), 10);
    EXPECT_EQ(std::ssize(model.points.position), points);
    EXPECT_EQ(std::ssize(model.springs.points), springs);
    EXPECT_EQ(std::ssize(model.prisms.points), prisms);
    const auto sets = springs_by_set(model);
    EXPECT_EQ(sets.at("layer 0"), 1351);
    EXPECT_EQ(sets.at("connecting 0"), 477);
    EXPECT_EQ(sets.at("diagonal 0"), 2 * 1351);
  }
}

TEST(Layers, points_run_down_the_columns) {
  const SkinMesh mesh = make_skin_mesh(patches::square(2, 20));
  const Model model = flat_model(mesh, 5, 8);
  for (int64_t i = 0; i < std::ssize(model.points.position); ++i) {
    EXPECT_EQ(model.points.column[i], i / 5);
    EXPECT_EQ(model.points.layer[i], i % 5);
    const Vec3 expected = mesh.points[i / 5] - Vec3(0, 0, 2.0 * static_cast<double>(i % 5));
    EXPECT_LT((model.points.position[i] - expected).norm(), 1e-14);
  }
}

TEST(Layers, depths_place_the_layers) {
  scene::Tissue tissue;
  tissue.layers = 4;
  tissue.depths = {0, 0.15, 0.5, 1};
  const SkinMesh mesh = make_skin_mesh(patches::square(1, 20));
  std::vector<Vec3> deep = mesh.points;
  for (Vec3& x : deep) x.z() -= 10;
  const Model model = make_layers(mesh, deep, layer_depths(tissue));
  EXPECT_DOUBLE_EQ(model.points.position[1].z(), -1.5);
  EXPECT_DOUBLE_EQ(model.points.position[2].z(), -5);
}

TEST(Layers, bad_depths_are_refused) {
  scene::Tissue tissue;
  for (const int layers : {-1, 0, 1, 65}) {
    tissue.layers = layers;
    EXPECT_THROW(layer_depths(tissue), base::InputError) << layers;
  }
  tissue.layers = 3;
  for (const std::vector<double>& depths : std::vector<std::vector<double>>{
           {0, 1}, {0, 0.5, 0.9}, {0.1, 0.5, 1}, {0, 1, 1}, {0, 0, 1}, {0, NAN, 1}}) {
    tissue.depths = depths;
    EXPECT_THROW(layer_depths(tissue), base::InputError);
  }
}

TEST(Layers, every_spring_joins_points_of_one_prism_and_every_pair_is_a_spring) {
  const SkinMesh mesh = make_skin_mesh(patches::square(3, 30));
  const Model model = flat_model(mesh, 4, 9);
  std::set<std::pair<int64_t, int64_t>> pairs, springs;
  for (const auto& p : model.prisms.points)
    for (int i = 0; i < 6; ++i)
      for (int k = 0; k < 6; ++k)
        if (p[i] < p[k]) pairs.emplace(p[i], p[k]);
  for (const auto& [p, q] : model.springs.points) springs.emplace(std::min(p, q), std::max(p, q));
  EXPECT_EQ(springs.size(), model.springs.points.size());  // none twice
  EXPECT_EQ(pairs, springs);
}

TEST(Layers, prisms_fill_the_tissue_and_are_positive) {
  const SkinMesh mesh = make_skin_mesh(patches::paper_sized_annulus());
  double area = 0;
  for (const Vec3& n : mesh.triangle_normal) area += n.norm();
  const Model model = flat_model(mesh, 6, 12);
  double volume = 0;
  for (const double v : model.prisms.rest_volume) {
    EXPECT_GT(v, 0);
    volume += v;
  }
  EXPECT_NEAR(volume, 12 * area, 1e-9 * volume);
}

TEST(Layers, spring_volumes_are_the_shares_of_the_prisms_around) {
  surface::Surface skin = patches::square(3, 30);
  skin.points[5] += Vec3(1, 2, 1);
  const SkinMesh mesh = make_skin_mesh(skin);
  const Model model = flat_model(mesh, 4, 9);
  std::map<std::pair<int64_t, int64_t>, double> expected;
  for (size_t m = 0; m < model.prisms.points.size(); ++m)
    for (const int64_t p : model.prisms.points[m])
      for (const int64_t q : model.prisms.points[m])
        if (p < q) expected[{p, q}] += model.prisms.rest_volume[m] / 15;
  const std::vector<double> volumes = spring_volumes(mesh, model.prisms.rest_volume);
  ASSERT_EQ(volumes.size(), model.springs.points.size());
  for (size_t j = 0; j < volumes.size(); ++j) {
    const auto [p, q] = model.springs.points[j];
    EXPECT_NEAR(volumes[j], (expected.at({std::min(p, q), std::max(p, q)})), 1e-12);
  }
}

}  // namespace layers_test
}  // namespace repose::model
