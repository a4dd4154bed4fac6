#include <gtest/gtest.h>

#include "repose/model/material.h"
#include "rest.h"
#include "solid_block.h"

/// Derivatives by the motion of a piece and by stiffnesses, against differences of rest positions.
namespace repose {
namespace {

using model::PointSet;

constexpr int columns = 9, rows = 6, layers = 4;
const Vec3 centroid(0, 12, -5);  // mm, of the piece

/// A solid whose depth is held and one end of which a piece of bone carries.
model::Model carried(const scene::Placement& placement, double uneven = 0.3) {
  model::Model m = testing::solid_block(columns, rows, layers, 0.45, uneven, [](int i, int, int a) {
    return i == 0 ? PointSet::bone : a == layers - 1 ? PointSet::boundary : PointSet::soft_tissue;
  });
  const scene::RigidMotion motion = scene::motion_of(placement, centroid);
  m.bones = {"piece"};
  m.bone_surfaces.resize(1);
  m.bone_transform = {motion.matrix()};
  for (size_t i = 0; i < m.points.position.size(); ++i) {
    if (m.points.set[i] != PointSet::bone) continue;
    m.points.bone[i] = 0;
    m.points.target[i] = motion.apply(m.points.position[i]);
  }
  return m;
}

std::vector<Vec3> rest_at(const scene::Placement& placement) {
  return testing::find_rest(carried(placement), testing::settings(1e-8)).rows.position;
}

TEST(RestDerivatives, AreTheDifferencesOfRestPositions) {
  constexpr double step = 1e-3;  // mm, degrees
  const scene::Placement at{{0.5, -1, 0.3}, {4, -2, 6}};
  solve::Settings settings = testing::settings(1e-8);
  settings.derivatives.pieces = {{0, centroid, at}};
  const testing::Rest rest = testing::find_rest(carried(at), settings);
  std::vector<model::PointField> fields;
  for (const model::PointField& field : rest.rows.point_fields)
    if (field.name.starts_with("tangent_0_")) fields.push_back(field);
  ASSERT_EQ(fields.size(), 6);
  EXPECT_EQ(fields[0].name, "tangent_0_tx");
  EXPECT_EQ(fields[5].name, "tangent_0_rz");
  for (int c = 0; c < 6; ++c) {
    scene::Placement before = at, after = at;
    (c < 3 ? before.translation : before.rotation)[c % 3] -= step;
    (c < 3 ? after.translation : after.rotation)[c % 3] += step;
    const std::vector<Vec3> from = rest_at(before), to = rest_at(after);
    double error = 0, largest = 0;
    for (size_t i = 0; i < from.size(); ++i) {
      const Vec3 difference = (to[i] - from[i]) / (2 * step);
      const Vec3 tangent = Vec3::Map(&fields[c].values[3 * i]);
      largest = std::max(largest, difference.norm());
      error = std::max(error, (tangent - difference).norm());
    }
    EXPECT_GT(largest, c < 3 ? 0.9 : 0.05);
    EXPECT_LT(error, 1e-3 * largest) << fields[c].name;
  }
}

TEST(RestDerivatives, EndWhereTheyAreAbandoned) {
  const scene::Placement at{{0.5, -1, 0.3}, {4, -2, 6}};
  int questions = 0;  // whether to end, from the last iteration of the search on
  solve::Settings settings = testing::settings(1e-8);
  settings.derivatives.pieces = {{0, centroid, at}};
  settings.on_iterate = [&](double, const solve::StateSnapshot&) { questions = 0; };
  const auto expect_tangents = [&](int expected, int answered_by_yes) {
    settings.abandoned = [&] { return ++questions == answered_by_yes; };
    const testing::Rest rest = testing::find_rest(carried(at), settings);
    EXPECT_TRUE(rest.summary.path.complete());
    EXPECT_EQ(rest.summary.abandoned, expected < 6);
    EXPECT_EQ(std::ranges::count_if(rest.rows.point_fields,
                                    [](const model::PointField& field) {
                                      return field.name.starts_with("tangent_");
                                    }),
              expected);
  };
  expect_tangents(2, 4);  // the first question is the iteration's
  expect_tangents(5, 7);
  expect_tangents(6, 8);  // there is nothing left to end
}

/// `carried` with a plate of the piece that presses on the upper face.
model::Model pressed(const scene::Placement& placement) {
  model::Model m = carried(placement, 0);
  surface::Surface& plate = m.bone_surfaces[0];
  for (int k = 0; k < 8; ++k)
    plate.points.emplace_back(k & 1 ? 32 : 8, k & 2 ? 21 : 3, k & 4 ? 10.5 : 0.5);
  plate.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                     {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  m.contact.bodies = {{.name = "piece", .bone = 0}};
  m.contact.stiffness = 0.005;
  testing::add_touching_points(m, 20);
  return m;
}

TEST(RestDerivatives, OfWhatSlidesAlongABodyAreDifferencesAndTheAdjointIsTheirTranspose) {
  constexpr double step = 1e-4;  // mm, degrees
  const scene::Placement at{{0.3, -0.2, -1.8}, {0.5, -1, 0.4}};
  solve::Settings settings = testing::settings(1e-9);
  settings.derivatives.pieces = {{0, centroid, at}};
  std::vector<Vec3> weight(carried(at).points.position.size(), Vec3::Zero());
  weight[(2 * columns + 4) * layers] = {1, 0.5, -0.7};  // below the plate
  settings.derivatives.functional = base::scatter(MPI_COMM_WORLD, weight);
  const testing::Rest rest = testing::find_rest(pressed(at), settings);
  ASSERT_TRUE(rest.summary.path.complete()) << rest.summary.last.reason;
  EXPECT_GE(rest.summary.contacts[0].points, 4);
  ASSERT_TRUE(rest.summary.gradient && rest.summary.gradient->finished);
  for (int c = 0; c < 6; ++c) {
    scene::Placement before = at, after = at;
    (c < 3 ? before.translation : before.rotation)[c % 3] -= step;
    (c < 3 ? after.translation : after.rotation)[c % 3] += step;
    const testing::Rest from = testing::find_rest(pressed(before), testing::settings(1e-9)),
                        to = testing::find_rest(pressed(after), testing::settings(1e-9));
    const auto field = std::ranges::find(
        rest.rows.point_fields, fmt::format("tangent_0_{}{}", c < 3 ? 't' : 'r', "xyz"[c % 3]),
        &model::PointField::name);
    double error = 0, largest = 0, forward = 0;
    for (size_t i = 0; i < weight.size(); ++i) {
      const Vec3 difference = (to.rows.position[i] - from.rows.position[i]) / (2 * step);
      const Vec3 tangent = Vec3::Map(&field->values[3 * i]);
      largest = std::max(largest, difference.norm());
      error = std::max(error, (tangent - difference).norm());
      forward += weight[i].dot(tangent);
    }
    EXPECT_LT(error, 1e-3 * largest) << field->name;
    EXPECT_NEAR(rest.summary.gradient->by_pieces[c], forward, 1e-3 * largest) << field->name;
  }
}

/// `carried` whose prisms of the first layer are `times` as stiff.
model::Model stiffened(const scene::Placement& placement, double times) {
  model::Model m = carried(placement, 0);
  for (size_t k = 0; k < m.prisms.points.size(); ++k) {
    if (m.points.layer[m.prisms.points[k][0]] != 0) continue;
    m.prisms.shear_modulus[k] *= times;
    m.prisms.modulus[k] *= times;
  }
  model::assemble_edges("block", m);
  return m;
}

TEST(RestDerivatives, APrismOfARegionIsNoneOfTheStrataThoughItsModuliAre) {
  const scene::Placement at{{0.5, -1, 0.3}, {4, -2, 6}};
  const model::Model block = carried(at, 0);
  const double shear = block.prisms.shear_modulus[0], bulk = block.prisms.modulus[0];
  solve::Settings settings = testing::settings(1e-8);
  settings.derivatives.strata = {{0, shear, bulk}};
  settings.derivatives.in_region.assign(block.prisms.points.size(), 1);
  const testing::Rest rest = testing::find_rest(block, settings);
  const auto field =
      std::ranges::find(rest.rows.point_fields, "tangent_young_0", &model::PointField::name);
  ASSERT_NE(field, rest.rows.point_fields.end());
  EXPECT_EQ(std::ranges::count(field->values, 0.0), std::ssize(field->values));
}

TEST(RestDerivatives, ByStiffnessesAreDifferencesAndTheAdjointIsTheirTranspose) {
  constexpr double step = 1e-3, depth = 3;  // mm, of a layer
  const scene::Placement at{{0.5, -1, 0.3}, {4, -2, 6}};
  const model::Model block = carried(at, 0);
  const double shear = block.prisms.shear_modulus[0], bulk = block.prisms.modulus[0];
  solve::Settings settings = testing::settings(1e-8);
  settings.derivatives.pieces = {{0, centroid, at}};
  settings.derivatives.strata = {{depth, shear, bulk}, {0, shear, bulk}};
  std::vector<Vec3> weight(block.points.position.size(), Vec3::Zero());
  weight[2] = {0.3, -1, 0.2};           // of bone
  weight[4 * layers] = {1, 0.5, -0.7};  // of soft tissue
  settings.derivatives.functional = base::scatter(MPI_COMM_WORLD, weight);
  const testing::Rest rest = testing::find_rest(block, settings);
  const std::vector<Vec3>
      from = testing::find_rest(stiffened(at, std::exp(-step)), settings).rows.position,
      to = testing::find_rest(stiffened(at, std::exp(step)), settings).rows.position;
  std::vector<const model::PointField*> fields;
  for (const model::PointField& field : rest.rows.point_fields)
    if (field.name.starts_with("tangent_")) fields.push_back(&field);
  ASSERT_EQ(fields.size(), 8);
  EXPECT_EQ(fields[6]->name, "tangent_young_0");
  EXPECT_EQ(fields[7]->name, "tangent_young_1");
  double error = 0, largest = 0, opposite = 0;
  for (size_t i = 0; i < from.size(); ++i) {
    const Vec3 difference = (to[i] - from[i]) / (2 * step);
    const Vec3 first = Vec3::Map(&fields[6]->values[3 * i]),
               second = Vec3::Map(&fields[7]->values[3 * i]);
    largest = std::max(largest, difference.norm());
    error = std::max(error, (first - difference).norm());
    opposite = std::max(opposite, (first + second).norm());
  }
  EXPECT_GT(largest, 0.01);
  EXPECT_LT(error, 2e-3 * largest);
  EXPECT_LT(opposite, 2e-3 * largest) << "all stiffer, nothing changes";
  ASSERT_TRUE(rest.summary.gradient);
  std::vector<double> gradient = rest.summary.gradient->by_pieces;
  const std::vector<double>& by_strata = rest.summary.gradient->by_strata;
  gradient.insert(gradient.end(), by_strata.begin(), by_strata.end());
  ASSERT_EQ(gradient.size(), 8);
  for (size_t c = 0; c < gradient.size(); ++c) {
    double forward = 0;
    for (size_t i = 0; i < weight.size(); ++i)
      forward += weight[i].dot(Vec3::Map(&fields[c]->values[3 * i]));
    EXPECT_NEAR(gradient[c], forward, 1e-3 * std::max(largest, std::abs(forward)))
        << fields[c]->name;
  }
  EXPECT_TRUE(rest.summary.gradient->finished && rest.summary.gradient->convex);
}

}  // namespace
}  // namespace repose
