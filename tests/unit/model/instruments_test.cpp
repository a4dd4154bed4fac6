#include "repose/model/instruments.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../folder.h"
#include "patches.h"
#include "repose/base/error.h"
#include "repose/model/build.h"
#include "repose/surface/read.h"

namespace repose::model {
namespace instruments_test {

using scene::Instrument;

std::optional<Stretch> along(const Instrument& instrument, const Vec3& p) {
  return PushedShape(instrument).along(p);
}

void expect_stretch(const std::optional<Stretch>& part, double enter, double leave) {
  ASSERT_TRUE(part);
  EXPECT_NEAR(part->enter, enter, 1e-9);
  EXPECT_NEAR(part->leave, leave, 1e-9);
}

TEST(PushedShape, shapes_are_met_where_they_end) {
  const Vec3 push(0, 0, -10);
  expect_stretch(along({scene::Sphere{{0, 0, 20}, 5}, push}, {3, 0, 12}), -2, 6);
  expect_stretch(along({scene::Box{{0, 0, 20}, {8, 8, 4}}, push}, {3, -3, 11}), -1, 3);
  EXPECT_FALSE(along({scene::Box{{0, 0, 20}, {8, 8, 4}}, push}, {5, 0, 11}));
  const scene::HalfSpace half{{0, 0, 20}, {0, 0, -3}};
  EXPECT_NEAR(along({half, push}, {7, 8, 14})->leave, 4, 1e-12);
  const scene::Capsule lying{{-9, 0, 20}, {9, 0, 20}, 5}, standing{{0, 0, 20}, {0, 0, 30}, 5};
  expect_stretch(along({lying, push}, {2, 3, 12}), -2, 6);
  expect_stretch(along({lying, push}, {12, 0, 12}), -2, 6);
  expect_stretch(along({standing, push}, {3, 0, 12}), -12, 6);
  EXPECT_FALSE(along({standing, push}, {0, 5.1, 12}));
}

/// Against the definition: a point is inside where its distance from the segment is the radius.
TEST(PushedShape, an_oblique_capsule_ends_at_its_radius) {
  const scene::Capsule capsule{{1, 2, 3}, {9, -4, 8}, 2.5};
  const auto distance = [&](const Vec3& p) {
    const Vec3 axis = capsule.to - capsule.from;
    const double t = std::clamp((p - capsule.from).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
    return (p - capsule.from - t * axis).norm();
  };
  int met = 0;
  for (int k = 0; k < 200; ++k) {
    const Vec3 push(std::sin(k), std::cos(3 * k), std::sin(7 * k + 1)),
        d = push.normalized(),
        start(5 + 4 * std::cos(5 * k), -1 + 4 * std::sin(11 * k), 5 + 4 * std::sin(2 * k));
    const auto part = along({capsule, push}, start + push);
    if (!part) continue;
    ++met;
    EXPECT_NEAR(distance(start + part->enter * d), 2.5, 1e-9);
    EXPECT_NEAR(distance(start + part->leave * d), 2.5, 1e-9);
    EXPECT_LT(distance(start + (part->enter + part->leave) / 2 * d), 2.5);
  }
  EXPECT_GT(met, 50);
  EXPECT_LT(met, 200);
}

TEST(PushedShape, a_mesh_is_met_as_the_shape_it_is) {
  const test::Folder folder;
  const auto file = folder.path("mesh.ply");
  surface::write_ply(file, patches::box({-4, -4, 18}, {4, 4, 22}));
  const Instrument mesh{scene::ClosedMesh{file}, {0, 0, -10}};
  const Instrument box{scene::Box{{0, 0, 20}, {8, 8, 4}}, {0, 0, -10}};
  for (const Vec3& p : {Vec3(3, -3, 11), Vec3(1, 2, 9), Vec3(1, 2, 14), Vec3(0.5, 0.1, 17)})
    EXPECT_NEAR(along(mesh, p)->leave, along(box, p)->leave, 1e-9);
  EXPECT_FALSE(along(mesh, {5, 0, 11}));
  EXPECT_FALSE(along(mesh, {0, 0, 7})) << "ahead of it";
}

scene::Scene pressed(const Instrument& instrument) {
  scene::Scene scene = patches::scene_of(3, {"bone"});
  scene.instruments = {instrument};
  return scene;
}

const surface::Surface flat_bone = patches::box({-30, -30, -25}, {130, 130, -10});

TEST(Instruments, hold_the_skin_where_the_push_ends) {
  const Vec3 push(0, 0, -4);
  const BuiltModel built = build_model(pressed({scene::Sphere{{30, 30, 10}, 9}, push}),
                                       patches::square(12, 60), {flat_bone});
  const Points& points = built.model.points;
  ASSERT_EQ(built.held.size(), 1u);
  EXPECT_GT(built.held[0].size(), 3u);
  EXPECT_EQ(count(built.model).held, static_cast<int64_t>(built.held[0].size()));
  for (const int64_t i : built.held[0]) {
    EXPECT_EQ(points.layer[i], 0);
    EXPECT_EQ(points.set[i], PointSet::held);
    EXPECT_NEAR((points.target[i] - Vec3(30, 30, 6)).norm(), 9, 1e-9) << "on the ball";
    EXPECT_LT((points.target[i] - points.position[i]).head<2>().norm(), 1e-9) << "along the push";
    EXPECT_LT(points.target[i].z(), points.position[i].z());
  }
  for (size_t i = 0; i < points.position.size(); ++i)
    EXPECT_FALSE(points.layer[i] == 0 && points.set[i] == PointSet::soft_tissue &&
                 (points.position[i] - Vec3(30, 30, 6)).norm() < 9)
        << "left inside";
  EXPECT_NO_THROW(validate(built.model, "built"));
}

/// A small ball that goes deeper than its own size takes along what it meets on its way.
TEST(Instruments, points_swept_over_are_not_lost) {
  const BuiltModel built =
      build_model(pressed({scene::Sphere{{30, 30, 7}, 5.5}, {0, 0, -20}}), patches::square(12, 60),
                  {patches::box({-30, -30, -45}, {130, 130, -29})});
  for (const int64_t i : built.held[0])
    EXPECT_NEAR((built.model.points.target[i] - Vec3(30, 30, -13)).norm(), 5.5, 1e-9);
}

TEST(Instruments, refusals_name_the_instrument) {
  const auto refused = [](const Instrument& instrument) -> std::string {
    try {
      build_model(pressed(instrument), patches::square(12, 60), {flat_bone});
    } catch (const base::InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(refused({scene::Sphere{{30, 30, 50}, 5}, {0, 0, -4}})
                .find("scene.yaml: instruments[0]: it reaches no free point of the skin"),
            std::string::npos);
  EXPECT_NE(refused({scene::Sphere{{30, 30, 50}, 5}, {0, 0, 4}}).find("reaches no free point"),
            std::string::npos)
      << "it leaves the skin behind";
  EXPECT_NE(refused({scene::HalfSpace{{0, 0, 5}, {0, 0, 1}}, {0, 0, -4}}).find("half-space"),
            std::string::npos);
}

}  // namespace instruments_test
}  // namespace repose::model
