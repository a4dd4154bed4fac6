#include "repose/model/build.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "model/solved_skin.h"
#include "patches.h"
#include "repose/base/error.h"
#include "repose/model/skin_mesh.h"
#include "repose/scene/placement.h"

namespace repose::model {
namespace build_test {

using scene::RigidMotion;

const surface::Surface kFlatBone = patches::box({-30, -30, -25}, {130, 130, -10});

std::string refusal(const scene::Scene& scene, const surface::Surface& skin,
                    const std::vector<surface::Surface>& bones) {
  try {
    build_model(scene, skin, bones);
  } catch (const base::InputError& error) {
    const std::string text = error.what();
    EXPECT_EQ(text.find('\n'), std::string::npos);
    return text;
  }
  return "";
}

bool says(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

bool remarked(const BuildReport& report, const std::string& part) {
  return std::any_of(report.remarks.begin(), report.remarks.end(),
                     [&](const std::string& remark) { return says(remark, part); });
}

TEST(Build, every_point_is_in_the_set_it_belongs_to) {
  scene::Scene scene = patches::scene_of(3, {"jaw"});
  scene.rim = scene::Rim::fixed;
  scene.tissue.release = 0;
  scene.moves[0] = RigidMotion::rotation({1, 0, 0}, {0, 10, -20}, 8);
  const BuiltModel built = build_model(scene, patches::square(6, 60), {kFlatBone});
  const Points& points = built.model.points;
  EXPECT_NO_THROW(validate(built.model, "built"));
  for (size_t i = 0; i < points.position.size(); ++i) {
    const Vec3& top = points.position[i - i % 3];
    const bool rim = top.x() < 1 || top.x() > 59 || top.y() < 1 || top.y() > 59;
    const bool deepest = i % 3 == 2;
    const PointSet expected = rim       ? PointSet::boundary
                              : deepest ? PointSet::bone
                                        : PointSet::soft_tissue;
    EXPECT_EQ(points.set[i], expected);
    EXPECT_EQ(points.bone[i], expected == PointSet::bone ? 0 : -1);
    const Vec3 target =
        expected == PointSet::bone ? scene.moves[0].apply(points.position[i]) : points.position[i];
    EXPECT_EQ(points.target[i], target);
  }
  const Counts counts = count(built.model);
  EXPECT_EQ(counts.boundary, 24 * 3);
  EXPECT_EQ(counts.bone, 25);
  EXPECT_EQ(counts.soft, 50);
  EXPECT_EQ(built.report.attached, 25);
  EXPECT_EQ(built.report.free_deep, 0);
  EXPECT_NEAR(built.report.thickness_median, 10, 1e-9);
  ASSERT_EQ(built.model.bone_transform.size(), 1u);
  EXPECT_EQ(built.model.bone_transform[0], scene.moves[0].matrix());
  EXPECT_EQ(built.model.bones, std::vector<std::string>{"jaw"});
}

TEST(Build, grids_of_distances_resolve_thin_bone) {
  const auto spacing = [](double thickness, const auto& grid) {
    scene::Scene scene = patches::scene_of(3, {"jaw"});
    scene.contact.emplace().grid = grid;
    const auto bone = patches::box({-30, -30, -10 - thickness}, {130, 130, -10});
    return build_model(scene, patches::square(6, 60), {bone}).model.contact.spacing;
  };
  EXPECT_EQ(spacing(15, std::nullopt), 0.6);
  EXPECT_NEAR(spacing(1.1, std::nullopt), 0.55, 1e-9);
  EXPECT_EQ(spacing(0.3, std::nullopt), 0.5);
  EXPECT_EQ(spacing(1.4, std::optional(2.5)), 2.5);
}

TEST(Build, only_the_longest_border_is_the_rim) {
  const surface::Surface skin = patches::paper_sized_annulus();
  const surface::Surface bone = patches::box({-100, -100, -30}, {100, 100, -10});
  scene::Scene scene = patches::scene_of(2, {"skull"});
  EXPECT_EQ(count(build_model(scene, skin, {bone}).model).boundary, 60 * 2);
  scene.rim = scene::Rim::free;
  const Counts free = count(build_model(scene, skin, {bone}).model);
  EXPECT_EQ(free.boundary, 0);
  EXPECT_EQ(free.bone, 477);
}

TEST(Build, an_automatic_rim_is_held_over_bone_that_rests_only) {
  const surface::Surface half = patches::box({-50, -50, -25}, {50, 150, -10});
  scene::Scene scene = patches::scene_of(2, {"skull"});
  const auto boundary = [&] {
    std::vector<double> x;
    const Points points = build_model(scene, patches::square(20, 100), {half}).model.points;
    for (size_t i = 0; i < points.set.size(); ++i)
      if (points.set[i] == PointSet::boundary) x.push_back(points.position[i].x());
    return x;
  };
  const std::vector<double> resting = boundary();
  EXPECT_GT(resting.size(), 60u);
  for (const double x : resting) EXPECT_LT(x, 60);
  scene.moves[0] = RigidMotion::translation({0, 0, -3});
  EXPECT_TRUE(boundary().empty());
}

TEST(Build, a_remeshed_skin_is_lifted_off_bone_that_reaches_through_it) {
  Anatomy anatomy{patches::scene_of(3, {"skull"}), patches::sphere(45, 5), {}, {}, {}, {}};
  anatomy.scene.tissue.edge = 4;
  anatomy.bones = {patches::sphere(20, 4)};
  for (Vec3& x : anatomy.bones[0].points) x.z() += 25.6;  // 0.6 mm beyond the skin
  anatomy.bones[0].name = "skull";
  EXPECT_THROW(build_model(anatomy), RefusedPlaces);
  remesh_skin(anatomy);
  ASSERT_TRUE(anatomy.given_skin.has_value());
  const BuiltModel built = build_model(anatomy);
  EXPECT_TRUE(remarked(built.report, "inside bone and were moved out"));
  EXPECT_TRUE(remarked(built.report, "edges of 4 mm"));
  for (const double volume : built.model.prisms.rest_volume) EXPECT_GT(volume, 0);
}

TEST(Build, a_refused_skin_is_replaced_unless_the_scene_says_how_it_is_meshed) {
  Anatomy anatomy{patches::scene_of(3, {"skull"}), patches::sphere(45, 5), {}, {}, {}, {}};
  anatomy.bones = {patches::sphere(20, 4)};
  for (Vec3& x : anatomy.bones[0].points) x.z() += 25.6;  // 0.6 mm beyond the skin
  anatomy.bones[0].name = "skull";
  const auto build = [](const Anatomy& on) { return build_model(on); };
  Anatomy insisted = anatomy;
  insisted.scene.tissue.keeps_given_skin = true;
  EXPECT_THROW(build_on_solvable_skin(insisted, build), RefusedPlaces);
  const BuiltModel built = build_on_solvable_skin(anatomy, build);
  EXPECT_TRUE(anatomy.given_skin.has_value());
  EXPECT_TRUE(remarked(built.report, "was remeshed"));
  EXPECT_TRUE(remarked(built.report, "lie inside bone"));
  EXPECT_TRUE(remarked(built.report, "tissue.edge: given"));
}

TEST(Build, columns_without_bone_beneath_end_free) {
  const surface::Surface half = patches::box({-50, -50, -25}, {50, 150, -10});
  const BuiltModel built =
      build_model(patches::scene_of(4, {"skull"}), patches::square(20, 100), {half});
  EXPECT_NO_THROW(validate(built.model, "built"));
  EXPECT_GT(built.report.free_deep, 100);
  EXPECT_GT(built.report.attached, 100);
  for (size_t i = 3; i < built.model.points.position.size(); i += 4) {
    if (built.model.points.position[i - 3].x() > 60) {
      EXPECT_EQ(built.model.points.bone[i], -1);
    }
  }
}

TEST(Build, an_unattached_region_is_let_go_and_its_columns_stay_as_they_are) {
  scene::Scene scene = patches::scene_of(3, {"skull"});
  const surface::Surface skin = patches::square(20, 100);
  const BuiltModel held = build_model(scene, skin, {kFlatBone});
  scene::AttachRegion& region = scene.tissue.attach_regions.emplace_back();
  region = {scene::Sphere{{50, 50, -10}, 20.1}, scene::Attach::contact};
  const BuiltModel built = build_model(scene, skin, {kFlatBone});
  int64_t let_go = 0;
  for (size_t i = 2; i < built.model.points.position.size(); i += 3) {
    EXPECT_EQ(built.model.points.position[i], held.model.points.position[i]);
    const bool inside = (built.model.points.position[i] - Vec3(50, 50, -10)).norm() <= 20.1;
    let_go += inside;
    if (inside) {
      EXPECT_EQ(built.model.points.set[i], PointSet::soft_tissue);
    }
  }
  EXPECT_EQ(held.report.attached - built.report.attached, let_go);
  EXPECT_EQ(built.report.free_deep, let_go);
  EXPECT_EQ(let_go, 49);  // grid points within 4.02 cells
}

TEST(Build, a_box_lets_go_no_more_than_lies_in_it) {
  scene::Scene scene = patches::scene_of(3, {"skull"});
  scene.tissue.attach_regions = {
      {scene::Box{{50, 50, -10}, {38, 28, 2}}, scene::Attach::contact}};  // the grid is of 5 mm
  const BuiltModel built = build_model(scene, patches::square(20, 100), {kFlatBone});
  EXPECT_EQ(built.report.free_deep, 7 * 5);
}

struct TwoJaws {
  surface::Surface skin = patches::square(40, 100);
  std::vector<surface::Surface> bones = {patches::box({-20, -20, -25}, {51.2, 120, -10}),
                                         patches::box({51.3, -20, -25}, {120, 120, -10})};
  scene::Scene scene = patches::scene_of(2, {"upper", "lower"});
};

TEST(Build, tissue_lets_go_near_a_piece_that_moves_differently) {
  TwoJaws jaws;
  jaws.scene.rim = scene::Rim::fixed;
  jaws.scene.tissue.release = 10.1;
  jaws.scene.moves[1] = RigidMotion::translation({0, 6, 0});
  const BuiltModel built = build_model(jaws.scene, jaws.skin, jaws.bones);
  int64_t released = 0;
  for (size_t i = 1; i < built.model.points.position.size(); i += 2) {
    if (built.model.points.set[i] == PointSet::boundary) continue;
    const Vec3& p = built.model.points.position[i];
    const double x = p.x(), rim = std::min({100 - x, p.y(), 100 - p.y()});
    const bool near = x < 51.25 ? 51.3 - x < 10.1 : x - 51.2 < 10.1 || rim < 10.1;
    released += near;
    const int32_t own = x < 51.25 ? 0 : 1;
    EXPECT_EQ(built.model.points.bone[i], near ? -1 : own) << x;
  }
  EXPECT_GT(released, 0);
  EXPECT_EQ(built.report.released, released);
  EXPECT_EQ(built.report.free_deep, released);
}

TEST(Build, tissue_on_a_moving_bone_lets_go_near_the_fixed_rim) {
  scene::Scene scene = patches::scene_of(3, {"jaw"});
  const surface::Surface skin = patches::square(6, 60);
  scene.rim = scene::Rim::fixed;
  scene.tissue.release = 10.1;
  EXPECT_EQ(build_model(scene, skin, {kFlatBone}).report.released, 0);
  scene.moves[0] = RigidMotion::translation({0, -6, 0});
  EXPECT_EQ(build_model(scene, skin, {kFlatBone}).report.released, 16);  // the ring next to the rim
  scene.rim = scene::Rim::free;
  EXPECT_EQ(build_model(scene, skin, {kFlatBone}).report.released, 0);
}

TEST(Build, tissue_lets_go_the_farther_the_more_differently_pieces_move) {
  TwoJaws jaws;
  jaws.scene.rim = scene::Rim::free;
  jaws.scene.moves[0] = RigidMotion::translation({0, 5, 0});
  const auto released_at = [&](double difference) {
    jaws.scene.moves[1] = RigidMotion::translation({0, 5 + difference, 0});
    return build_model(jaws.scene, jaws.skin, jaws.bones).report.released;
  };
  for (const double difference : {-1e-6, 0.0, 1e-6, 0.001}) EXPECT_EQ(released_at(difference), 0);
  // Rows of 41 columns, 2.5 mm apart, the first 1.2 mm from the gap, of both jaws alike.
  EXPECT_EQ(released_at(1), 41 * 2);   // within 2.5 mm
  EXPECT_EQ(released_at(-2), 41 * 4);  // 5 mm
  EXPECT_EQ(released_at(4), 41 * 8);   // 10 mm
  EXPECT_EQ(released_at(6), 41 * 8);   // at most
}

/// Share by which the point of a layer of each column follows its bone, against a spring as stiff
/// as the tissue above it. `area` in mm², of a point.
std::vector<double> held_shares(const TwoJaws& jaws, int64_t layer, double area) {
  const BuiltModel built = build_model(jaws.scene, jaws.skin, jaws.bones);
  const Points& points = built.model.points;
  constexpr double thickness = 10;  // mm
  std::vector<double> shares;
  for (size_t i = layer; i < points.position.size(); i += 2)
    shares.push_back(points.set[i] == PointSet::soft_tissue ? 0 : 1);
  for (const TermElements& elements : built.model.elements) {
    EXPECT_EQ(elements.term, "elastic_support");
    for (size_t e = 0; e < elements.size(); ++e) {
      const int64_t point = elements.points_of(e)[0];
      const auto numbers = elements.numbers_of(e);
      if (point % 2 != layer) continue;
      EXPECT_EQ(points.set[point], PointSet::soft_tissue);
      EXPECT_EQ(Vec3(numbers[0], numbers[1], numbers[2]), points.position[point]);
      EXPECT_EQ(numbers[4], points.position[point].x() < 51.25 ? 0 : 1);
      const double stiffness =
          numbers[3] * thickness / area / jaws.scene.tissue.material->deep.young;
      shares[point / 2] = stiffness / (1 + stiffness);
    }
  }
  return shares;
}

TEST(Build, the_support_of_a_solid_by_bone_follows_the_move_without_a_jump) {
  TwoJaws jaws;
  jaws.scene.rim = scene::Rim::free;
  jaws.scene.tissue.material = scene::Material{{0.015, 0.45}, {}, {}};
  const auto shares_at = [&](double difference) {
    jaws.scene.moves[1] = RigidMotion::translation({0, difference, 0});
    return held_shares(jaws, 1, 6.25);
  };
  const size_t row = 20 * 41;  // in the middle, 2.5 mm apart, the gap between 51.2 and 51.3
  const std::vector<double> far = shares_at(4);
  for (const auto& [column, share] : std::vector<std::pair<int, double>>{
           {20, 0}, {17, (8.8 / 10 - 0.6) / 0.8}, {16, (11.3 / 10 - 0.6) / 0.8}, {14, 1}})
    EXPECT_NEAR(far[row + column], share, 1e-9) << column;
  std::vector<double> before = shares_at(0.5);
  for (double difference = 0.52; difference < 4.5; difference += 0.02) {
    const std::vector<double> now = shares_at(difference);
    for (int column = 1; column < 40; ++column)
      EXPECT_NEAR(now[row + column], before[row + column], 0.08) << column << " at " << difference;
    before = now;
  }
}

TEST(Build, the_support_of_a_solid_is_as_stiff_as_the_materials_above_it) {
  TwoJaws jaws;  // 10 mm of tissue
  jaws.scene.moves[1] = RigidMotion::translation({0, 6, 0});
  const auto stiffness_in = [&](const scene::Material& material) {
    jaws.scene.tissue.material = material;
    std::vector<double> found;
    for (const TermElements& elements :
         build_model(jaws.scene, jaws.skin, jaws.bones).model.elements)
      for (size_t e = 0; e < elements.size(); ++e) found.push_back(elements.numbers_of(e)[3]);
    return found;
  };
  const std::vector<double> plain = stiffness_in({{0.02, 0.45}, {}, {}});
  ASSERT_FALSE(plain.empty());
  const auto expect_times = [&](double times, const scene::Material& material) {
    const std::vector<double> found = stiffness_in(material);
    ASSERT_EQ(found.size(), plain.size());
    for (size_t e = 0; e < found.size(); ++e)
      EXPECT_NEAR(found[e], times * plain[e], 1e-12 * plain[e]) << e;
  };
  const scene::Stratum skin{4, {0.08, 0.45}}, all{100, {0.02, 0.45}};
  expect_times(1 / (0.4 / 4 + 0.6), {{0.02, 0.45}, {skin}, {}});
  expect_times(1, {{7, 0.45}, {all}, {}});
  expect_times(3, {{7, 0.45}, {}, {{scene::Box{{50, 50, 0}, {1e3, 1e3, 1e3}}, {0.06, 0.45}}}});
}

TEST(Build, a_rim_lets_go_beside_a_moving_piece_without_a_jump) {
  TwoJaws jaws;
  jaws.scene.tissue.material = scene::Material{{0.015, 0.45}, {}, {}};
  const auto shares_at = [&](double difference) {
    jaws.scene.moves[1] = RigidMotion::translation({0, difference, 0});
    return held_shares(jaws, 0, 3.125);  // of points of the skin at the rim
  };
  const std::vector<double> far = shares_at(4);
  EXPECT_EQ(far[14], 1);
  EXPECT_NEAR(far[16], (11.3 / 10 - 0.6) / 0.8, 1e-9);
  EXPECT_EQ(far[20], 0);
  EXPECT_EQ(far[30], 0);  // of the jaw that moves
  std::vector<double> before = shares_at(0.5);
  for (double difference = 0.52; difference < 4.5; difference += 0.02) {
    const std::vector<double> now = shares_at(difference);
    for (int column = 1; column <= 20; ++column)
      EXPECT_NEAR(now[column], before[column], 0.08) << column << " at " << difference;
    before = now;
  }
}

TEST(Build, where_bones_overlap_a_point_that_is_more_held_than_not_touches_its_own_alone) {
  TwoJaws jaws;
  jaws.scene.rim = scene::Rim::free;
  jaws.scene.tissue.material = scene::Material{{0.015, 0.45}, {}, {}};
  jaws.scene.contact = scene::Contact{};
  jaws.scene.moves[1] = RigidMotion::translation({0, 6, 0});
  const Model model = build_model(jaws.scene, jaws.skin, jaws.bones).model;
  const size_t row = 20 * 41;
  const auto touched_by = [&](size_t column) {
    std::vector<int32_t> bodies;
    for (size_t c = 0; c < model.contact.pairs.point.size(); ++c)
      if (model.contact.pairs.point[c] == static_cast<int64_t>(2 * (row + column) + 1))
        bodies.push_back(model.contact.pairs.body[c]);
    return bodies;
  };
  EXPECT_EQ(touched_by(16), std::vector<int32_t>({0}));     // held by 0.66
  EXPECT_EQ(touched_by(17), std::vector<int32_t>({0, 1}));  // by 0.35
  EXPECT_EQ(touched_by(14), std::vector<int32_t>());        // by bone
}

TEST(Build, a_share_of_the_tissue_of_a_chin_stays_attached) {
  TwoJaws jaws;
  jaws.scene.rim = scene::Rim::free;
  jaws.scene.moves[1] = RigidMotion::translation({0, 6, 0});
  scene::AnatomyPlan& plan = jaws.scene.anatomy.emplace();
  plan.part_lips = plan.vestibule = false;
  plan.adhesion = plan.tone = 0;
  scene::Osteotomy& cut = jaws.scene.osteotomies.emplace_back();
  cut.bone = 0;
  cut.piece = 1;
  cut.made_by = scene::OsteotomyTemplate::genioplasty;
  const auto report_with = [&](double pedicle) {
    plan.pedicle = pedicle;
    return build_model(jaws.scene, jaws.skin, jaws.bones).report;
  };
  EXPECT_EQ(report_with(0).released, 41 * 8);  // four rows of 41 columns of each jaw
  const BuildReport half = report_with(0.5);
  EXPECT_EQ(half.released, 41 * 8);
  EXPECT_FALSE(remarked(half, "pedicle"));
  const BuildReport most = report_with(0.9);  // a row is 1/19.5 of the piece's tissue
  EXPECT_EQ(most.released, 41 * (4 + 1));
  EXPECT_TRUE(remarked(most, "tissue on 'lower' is released within 3.8 in place of 10 mm"));
  EXPECT_EQ(report_with(1).released, 41 * 4);
  cut.made_by = scene::OsteotomyTemplate::sagittal_split;
  EXPECT_EQ(report_with(0.9).released, 41 * 8);
}

TEST(Build, a_plan_makes_attachment_and_contact_the_same_for_all_its_moves) {
  TwoJaws jaws;
  jaws.scene.contact.emplace();
  const auto built = [&](double first, double second) {
    jaws.scene.moves = {RigidMotion::translation({0, first, 0}),
                        RigidMotion::translation({0, second, 0})};
    return build_model(jaws.scene, jaws.skin, jaws.bones).model;
  };
  const auto same = [](const Model& a, const Model& b) {
    return a.points.set == b.points.set && a.points.bone == b.points.bone &&
           a.contact.pairs.point == b.contact.pairs.point &&
           a.contact.pairs.body == b.contact.pairs.body;
  };
  EXPECT_FALSE(same(built(5, 5), built(5, 6)));
  jaws.scene.plan = scene::Plan{{0, 1}, {0, 6, 0}, {0, 0, 0}};
  const Model rest = built(0, 0);
  for (const auto& [first, second] : {std::pair(5.0, 5.0), {5.0, 5.001}, {5.0, 6.0}, {-6.0, 6.0}})
    EXPECT_TRUE(same(rest, built(first, second))) << first << ' ' << second;
  for (const int32_t bone : rest.points.bone) EXPECT_LT(bone, 2);
  EXPECT_EQ(std::ranges::count(rest.points.set, PointSet::boundary), 0) << "both jaws may move";
}

TEST(Build, a_plan_refuses_moves_out_of_its_box) {
  TwoJaws jaws;
  jaws.scene.plan = scene::Plan{{1}, {0, 6, 0}, {1, 1, 1}};
  jaws.scene.moves[1] = RigidMotion::translation({0, 6.1, 0});
  EXPECT_TRUE(says(refusal(jaws.scene, jaws.skin, jaws.bones),
                   "plan.box: 'lower' moves out of it: translation 6.1 mm along y is outside"));
  jaws.scene.moves[1] = RigidMotion::rotation(
      {1, 0, 0}, scene::centroid(jaws.bones[1].points, jaws.bones[1].triangles), -1.1);
  EXPECT_TRUE(says(refusal(jaws.scene, jaws.skin, jaws.bones), "rotation -1.1 degrees along x"));
}

TEST(Build, a_rim_is_held_where_its_bone_hardly_moves) {
  scene::Scene scene = patches::scene_of(3, {"jaw"});
  const auto boundary_at = [&](const RigidMotion& move) {
    scene.moves[0] = move;
    return count(build_model(scene, patches::square(6, 60), {kFlatBone}).model).boundary / 3;
  };
  EXPECT_EQ(boundary_at({}), 24);
  EXPECT_EQ(boundary_at(RigidMotion::translation({0, 1e-9, 0})), 24);
  EXPECT_EQ(boundary_at(RigidMotion::translation({0, 0.05, 0})), 24);
  EXPECT_EQ(boundary_at(RigidMotion::translation({0, 1, 0})), 0);
  scene.tissue.attach = scene::Attach::slide;
  EXPECT_EQ(boundary_at({}), 24);
}

TEST(Build, a_border_near_a_bone_that_moves_is_reported) {
  const surface::Surface skin = patches::square(20, 100);
  const surface::Surface jaw = patches::box({40, 40, -25}, {60, 60, -10});
  scene::Scene scene = patches::scene_of(2, {"skull", "jaw"});
  const surface::Surface skull = patches::box({-30, -30, -60}, {130, 130, -30});
  const auto remarks = [&](const Vec3& move) {
    scene.moves[1] = RigidMotion::translation(move);
    return build_model(scene, skin, {skull, jaw}).report;
  };
  EXPECT_FALSE(remarked(remarks({0, 0, 0}), "the skin ends"));
  EXPECT_FALSE(remarked(remarks({20, 0, 0}), "the skin ends")) << "it comes within 22 mm";
  EXPECT_TRUE(remarked(remarks({30, 0, 0}), "the skin ends 14.1 mm from bone 'jaw'"));
  EXPECT_TRUE(remarked(remarks({30, 0, 0}), "0.2 to 0.3 mm"));
  scene.rim = scene::Rim::fixed;
  const std::vector<std::string> warnings = remarks({30, 0, 0}).warnings;
  ASSERT_FALSE(warnings.empty());
  EXPECT_NE(warnings.back().find("1.7 to 3.5 mm"), std::string::npos);
  EXPECT_NE(warnings.back().find("rim: auto"), std::string::npos);
}

TEST(Build, nothing_is_released_at_distance_0_or_by_pieces_that_move_together) {
  TwoJaws jaws;
  jaws.scene.moves[1] = RigidMotion::translation({0, 6, 0});
  jaws.scene.tissue.release = 0;
  EXPECT_EQ(build_model(jaws.scene, jaws.skin, jaws.bones).report.free_deep, 0);
  jaws.scene.tissue.release = 10;
  jaws.scene.moves[0] = jaws.scene.moves[1];
  jaws.scene.rim = scene::Rim::free;
  EXPECT_EQ(build_model(jaws.scene, jaws.skin, jaws.bones).report.free_deep, 0);
  jaws.scene.moves[0] = RigidMotion::rotation({0, 0, 1}, {50, 50, 0}, 1);
  EXPECT_GT(build_model(jaws.scene, jaws.skin, jaws.bones).report.released, 0);
}

TEST(Build, a_skin_inside_out_is_turned_round) {
  surface::Surface skin = patches::square(6, 60);
  const scene::Scene scene = patches::scene_of(2, {"skull"});
  const BuiltModel straight = build_model(scene, skin, {kFlatBone});
  EXPECT_FALSE(remarked(straight.report, "turned round"));
  for (Triangle& t : skin.triangles) std::swap(t[1], t[2]);
  const BuiltModel turned = build_model(scene, skin, {kFlatBone});
  EXPECT_TRUE(remarked(turned.report, "turned round"));
  EXPECT_EQ(turned.model.points.position, straight.model.points.position);
  for (const double v : turned.model.prisms.rest_volume) EXPECT_GT(v, 0);
  const Triangle& t = turned.model.skin.front();
  const auto& x = turned.model.points.position;
  EXPECT_GT((x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]).z(), 0);
}

TEST(Build, forces_sum_to_what_was_asked_and_reach_free_skin_points_only) {
  scene::Scene scene = patches::scene_of(3, {"skull"});
  scene.forces.push_back({{10, 30, 0}, 17, {0.3, -0.7, 2}});
  scene.forces.push_back({{45, 45, 1}, 9, {0, 1, 0}});
  const Model model = build_model(scene, patches::square(12, 60), {kFlatBone}).model;
  Vec3 sum = Vec3::Zero();
  for (size_t i = 0; i < model.points.position.size(); ++i) {
    sum += model.points.external_force[i];
    if (model.points.external_force[i].norm() == 0) continue;
    EXPECT_EQ(model.points.layer[i], 0);
    EXPECT_EQ(model.points.set[i], PointSet::soft_tissue);
  }
  EXPECT_LT((sum - Vec3(0.3, 0.3, 2)).norm(), 1e-14);
}

TEST(Build, masses_sum_to_the_layers_or_to_the_volume) {
  scene::Scene scene = patches::scene_of(3, {"skull"});
  scene.tissue.mass = {0.05, 0.1, 0.02};
  const surface::Surface skin = patches::paper_sized_annulus();
  const surface::Surface bone = patches::box({-100, -100, -30}, {100, 100, -10});
  const Model model = build_model(scene, skin, {bone}).model;
  double sums[3] = {0, 0, 0}, volume = 0;
  for (size_t i = 0; i < model.points.mass.size(); ++i)
    sums[model.points.layer[i]] += model.points.mass[i];
  for (int a = 0; a < 3; ++a) EXPECT_NEAR(sums[a], scene.tissue.mass[a], 1e-15);

  scene.tissue.mass.clear();
  scene.tissue.density = 1e-6;
  const Model dense = build_model(scene, skin, {bone}).model;
  double mass = 0;
  for (const double m : dense.points.mass) mass += m;
  for (const double v : dense.prisms.rest_volume) volume += v;
  EXPECT_NEAR(mass, 1e-6 * volume, 1e-12 * mass);
}

TEST(Build, masses_follow_the_area) {
  scene::Scene scene = patches::scene_of(2, {"skull"});
  scene.tissue.mass = {0.36, 0};
  const Model model = build_model(scene, patches::square(6, 60), {kFlatBone}).model;
  EXPECT_NEAR(model.points.mass[2 * 8], 0.36 / 36, 1e-15);  // an inner vertex has one cell's area
  EXPECT_NEAR(model.points.mass[2 * 8 + 1], 0, 0);
}

TEST(Build, what_the_scene_does_not_mention_is_not_there) {
  const Model model =
      build_model(patches::scene_of(2, {"skull"}), patches::square(3, 60), {kFlatBone}).model;
  EXPECT_EQ(model.gravity, Vec3(0, 0, 0));
  for (const double m : model.points.mass) EXPECT_EQ(m, 0);
  for (const Vec3& f : model.points.external_force) EXPECT_EQ(f, Vec3(0, 0, 0));
}

TEST(Build, twice_is_the_same_to_the_bit) {
  TwoJaws jaws;
  jaws.scene.moves[1] = RigidMotion::translation({0, 6, 0});
  jaws.scene.tissue.springs["default"].modulus = 0.02;
  const Model a = build_model(jaws.scene, jaws.skin, jaws.bones).model;
  const Model b = build_model(jaws.scene, jaws.skin, jaws.bones).model;
  EXPECT_EQ(a.points.position, b.points.position);
  EXPECT_EQ(a.points.set, b.points.set);
  EXPECT_EQ(a.springs.points, b.springs.points);
  EXPECT_EQ(a.springs.stiffness, b.springs.stiffness);
  EXPECT_EQ(a.prisms.rest_volume, b.prisms.rest_volume);
}

TEST(BuildRefuses, what_nothing_holds) {
  scene::Scene scene = patches::scene_of(2, {});
  scene.rim = scene::Rim::free;
  EXPECT_TRUE(says(refusal(scene, patches::square(6, 60), {}), "nothing holds"));
}

TEST(BuildRefuses, what_has_no_free_point) {
  const scene::Scene scene = patches::scene_of(2, {"skull"});
  EXPECT_TRUE(says(refusal(scene, patches::square(1, 60), {kFlatBone}), "free to move"));
}

TEST(BuildRefuses, a_bone_that_moves_without_tissue) {
  scene::Scene scene = patches::scene_of(2, {"skull", "far"});
  const surface::Surface far = patches::box({0, 0, -120}, {50, 50, -70});
  const BuiltModel built = build_model(scene, patches::square(6, 60), {kFlatBone, far});
  EXPECT_TRUE(remarked(built.report, "'far'"));
  scene.moves[1] = RigidMotion::translation({1, 0, 0});
  const std::string text = refusal(scene, patches::square(6, 60), {kFlatBone, far});
  EXPECT_TRUE(says(text, "'far' moves")) << text;
  EXPECT_TRUE(says(text, "70.0 mm")) << text;
  EXPECT_TRUE(says(text, "attach_within is 30")) << text;
}

TEST(BuildRefuses, a_moving_bone_whose_tissue_is_all_released) {
  TwoJaws jaws;
  jaws.scene.moves[1] = RigidMotion::translation({0, 6, 0});
  jaws.scene.tissue.release = 60;
  EXPECT_TRUE(says(refusal(jaws.scene, jaws.skin, jaws.bones), "tissue.release smaller"));
}

TEST(BuildRefuses, surfaces_in_different_frames) {
  surface::Surface bone = kFlatBone, skin = patches::square(6, 60);
  for (Vec3& x : skin.points) x += Vec3(100, 200, 0);
  for (Vec3& x : bone.points) {
    x += Vec3(100, 200, 0);
    x.head<2>() *= -1;
  }
  const scene::Scene scene = patches::scene_of(2, {"skull"});
  EXPECT_TRUE(says(refusal(scene, skin, {bone}), "LPS"));
  for (Vec3& x : bone.points) x += Vec3(0, 0, 1e6);
  EXPECT_TRUE(says(refusal(scene, skin, {bone}), "one scan"));
}

TEST(BuildRefuses, skin_inside_bone) {
  const surface::Surface bone = patches::box({-30, -30, -25}, {130, 20, 3});
  const std::string text = refusal(patches::scene_of(2, {"skull"}), patches::square(6, 60), {bone});
  EXPECT_TRUE(says(text, "inside")) << text;
  EXPECT_TRUE(says(text, "vertex 0 ")) << text;
}

TEST(BuildRefuses, a_force_that_meets_no_free_skin) {
  scene::Scene scene = patches::scene_of(2, {"skull"});
  scene.forces.push_back({{30, 30, 50}, 5, {0, 0, -2}});
  const std::string text = refusal(scene, patches::square(6, 60), {kFlatBone});
  EXPECT_TRUE(says(text, "forces[0]")) << text;
  EXPECT_TRUE(says(text, "50.00 mm")) << text;
}

TEST(BuildRefuses, a_skin_that_is_not_a_manifold) {
  const scene::Scene scene = patches::scene_of(2, {"skull"});
  surface::Surface skin = patches::square(3, 60);
  skin.triangles.push_back({0, 1, 9});
  EXPECT_TRUE(says(refusal(scene, skin, {kFlatBone}), "square.ply"));
  skin = patches::square(3, 60);
  std::swap(skin.triangles[4][0], skin.triangles[4][1]);
  EXPECT_TRUE(says(refusal(scene, skin, {kFlatBone}), "opposite"));
  skin = patches::square(3, 60);
  skin.points.emplace_back(3, 3, 3);
  EXPECT_TRUE(says(refusal(scene, skin, {kFlatBone}), "vertex 16"));
  skin = patches::square(3, 60);
  skin.points[5] = skin.points[6];
  EXPECT_TRUE(says(refusal(scene, skin, {kFlatBone}), "no area"));
  skin = patches::square(3, 60);
  skin.triangles[2][1] = 99;
  EXPECT_TRUE(says(refusal(scene, skin, {kFlatBone}), "vertex 99"));
}

}  // namespace build_test
}  // namespace repose::model
