#include "repose/mechanics/cut_face_contact.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

/// Contact's derivatives by Taylor expansions, before, at and after touch; what is left out of
/// looking.
namespace repose::mechanics {
namespace contact_test {

std::vector<Vec3> random_points(int count, double size, int seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> within(-size, size);
  std::vector<Vec3> points(count);
  for (Vec3& p : points)
    for (double& x : p) x = within(random);
  return points;
}

/// Where bodies have gone.
const Mat3 turn = Eigen::AngleAxisd(0.8, Vec3(1, 2, -1).normalized()).toRotationMatrix();
const Vec3 shift(3, -4, 1);
Vec3 gone(const Vec3& at) { return turn * at + shift; }

/// Points at `distance` mm from a capsule and a ball that have moved, on all sides.
struct Touching {
  BodyContact loop;
  std::vector<Vec3> position;
};
Touching touching(double distance, model::Binding binding) {
  std::vector<RigidBody> bodies = {
      RigidBody(scene::Capsule{{0, 0, 0}, {4, 1, 0}, 3}, -1, Vec3::Zero()),
      RigidBody(scene::Sphere{{30, 0, 0}, 2.5}, -1, Vec3::Zero())};
  for (RigidBody& body : bodies) body.place(turn, shift);
  model::ContactPairs pairs;
  Touching made;
  for (const Vec3& direction : random_points(20, 1, 7))
    for (int32_t b = 0; b < 2; ++b) {
      Vec3 at = gone(b == 0 ? Vec3(2, 0.5, 0) : Vec3(30, 0, 0)) + 9 * direction.normalized();
      for (int n = 0; n < 50; ++n) {
        const surface::Distance d = bodies[b].distance(bodies[b].beside(at));
        at -= (d.value - distance) * d.gradient;
      }
      pairs.point.push_back(static_cast<int64_t>(made.position.size()));
      pairs.body.push_back(b);
      pairs.binding.push_back(binding);
      pairs.area.push_back(1.5 + direction.x());
      pairs.offset.push_back(0);
      made.position.push_back(at);
    }
  made.loop = BodyContact(pairs, 0.7, bodies);
  return made;
}

template <class Value, class Blocks>
void expect_taylor(const std::vector<Vec3>& position, Value&& value, Blocks&& blocks) {
  const std::vector<Vec3> direction = random_points(static_cast<int>(position.size()), 1, 9);
  const auto at = [&](double step) {
    std::vector<Vec3> moved = position;
    for (size_t i = 0; i < moved.size(); ++i) moved[i] += step * direction[i];
    return moved;
  };
  std::vector<Vec3> gradient(position.size(), Vec3::Zero());
  const double start = value(position, gradient);
  double slope = 0;
  for (size_t i = 0; i < direction.size(); ++i) slope += gradient[i].dot(direction[i]);
  const double bend = blocks(direction);
  double first = 0, last = 0;
  for (const double step : {1e-3, 1e-4}) {
    std::vector<Vec3> unused(position.size(), Vec3::Zero());
    const double left = value(at(step), unused) - start - step * slope - step * step / 2 * bend;
    (step == 1e-3 ? first : last) = std::abs(left);
  }
  const double rounding = 1e-13 * (1 + std::abs(start));
  EXPECT_LE(last, 5e-3 * first + rounding) << first << " " << last;
}

TEST(TouchDerivatives, AreThoseOfTheValueBeforeAtAndAfterTouch) {
  for (const auto binding : {model::Binding::touches, model::Binding::slides})
    for (const double distance : {0.5, -0.05, -1.0}) {
      SCOPED_TRACE(distance);
      Touching made = touching(distance, binding);
      const std::vector<double> p(made.position.size(), 0.02);
      made.loop.set_multipliers(p);
      expect_taylor(
          made.position,
          [&](std::span<const Vec3> x, std::span<Vec3> g) {
            return made.loop.add_gradient(x, 1, g);
          },
          [&](const std::vector<Vec3>& direction) {
            made.loop.update_gaps(made.position);
            double sum = 0;
            made.loop.for_each_block(true, [&](int64_t i, const Mat3& block) {
              sum += direction[i].dot(block * direction[i]);
            });
            return sum;
          });
    }
}

TEST(BodyContact, PressesWithoutAJumpOfEnergy) {
  constexpr double multiplier = 0.02, stiffness = 0.7, step = 1e-6;
  double value[2];
  for (const int after : {0, 1}) {
    Touching made =
        touching(multiplier / stiffness + (after ? -step : step), model::Binding::touches);
    made.loop.set_multipliers(std::vector<double>(made.position.size(), multiplier));
    std::vector<Vec3> gradient(made.position.size(), Vec3::Zero());
    value[after] = made.loop.add_gradient(made.position, 1, gradient);
    EXPECT_EQ(gradient[0].norm() > 0, after == 1);
  }
  EXPECT_NEAR(value[0], value[1], 1e-9);
}

/// A box of 12 triangles.
surface::Surface box(const Vec3& half) {
  surface::Surface s{"box", {}, {}};
  for (int k = 0; k < 8; ++k)
    s.points.push_back(half.cwiseProduct(Vec3(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1)));
  s.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                 {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return s;
}

/// The first points and the first body, 1 mm² each.
model::ContactPairs pairs_of(int64_t count, double offset = 0) {
  model::ContactPairs pairs;
  for (int64_t p = 0; p < count; ++p) pairs.point.push_back(p);
  pairs.body.assign(count, 0);
  pairs.binding.assign(count, model::Binding::touches);
  pairs.area.assign(count, 1);
  pairs.offset.assign(count, offset);
  return pairs;
}

TEST(BodyContact, LeavesOutNothingThatActsOnAMeshWhereverPointsMove) {
  constexpr double stiffness = 0.7;
  const RigidBody body(surface::DistanceField(box({5, 4, 3}), 0.5, 6), -1, Vec3::Zero());
  std::vector<Vec3> position = random_points(300, 9, 11);
  const auto count = static_cast<int64_t>(position.size());
  std::vector<double> multiplier;
  for (const Vec3& p : random_points(static_cast<int>(count), 0.3, 2))
    multiplier.push_back(std::max(0.0, p.x()));
  BodyContact loop(pairs_of(count), stiffness, {body});
  loop.set_multipliers(multiplier);
  for (int step = 0; step < 8; ++step) {
    std::vector<Vec3> gradient(count, Vec3::Zero());
    loop.add_gradient(position, 1, gradient);
    int acting = 0;
    for (int64_t p = 0; p < count; ++p) {
      const surface::Distance d = body.distance(position[p]);
      const double pressure = std::max(0.0, multiplier[p] - stiffness * d.value);
      acting += pressure > 0;
      ASSERT_LT((gradient[p] + pressure * d.gradient).norm(), 1e-12) << step << " " << p;
    }
    EXPECT_GT(acting, 20);
    const std::vector<Vec3> direction = random_points(static_cast<int>(count), 1, 20 + step);
    for (int64_t p = 0; p < count; ++p) position[p] += 0.6 * direction[p];
  }
}

TEST(BodyContact, StatesDistancesBeyondAMillimeterExactly) {
  const RigidBody body(surface::DistanceField(box({5, 4, 3}), 0.5, 6), -1, Vec3::Zero());
  const std::vector<Vec3> position = {{7, 6, 0}, {5.2, 0, 0}, {40, 0, 0}};
  BodyContact loop(pairs_of(3), 0.7, {body});
  loop.update_all_gaps(position);
  EXPECT_NEAR(loop.gaps()[0], std::sqrt(8.0), 1e-12);
  EXPECT_NEAR(loop.gaps()[1], 0.2, 1e-6);
  EXPECT_EQ(loop.gaps()[2], 6);
}

/// Halves every triangle at its first edge.
surface::Surface halved(const surface::Surface& mesh) {
  surface::Surface result{mesh.name, mesh.points, {}};
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto middle = std::ssize(result.points);
    result.points.push_back((result.points[a] + result.points[b]) / 2);
    result.triangles.push_back({c, a, middle});
    result.triangles.push_back({b, c, middle});
  }
  return result;
}

TEST(RigidBody, DepthDoesNotDependOnTriangles) {
  for (const Vec3& half : {Vec3(7, 7, 7), Vec3(20, 1.5, 1.5), Vec3(30, 0.8, 20)}) {
    surface::Surface mesh = box(half);
    for (int k = 0; k < 3; ++k, mesh = halved(halved(mesh))) {
      const RigidBody body(surface::DistanceField(mesh, 0.5, 6), -1, Vec3::Zero());
      EXPECT_NEAR(body.deepest(10), half.minCoeff(), 0.2);  // the spline is rounded
      EXPECT_EQ(body.deepest(0.3), 0.3);
    }
  }
}

TEST(BodyContact, MeasuresPointsThatBeganDeepInsideAMeshFromTheSideTheyAreOn) {
  constexpr double began = -2.5;  // mm
  const RigidBody body(surface::DistanceField(box({5, 4, 3}), 0.5, 6), -1, Vec3::Zero());
  const std::vector<Vec3> position = {{4.8, 0, 0}, {5, 0, 0}, {6, 0, 0}};
  BodyContact all(pairs_of(3, began), 0.7, {body}), near = all;
  all.update_all_gaps(position);
  const std::vector<LinearGap> gaps = near.linear_gaps(position, 5, 1);
  ASSERT_EQ(gaps.size(), position.size());
  for (size_t c = 0; c < gaps.size(); ++c) {
    const double expected = position[c].x() - 5 - began;
    EXPECT_NEAR(all.gaps()[c], expected, 1e-6);
    EXPECT_NEAR(gaps[c].gap, expected, 1e-6);
    EXPECT_LT((all.normal(c) - Vec3::UnitX()).norm(), 1e-6);
    EXPECT_LT((gaps[c].gradient[0].second - Vec3::UnitX()).norm(), 1e-6);
  }
}

/// Two sides of a bent cut, 5 × 4 controls of which the first and the last of a column are means of
/// two points, the first side `distance` mm from the second and slid along it by more than a patch.
struct Facing {
  model::CutFaces cut_faces;
  std::vector<Vec3> position;
};
Facing facing(double distance) {
  Facing made;
  made.cut_faces.size = {{5, 4}};
  made.cut_faces.begin = {0};
  const std::vector<Vec3> noise = random_points(80, 0.05, 3);
  for (int side = 0; side < 2; ++side)
    for (int i = 0; i < 5; ++i)
      for (int j = 0; j < 4; ++j) {
        const bool wrap = j == 0 || j == 3;
        for (int k = 0; k < (wrap ? 2 : 1); ++k) {
          const double u = 3 * i + (side == 0 ? 3.7 : 0), v = 3 * j + (side == 0 ? 0.8 : 0);
          made.cut_faces.point.push_back(static_cast<int64_t>(made.position.size()));
          made.cut_faces.weight.push_back(wrap ? 0.5 : 1);
          made.position.push_back(Vec3(u, v + 0.2 * k, 0.02 * u * u - 0.03 * v * v + 0.4 * k) +
                                  (side == 0 ? distance : 0) * Vec3::UnitZ() +
                                  noise[made.position.size()]);
        }
        made.cut_faces.begin.push_back(static_cast<int64_t>(made.cut_faces.point.size()));
        if (side == 0) made.cut_faces.area.push_back(wrap ? 0 : 2 + i);
      }
  return made;
}

TEST(WallDerivatives, AreThoseOfTheValueBeforeAtAndAfterTouch) {
  for (const double distance : {0.8, 0.0, -0.9}) {
    SCOPED_TRACE(distance);
    const Facing made = facing(distance);
    CutFaceContact loop(made.cut_faces, 0.7);
    EXPECT_EQ(loop.size(), 10u);
    loop.set_multipliers(std::vector<double>(loop.size(), 1.5));
    loop.update_gaps(made.position);
    int acting = 0;
    for (size_t w = 0; w < loop.size(); ++w) acting += loop.pressure(w) > 0 ? 1 : 0;
    EXPECT_GE(acting, 6);
    expect_taylor(
        made.position,
        [&](std::span<const Vec3> x, std::span<Vec3> g) { return loop.add_gradient(x, 1, g); },
        [&](const std::vector<Vec3>& direction) {
          double sum = 0;
          loop.update_gaps(made.position);
          loop.for_each_block(true, [&](int32_t p, int32_t q, const Mat3& block) {
            sum += (p == q ? 1 : 2) * direction[p].dot(block * direction[q]);
          });
          return sum;
        });
  }
}

// The surface is a thin lip, bent round its edge at y = 0.
TEST(CutFaceContact, MeasuresGapsFromTheNearestFootOfASurfaceBentRoundAnEdge) {
  constexpr int columns = 8, rows = 6;
  constexpr double y[] = {7, 1, 0, 4, 8, 12}, z[] = {-1, -0.1, 0, 0.6, 1.2, 1.8};
  const std::vector<Vec3> near = random_points(columns * rows, 1, 5);
  model::CutFaces sides{{{columns, rows}}, {0}, {}, {}, std::vector<double>(columns * rows, 1)};
  std::vector<Vec3> position;
  for (int c = 0; c < 2 * columns * rows; ++c) {
    const int row = c % rows;
    sides.point.push_back(c);
    sides.weight.push_back(1);
    sides.begin.push_back(c + 1);
    position.push_back(c < columns * rows ? Vec3(10, 4, 0) + near[c].cwiseProduct(Vec3(8, 8, 1.5))
                                          : Vec3(3 * (c / rows - columns), y[row], z[row]));
  }
  CutFaceContact contact(sides, 1);
  contact.update_gaps(position);
  const auto mean = [&](double i, double j, size_t first) {
    const SplineWeights along = spline_weights(i, columns), inwards = spline_weights(j, rows);
    Vec3 sum = Vec3::Zero();
    for (int k = 0; k < along.count; ++k)
      for (int l = 0; l < inwards.count; ++l)
        sum += along.of[0][k] * inwards.of[0][l] *
               position[first + (along.first + k) * rows + inwards.first + l];
    return sum;
  };
  for (int w = 0; w < columns * rows; ++w) {
    const Vec3 place = mean(w / rows, w % rows, 0);
    double nearest = std::numeric_limits<double>::infinity();
    for (double i = -1; i <= columns; i += 0.05)
      for (double j = 0; j <= rows - 1; j += 0.05)
        nearest = std::min(nearest, (mean(i, j, columns * rows) - place).norm());
    EXPECT_LE(std::abs(contact.gap(w)), nearest + 1e-6);
  }
}

TEST(CutFaceContact, MeetsNothingBeyondItsLastRows) {
  constexpr int columns = 4, rows = 4;
  for (const double beyond : {-0.6, 0.6}) {
    model::CutFaces sides{{{columns, rows}}, {0}, {}, {}, {}};
    std::vector<Vec3> position;
    for (int c = 0; c < 2 * columns * rows; ++c) {
      const int column = c / rows % columns, row = c % rows;
      const bool first = c < columns * rows;
      sides.point.push_back(c);
      sides.weight.push_back(1);
      sides.begin.push_back(c + 1);
      position.push_back(first ? Vec3(2 * column, 2 * (rows - 1) + beyond, -0.8)
                               : Vec3(2 * column, 2 * row, 0));
      if (first) sides.area.push_back(row == 1 ? 1 : 0);
    }
    CutFaceContact contact(sides, 1);
    contact.update_gaps(position);
    ASSERT_EQ(contact.size(), columns);
    for (int w = 0; w < columns; ++w) {
      EXPECT_NEAR(contact.gap(w), beyond < 0 ? -0.8 : 1, 1e-9);
      EXPECT_NEAR(contact.pressure(w), beyond < 0 ? 0.8 : 0, 1e-9);
    }
  }
}

/// Expects that gaps change along a direction as their gradients say.
template <class Gaps>
void expect_linear(const std::vector<Vec3>& position, Gaps&& gaps) {
  constexpr double step = 1e-5;
  const std::vector<Vec3> direction = random_points(static_cast<int>(position.size()), 1, 9);
  std::vector<Vec3> moved = position;
  for (size_t i = 0; i < moved.size(); ++i) moved[i] += step * direction[i];
  const std::vector<LinearGap> before = gaps(position), after = gaps(moved);
  ASSERT_EQ(before.size(), after.size());
  ASSERT_GE(before.size(), 6u);
  for (size_t k = 0; k < before.size(); ++k) {
    double slope = 0;
    for (const auto& [p, gradient] : before[k].gradient) slope += gradient.dot(direction[p]);
    EXPECT_NEAR((after[k].gap - before[k].gap) / step, slope, 1e-4);
  }
}

TEST(LinearGap, HasTheGradientOfTheGap) {
  Touching made = touching(0.4, model::Binding::touches);
  expect_linear(made.position,
                [&](const std::vector<Vec3>& x) { return made.loop.linear_gaps(x, 5); });
  const Facing sides = facing(0.3);
  CutFaceContact loop(sides.cut_faces, 0.7);
  expect_linear(sides.position, [&](const std::vector<Vec3>& x) {
    loop.update_gaps(x);
    return loop.linear_gaps(5);
  });
}

TEST(LinearGap, GoesWithABodyThatMoves) {
  Touching made = touching(0.4, model::Binding::touches);
  std::vector<LinearGap> gaps = made.loop.linear_gaps(made.position, 5);
  const Mat3 further = Eigen::AngleAxisd(0.3, Vec3(0, 1, 1).normalized()).toRotationMatrix();
  const std::vector<RigidBody> before = made.loop.bodies();
  for (RigidBody& body : made.loop.bodies()) body.place(further * turn, further * shift);
  made.loop.carry(made.position, before, gaps);
  for (const LinearGap& gap : gaps) {
    const auto& [p, normal] = gap.gradient.front();
    const Vec3 beside =
        further * made.position[p];  // where the point would have gone with its body
    EXPECT_NEAR(gap.gap, 0.4 + normal.dot(made.position[p] - beside), 1e-9);
  }
}

/// A point that presses on the top of a box that has moved, so far from its edge, mm.
struct AtEdge {
  BodyContact loop;
  std::vector<Vec3> position;
};
AtEdge pressing_on_box(double from_edge) {
  RigidBody box(scene::Box{{0, 0, 0}, {10, 8, 6}}, -1, Vec3::Zero());
  box.place(turn, shift);
  model::ContactPairs pairs;
  pairs.point = {0}, pairs.body = {0}, pairs.area = {2}, pairs.offset = {0};
  pairs.binding = {model::Binding::touches};
  AtEdge made{BodyContact(pairs, 0.7, {box}), {gone(Vec3(5 - from_edge, 0, 3.01))}};
  made.loop.set_multipliers(std::vector{0.1});
  made.loop.update_gaps(made.position);
  return made;
}

TEST(BodyContact, FindsTheSidesRoundTheEdgeThatAPointPressesNear) {
  const AtEdge near = pressing_on_box(0.7);
  const std::vector<LinearGap> sides = near.loop.other_sides(near.position);
  ASSERT_FALSE(sides.empty());
  for (const LinearGap& side : sides) {
    const auto& [point, normal] = side.gradient.front();
    EXPECT_EQ(point, 0);
    EXPECT_LT(normal.dot(turn * Vec3::UnitZ()), 0.5);
    double beyond = -1e9;  // of the box, along the normal from the point
    for (const double x : {-5, 5})
      for (const double y : {-4, 4})
        for (const double z : {-3, 3})
          beyond = std::max(beyond, normal.dot(gone(Vec3(x, y, z)) - near.position[0]));
    EXPECT_NEAR(side.gap, -beyond, 1e-12) << "a plane that touches the box";
  }
  EXPECT_GE(std::ranges::max_element(sides, {}, &LinearGap::gap)->gap, -0.7);
  const AtEdge far = pressing_on_box(3.5);
  EXPECT_TRUE(far.loop.other_sides(far.position).empty());
  AtEdge free = pressing_on_box(0.7);
  free.loop.set_multipliers(std::vector{0.0});
  EXPECT_TRUE(free.loop.other_sides(free.position).empty());
}

TEST(SplineWeights, ReproduceStraightLinesAndGoOnStraight) {
  for (const int controls : {2, 3, 4, 7})
    for (double at = -1; at <= controls; at += 0.37) {
      const SplineWeights weights = spline_weights(at, controls);
      double place = 0, slope = 0, bend = 0;
      for (int k = 0; k < weights.count; ++k) {
        place += weights.of[0][k] * (3 + 2 * (weights.first + k));
        slope += weights.of[1][k] * (3 + 2 * (weights.first + k));
        bend += weights.of[2][k] * (3 + 2 * (weights.first + k));
      }
      EXPECT_NEAR(place, 3 + 2 * at, 1e-12);
      EXPECT_NEAR(slope, 2, 1e-12);
      EXPECT_NEAR(bend, 0, 1e-12);
    }
}

TEST(BodyContact, LooksAgainAsSoonAsAPointMayHaveComeNear) {
  Touching made = touching(4.0, model::Binding::touches);
  std::vector<Vec3> gradient(made.position.size(), Vec3::Zero());
  EXPECT_EQ(made.loop.add_gradient(made.position, 1, gradient), 0);
  for (size_t i = 0; i < made.position.size(); ++i)
    made.position[i] = gone(i % 2 == 0 ? Vec3(2, 0.5, 2.9) : Vec3(30, 0, 2.4));
  EXPECT_GT(made.loop.add_gradient(made.position, 1, gradient), 0);
  Touching fresh = touching(4.0, model::Binding::touches);
  EXPECT_DOUBLE_EQ(made.loop.add_gradient(made.position, 1, gradient),
                   fresh.loop.add_gradient(made.position, 1, gradient));
}

}  // namespace contact_test
}  // namespace repose::mechanics
