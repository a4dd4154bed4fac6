#include "repose/model/cut.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "model/add_contact.h"
#include "patches.h"
#include "repose/base/error.h"
#include "repose/model/build.h"
#include "repose/model/material.h"
#include "repose/model/skin_mesh.h"

namespace repose::model {
namespace cut_test {

const surface::Surface kBone = patches::box({-30, -30, -25}, {130, 130, -10});

scene::Scene cut_scene(int layers, std::vector<scene::Incision> incisions) {
  scene::Scene scene = patches::scene_of(4, {"jaw"});
  scene.tissue.layers = layers;
  scene.tissue.density = 1e-6;
  scene.incisions = std::move(incisions);
  return scene;
}

double area(const surface::Surface& s) {
  double sum = 0;
  for (const auto& [a, b, c] : s.triangles)
    sum += 0.5 * (s.points[b] - s.points[a]).cross(s.points[c] - s.points[a]).norm();
  return sum;
}

std::string refusal(std::vector<scene::Incision> incisions) {
  surface::Surface skin = patches::square(6, 60);
  for (size_t i = 0; i < incisions.size(); ++i) incisions[i].name = fmt::format("incisions[{}]", i);
  try {
    insert_paths(incisions, "scene.yaml", skin);
  } catch (const base::InputError& error) {
    return error.what();
  }
  return "";
}

/// The distance of a point from a segment in the plane.
double off(const Vec3& x, const Vec3& a, const Vec3& b) {
  return ((b - a).normalized().cross(x - a)).norm();
}

TEST(CutPath, runs_straight_between_its_points_on_edges_of_the_skin) {
  surface::Surface skin = patches::square(6, 60);
  const Vec3 a(13.7, 22.3, 0), b(41.9, 35.2, 0);
  const std::vector<Cut> cuts = insert_paths({{{a, b}, 2}}, "scene.yaml", skin);
  const SkinMesh mesh = make_skin_mesh(skin);
  const std::vector<int64_t>& path = cuts[0].columns;
  EXPECT_EQ(skin.points[path.front()], a);
  EXPECT_EQ(skin.points[path.back()], b);
  EXPECT_NEAR(area(skin), 3600, 1e-9);
  double length = 0;
  for (size_t i = 0; i + 1 < path.size(); ++i) {
    const std::array<int64_t, 2> edge = {std::min(path[i], path[i + 1]),
                                         std::max(path[i], path[i + 1])};
    EXPECT_NE(std::find(mesh.edges.begin(), mesh.edges.end(), edge), mesh.edges.end());
    EXPECT_LT(off(skin.points[path[i]], a, b), 1.5) << "a tenth of an edge";
    length += mesh.edge_length(std::find(mesh.edges.begin(), mesh.edges.end(), edge) -
                               mesh.edges.begin());
  }
  EXPECT_NEAR(length, (b - a).norm(), 0.5);
}

TEST(CutPath, is_the_same_from_its_other_end) {
  std::vector<Vec3> path;
  for (int i = 0; i <= 16; ++i) path.emplace_back(13.7 + 2 * i, 22.3 + 4 * std::sin(0.3 * i), 0);
  std::array<std::vector<Vec3>, 2> places;
  for (std::vector<Vec3>& found : places) {
    surface::Surface skin = patches::square(6, 60);
    const std::vector<Cut> cuts = insert_paths({{path, 2}}, "scene.yaml", skin);
    for (const int64_t vertex : cuts[0].columns) found.push_back(skin.points[vertex]);
    std::reverse(path.begin(), path.end());
  }
  std::reverse(places[1].begin(), places[1].end());
  EXPECT_EQ(places[0], places[1]);
}

TEST(CutPath, follows_a_curved_skin) {
  surface::Surface skin = patches::sphere(50, 3);
  const double before = area(skin);
  const std::vector<Cut> cuts =
      insert_paths({{{{50, 0, 3}, {35, 35, 5}, {0, 50, 4}}, 1}}, "scene.yaml", skin);
  EXPECT_NEAR(area(skin), before, 1e-9 * before);
  EXPECT_TRUE(make_skin_mesh(skin).border_loops.empty());
  for (const int64_t v : cuts[0].columns) EXPECT_NEAR(skin.points[v].z(), 4, 2.5);
  EXPECT_GT(cuts[0].columns.size(), 8u);
}

TEST(CutPath, refuses_what_cannot_be_cut) {
  const auto says = [](const std::vector<scene::Incision>& incisions, const std::string& part) {
    const std::string text = refusal(incisions);
    EXPECT_NE(text.find(part), std::string::npos) << text << "\n lacks " << part;
    EXPECT_EQ(text.find("scene.yaml: incisions["), 0u) << text;
  };
  says({{{{15, 15, 0}, {15, 30, 7}}, 1}}, "7.0 mm from the skin, allowed are 5 mm");
  says({{{{15, 15, 0}, {63, 30, 0}}, 1}}, "reaches the rim");
  says({{{{15, 0, 0}, {45, 0, 0}}, 1}}, "reaches the rim");
  says({{{{15, 15, 0}, {20, 15, 0}}, 1}}, "no longer than an edge");
  const std::vector<Vec3> loop = {{12, 12, 0}, {48, 13, 0}, {47, 40, 0}, {30, 41, 0}, {29, 5, 0}};
  says({{loop, 1}}, "meets itself");
  says({{{{15, 15, 0}, {45, 45, 0}}, 1}, {{{15, 44, 0}, {45, 16, 0}}, 1}}, "incisions[1]");
}

class CutAlong : public ::testing::Test {
 protected:
  void make(int layers, int depth) {
    built_ =
        build_model(cut_scene(layers, {{{{13.7, 22.3, 0}, {30, 29, 0}, {41.9, 25.2, 0}}, depth}}),
                    patches::square(6, 60), {kBone});
    before_ = built_.model;
    pairs_ = cut_along(built_.cuts[0], built_.model);
  }
  BuiltModel built_;
  Model before_;
  std::vector<std::array<int64_t, 2>> pairs_;
};

double sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

TEST_F(CutAlong, doubles_the_points_down_to_the_depth_and_leaves_the_tips) {
  make(4, 2);
  const auto inner = static_cast<int64_t>(built_.cuts[0].columns.size()) - 2;
  EXPECT_EQ(static_cast<int64_t>(pairs_.size()), 2 * inner);
  const Points& p = built_.model.points;
  EXPECT_EQ(p.position.size(), before_.points.position.size() + pairs_.size());
  for (const auto& [row, twin] : pairs_) {
    EXPECT_GE(twin, static_cast<int64_t>(before_.points.position.size()));
    EXPECT_EQ(p.position[row], p.position[twin]);
    EXPECT_EQ(p.layer[row], p.layer[twin]);
    EXPECT_EQ(p.column[row], p.column[twin]);
    EXPECT_LT(p.layer[row], 2);
    for (const int64_t tip : {built_.cuts[0].columns.front(), built_.cuts[0].columns.back()})
      EXPECT_NE(p.column[row], tip);
  }
  EXPECT_NO_THROW(validate(built_.model, "cut"));
}

TEST_F(CutAlong, keeps_mass_stiffness_and_volume_in_total) {
  make(4, 3);
  const Model& m = built_.model;
  EXPECT_NEAR(sum(m.points.mass), sum(before_.points.mass), 1e-12);
  EXPECT_NEAR(sum(m.springs.stiffness), sum(before_.springs.stiffness), 1e-9);
  EXPECT_EQ(m.prisms.rest_volume, before_.prisms.rest_volume);
  EXPECT_EQ(m.skin.size(), before_.skin.size());
  EXPECT_GT(m.springs.points.size(), before_.springs.points.size());
  EXPECT_TRUE(std::is_sorted(m.springs.set.begin(), m.springs.set.end()));
  for (const double k : m.springs.stiffness) EXPECT_GT(k, 0);
}

/// 1 for the doubled points, 2 for their doubles, which lie right and left of the path.
std::vector<int> side_of_points(const Model& model,
                                const std::vector<std::array<int64_t, 2>>& pairs) {
  std::vector<int> side(model.points.position.size(), 0);
  for (const auto& [row, twin] : pairs) side[row] = 1, side[twin] = 2;
  return side;
}

TEST_F(CutAlong, parts_all_that_crossed_it) {
  make(4, 3);
  const std::vector<int> side = side_of_points(built_.model, pairs_);
  std::array<int, 4> count{};
  const auto see = [&](const auto& element) {
    int seen = 0;
    for (const int64_t row : element) seen |= side[row];
    ++count[seen];
  };
  for (const auto& ends : built_.model.springs.points) see(ends);
  for (const auto& corners : built_.model.prisms.points) see(corners);
  for (const Triangle& t : built_.model.skin) see(t);
  EXPECT_GT(count[1], 0);
  EXPECT_GT(count[2], 0);
  EXPECT_EQ(count[3], 0) << "joined to both sides";
}

TEST_F(CutAlong, springs_and_skin_go_with_their_prisms) {
  make(4, 3);
  std::set<std::array<int64_t, 2>> pairs;
  std::set<std::array<int64_t, 3>> tops;
  for (const auto& p : built_.model.prisms.points) {
    tops.insert({p[0], p[2], p[1]});
    for (const int64_t a : p)
      for (const int64_t b : p) pairs.insert({a, b});
  }
  for (const auto& ends : built_.model.springs.points) EXPECT_TRUE(pairs.contains(ends));
  for (const Triangle& t : built_.model.skin) EXPECT_TRUE(tops.contains(t));
}

/// The path runs towards +x, so that left of it is +y.
TEST_F(CutAlong, doubles_belong_to_the_left) {
  make(4, 3);
  const Model& m = built_.model;
  const std::vector<int> side = side_of_points(m, pairs_);
  std::array<double, 3> across{};  // mm³ mm, how far the prisms of a side lie from their points
  for (size_t k = 0; k < m.prisms.points.size(); ++k)
    for (const int64_t corner : m.prisms.points[k])
      for (const int64_t row : m.prisms.points[k])
        across[side[row]] +=
            m.prisms.rest_volume[k] * (m.points.position[corner] - m.points.position[row]).y();
  EXPECT_LT(across[1], -100);
  EXPECT_GT(across[2], 100);
}

TEST_F(CutAlong, leaves_points_on_bone_joined) {
  make(3, 3);
  for (const auto& [row, twin] : pairs_)
    EXPECT_EQ(built_.model.points.set[twin], PointSet::soft_tissue);
  const auto inner = static_cast<int64_t>(built_.cuts[0].columns.size()) - 2;
  EXPECT_EQ(static_cast<int64_t>(pairs_.size()), 2 * inner);
}

/// [whole model's points] weights of its edges, where `point_row` [points] are rows of it.
std::map<std::array<int64_t, 2>, double> weights_by_row(const Edges& edges,
                                                        const std::vector<int64_t>& point_row) {
  std::map<std::array<int64_t, 2>, double> weights;
  for (size_t j = 0; j < edges.points.size(); ++j) {
    const int64_t p = point_row[edges.points[j][0]], q = point_row[edges.points[j][1]];
    weights[{std::min(p, q), std::max(p, q)}] = edges.weight[j];
  }
  return weights;
}

/// The path turns back, so that it lies at the border of some pieces and in their middle, too.
TEST(CutPiece, edges_at_its_own_columns_are_those_of_the_whole) {
  scene::Scene scene =
      cut_scene(4, {{{{20, 30, 0}, {20, 60, 0}, {50, 60, 0}, {50, 10, 0}, {80, 10, 0}}, 3}});
  scene.tissue.material =
      scene::Material{.deep = {0.015, 0.45}, .strata = {{1.5, {0.1, 0.4}}}, .regions = {}};
  scene.tissue.turgor = 0.05;
  const surface::Surface skin = patches::square(10, 100);
  BuiltModel built = build_model(scene, skin, {kBone});
  cut_along(built.cuts[0], built.model);
  std::vector<int64_t> same(built.model.points.position.size());
  std::iota(same.begin(), same.end(), 0);
  const auto whole = weights_by_row(built.model.edges, same);
  const ColumnGeometry geometry(scene, skin, {kBone});
  for (size_t center = 0; center < geometry.skin().points.size(); ++center) {
    std::vector<int64_t> own, found, rows;
    for (size_t c = 0; c < geometry.skin().points.size(); ++c)
      if ((geometry.skin().points[c] - geometry.skin().points[center]).norm() < 25)
        own.push_back(static_cast<int64_t>(c));
    const Piece piece = geometry.piece(own);
    Model model = build_local(scene, {kBone}, piece, found);
    cut_along(geometry.cuts()[0], model);
    for (const int64_t c : piece.column)
      for (int a = 0; a < 4; ++a) rows.push_back(4 * c + a);
    for (const DoubledColumn& at : geometry.doubled())
      for (int a = 0; a < at.points && std::ranges::binary_search(piece.column, at.column); ++a)
        rows.push_back(at.first_row + a);
    ASSERT_EQ(rows.size(), model.points.position.size());
    const auto local = weights_by_row(model.edges, rows);
    for (const auto& [ends, weight] : whole)
      if (std::ranges::binary_search(own, built.model.points.column[ends[0]]) ||
          std::ranges::binary_search(own, built.model.points.column[ends[1]])) {
        ASSERT_TRUE(local.contains(ends));
        EXPECT_EQ(local.at(ends), weight);
      }
  }
}

class CutSolid : public CutAlong {
 protected:
  /// A solid whose edges carry `tension` besides, cut.
  void make_solid(double tension) {
    scene::Scene scene = cut_scene(4, {{{{13.7, 22.3, 0}, {30, 29, 0}, {41.9, 25.2, 0}}, 3}});
    scene.tissue.material = scene::Material{.deep = {0.015, 0.45}, .strata = {}, .regions = {}};
    built_ = build_model(scene, patches::square(6, 60), {kBone});
    for (double& weight : built_.model.edges.weight) weight += tension;
    before_ = built_.model;
    pairs_ = cut_along(built_.cuts[0], built_.model);
    whole_ = built_.model;
    assemble_edges("test", whole_);
  }
  Model whole_;  // with the edges that follow from its prisms
};

TEST_F(CutSolid, has_the_edges_that_follow_from_its_prisms) {
  make_solid(0);
  EXPECT_GT(pairs_.size(), 0u);
  EXPECT_EQ(built_.model.edges.points, whole_.edges.points);
  EXPECT_EQ(built_.model.edges.weight, whole_.edges.weight);
  EXPECT_NO_THROW(validate(built_.model, "cut"));
}

TEST_F(CutSolid, keeps_the_tension_that_its_edges_carry) {
  make_solid(1);
  const Model& m = built_.model;
  const auto forces = [](const Model& model, const std::vector<double>& weight) {
    std::vector<Vec3> force(model.points.position.size(), Vec3::Zero());
    for (size_t j = 0; j < weight.size(); ++j) {
      const auto& [p, q] = model.edges.points[j];
      const Vec3 pull = weight[j] * (model.points.position[q] - model.points.position[p]);
      force[p] += pull;
      force[q] -= pull;
    }
    return force;
  };
  std::vector<double> tension = m.edges.weight;
  for (size_t j = 0; j < tension.size(); ++j) {
    tension[j] -= whole_.edges.weight[j];
    EXPECT_GT(tension[j], 0);
  }
  EXPECT_NEAR(sum(tension), static_cast<double>(before_.edges.weight.size()), 1e-9);
  const std::vector<Vec3> was =
      forces(before_, std::vector<double>(before_.edges.weight.size(), 1.0));
  std::vector<Vec3> is = forces(m, tension);
  double largest = 0;  // N, with which the sides are pulled apart
  for (const auto& [row, twin] : pairs_) {
    largest = std::max(largest, is[twin].norm());
    is[row] += is[twin];
  }
  for (size_t i = 0; i < was.size(); ++i) EXPECT_LT((is[i] - was[i]).norm(), 1e-9);
  EXPECT_GT(largest, 1);
}

TEST(CutTouches, both_sides_share_the_area_that_touches) {
  Model m;
  m.contact.pairs = {{3, 5}, {0, 1}, {Binding::touches, Binding::slides}, {4, 6}};
  share_pairs({{5, 9}, {7, 10}}, m);
  const ContactPairs& pairs = m.contact.pairs;
  EXPECT_EQ(pairs.point, (std::vector<int64_t>{3, 5, 9}));
  EXPECT_EQ(pairs.body, (std::vector<int32_t>{0, 1, 1}));
  EXPECT_EQ(pairs.binding[2], Binding::slides);
  EXPECT_EQ(pairs.area, (std::vector<double>{4, 3, 3}));
}

}  // namespace cut_test
}  // namespace repose::model
