#include "repose/model/stiffness.h"

#include <gtest/gtest.h>

#include "model/layers.h"
#include "patches.h"
#include "repose/base/error.h"
#include "repose/model/build.h"

namespace repose::model {
namespace stiffness_test {

struct Built {
  SkinMesh mesh;
  Model model;
};

Built flat(int cells, int layers, const scene::Tissue& rules) {
  Built built{make_skin_mesh(patches::square(cells, 40)), {}};
  std::vector<Vec3> deep = built.mesh.points;
  for (Vec3& x : deep) x.z() -= 10;
  scene::Tissue tissue = rules;
  tissue.layers = layers;
  built.model = make_layers(built.mesh, deep, layer_depths(tissue));
  set_stiffness(tissue, built.mesh, layer_slope(built.mesh, deep, tissue), built.model);
  return built;
}

/// Σ ½ k0 (u·ε u r_0)²: what the linear springs store under a small uniform strain ε.
double strain_energy(const Model& model, const Mat3& strain) {
  double energy = 0;
  for (size_t j = 0; j < model.springs.points.size(); ++j) {
    const auto [p, q] = model.springs.points[j];
    const Vec3 d = model.points.position[q] - model.points.position[p];
    const double s = d.dot(strain * d) / d.norm();
    energy += 0.5 * model.springs.stiffness[j] * s * s;
  }
  return energy;
}

TEST(Stiffness, a_modulus_is_the_same_tissue_on_any_mesh) {
  scene::Tissue tissue;
  tissue.springs["default"].modulus = 0.03;
  const Model coarse = flat(4, 3, tissue).model, fine = flat(8, 5, tissue).model,
              finest = flat(16, 9, tissue).model;
  Mat3 strain;
  strain << 0.1, 0.02, -0.03, 0.02, -0.04, 0.05, -0.03, 0.05, 0.07;
  for (const Mat3& e : {strain, Mat3(Vec3(0, 0, 0.1).asDiagonal()), Mat3(Mat3::Identity())}) {
    const double energy = strain_energy(coarse, e);
    EXPECT_GT(energy, 0);
    EXPECT_NEAR(strain_energy(fine, e), energy, 1e-12 * energy);
    EXPECT_NEAR(strain_energy(finest, e), energy, 1e-12 * energy);
  }
}

TEST(Stiffness, a_constant_is_not) {
  scene::Tissue tissue;
  tissue.springs["default"].stiffness = 1;
  const double coarse = strain_energy(flat(4, 3, tissue).model, Mat3::Identity());
  EXPECT_GT(strain_energy(flat(8, 5, tissue).model, Mat3::Identity()), 1.5 * coarse);
}

TEST(Stiffness, the_effective_modulus_of_one_modulus_is_it) {
  scene::Tissue tissue;
  tissue.springs["default"].modulus = 0.017;
  EXPECT_NEAR(effective_modulus(flat(5, 4, tissue).model), 0.017, 1e-15);
}

TEST(Stiffness, the_most_specific_rule_that_says_something_counts) {
  scene::Tissue tissue;
  tissue.springs["default"] = {
      .stiffness = 3.0, .modulus = {}, .law = scene::Law::linear, .reference = 2.0};
  tissue.springs["layer"].law = scene::Law::quadratic;
  tissue.springs["layer 1"] = {.stiffness = {}, .modulus = 0.5, .law = {}, .reference = 0.0};
  tissue.springs["diagonal 0"].stiffness = 7.0;
  const Built built = flat(3, 3, tissue);
  const std::vector<double> volumes = spring_volumes(built.mesh, built.model.prisms.rest_volume);
  const Springs& springs = built.model.springs;
  for (size_t j = 0; j < springs.points.size(); ++j) {
    const std::string& set = built.model.spring_sets[springs.set[j]];
    const double r0 = springs.rest_length[j];
    const bool layer_1 = set == "layer 1";
    const double k0 = layer_1 ? 0.5 * volumes[j] / (r0 * r0) : set == "diagonal 0" ? 7.0 : 3.0;
    EXPECT_DOUBLE_EQ(springs.stiffness[j], k0) << set;
    EXPECT_DOUBLE_EQ(springs.reference[j], layer_1 ? r0 : 2.0) << set;
    EXPECT_EQ(springs.exponent[j], set.starts_with("layer") ? 1 : 0) << set;
  }
}

TEST(Stiffness, without_rules_it_is_the_papers_quartic_law) {
  const Springs springs = flat(2, 2, {}).model.springs;
  for (size_t j = 0; j < springs.points.size(); ++j) {
    EXPECT_EQ(springs.stiffness[j], 1);
    EXPECT_EQ(springs.exponent[j], 2);
    EXPECT_EQ(springs.reference[j], 1);
  }
}

TEST(Stiffness, a_rule_for_a_set_that_is_not_there_is_refused) {
  for (const char* name : {"layer 3", "connecting 2", "layers", "layer 0 0", ""}) {
    scene::Tissue tissue;
    tissue.springs[name].stiffness = 2;
    EXPECT_THROW(flat(2, 3, tissue), base::InputError) << name;
  }
}

TEST(Stiffness, that_of_contact_follows_the_width_of_columns_where_they_are_slim) {
  const double modulus = 0.02, thickness = 10;
  const auto of_width = [&](double width) {
    ColumnSums column;
    column.thickness = thickness;
    column.volume = width * width * thickness;
    column.stiffness = modulus * column.volume;
    return contact_stiffness(scene::Scene{}, std::vector<ColumnSums>(5, column));
  };
  EXPECT_DOUBLE_EQ(of_width(4), 25 * modulus / thickness);
  EXPECT_DOUBLE_EQ(of_width(0.5), 7 * modulus / 0.5);
}

TEST(Stiffness, a_stiff_implant_does_not_decide_on_that_of_contact) {
  ColumnSums column;
  column.thickness = 10, column.volume = 160, column.stiffness = 0.02 * column.volume;
  std::vector<ColumnSums> columns(100, column);
  for (size_t i = 0; i < 5; ++i) columns[i].stiffness *= 1e5;
  EXPECT_DOUBLE_EQ(contact_stiffness(scene::Scene{}, columns), 3 * 25 * 0.02 / 10);
}

TEST(Stiffness, that_of_contact_is_by_columns_that_elements_begin_in) {
  ColumnSums column, empty;
  column.thickness = empty.thickness = 10;
  column.volume = 160, column.stiffness = 0.02 * column.volume;
  std::vector<ColumnSums> columns(5, column);
  columns.resize(12, empty);
  EXPECT_GE(contact_stiffness(scene::Scene{}, columns), 25 * 0.02 / 10);
}

}  // namespace stiffness_test
}  // namespace repose::model
