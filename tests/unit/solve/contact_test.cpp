#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>

#include "model/add_contact.h"
#include "repose/model/cut.h"
#include "rest.h"
#include "solid_block.h"

/// Contact solved: closed forms.
namespace repose {
namespace contact_test {

using model::Binding;
using model::PointSet;
using testing::Rest;
using testing::settings;
using testing::solid_block;

constexpr double young = 0.015, poisson = 0.45;  // of solid_block

const std::vector<double>& field(const Rest& rest, const char* name) {
  for (const model::PointField& field : rest.rows.point_fields)
    if (field.name == name) return field.values;
  throw std::runtime_error(std::string(name) + " is missing");
}

/// The area that each point of a block stands for on the face whose points lie in a plane.
std::vector<double> face_areas(const model::Model& m, const Vec3& normal, double offset) {
  std::vector<double> area(m.points.position.size(), 0.0);
  for (const auto& prism : m.prisms.points) {
    std::vector<std::vector<int>> faces = {{0, 1, 2}, {3, 4, 5}};
    for (int k = 0; k < 3; ++k) faces.push_back({k, (k + 1) % 3, 3 + (k + 1) % 3, 3 + k});
    for (const auto& face : faces) {
      std::vector<Vec3> x;
      for (const int c : face) x.push_back(m.points.position[prism[c]]);
      bool on = true;
      for (const Vec3& at : x) on = on && std::abs(at.dot(normal) - offset) < 1e-9;
      if (!on) continue;
      const double whole = face.size() == 3 ? (x[1] - x[0]).cross(x[2] - x[0]).norm() / 2
                                            : (x[1] - x[0]).cross(x[3] - x[0]).norm();
      for (const int c : face) area[prism[c]] += whole / static_cast<double>(face.size());
    }
  }
  return area;
}

/// Binds the points of a face to a body.
void bind_face(model::Model& m, model::Body body, Binding binding,
               const std::vector<double>& area) {
  const auto row = static_cast<int32_t>(m.contact.bodies.size());
  m.contact.bodies.push_back(std::move(body));
  for (size_t i = 0; i < area.size(); ++i) {
    if (area[i] == 0 || m.points.set[i] != PointSet::soft_tissue) continue;
    m.contact.pairs.point.push_back(static_cast<int64_t>(i));
    m.contact.pairs.body.push_back(row);
    m.contact.pairs.binding.push_back(binding);
    m.contact.pairs.area.push_back(area[i]);
  }
  m.contact.stiffness = 0.05;
}

model::Body plane(const Vec3& point, const Vec3& normal, const Vec3& push = Vec3::Zero()) {
  return {"plane", -1, scene::HalfSpace{point, normal}, push};
}

TEST(Contact, APlateThatPressesAConfinedBlockMeetsTheSamePressureEverywhere) {
  model::Model m = solid_block(5, 4, 4, poisson, 0, [](int, int, int a) {
    return a == 3 ? PointSet::boundary : PointSet::soft_tissue;
  });
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  const auto wall = [&](const Vec3& normal, double at, Binding binding, const Vec3& push) {
    bind_face(m, plane(at * normal, -normal, push), binding, face_areas(m, normal, at));
  };
  wall(-x, 0, Binding::slides, Vec3::Zero());
  wall(x, 20, Binding::slides, Vec3::Zero());
  wall(-y, 0, Binding::slides, Vec3::Zero());
  wall(y, 15, Binding::slides, Vec3::Zero());
  wall(z, 0, Binding::touches, {0, 0, -1.8});
  const Rest rest = testing::find_rest(m, settings(1e-6));
  EXPECT_TRUE(rest.summary.path.complete()) << rest.summary.last.reason;
  const model::Moduli moduli = model::moduli({young, poisson});
  const double stretch = 1 - 1.8 / 9;
  const double pressure = (moduli.shear + moduli.volume) * (1 - stretch);
  const std::vector<double> top = face_areas(m, z, 0);
  const std::vector<double>& force = field(rest, "contact_force");
  double whole = 0;
  for (size_t i = 0; i < top.size(); ++i) {
    const Vec3 at = m.points.position[i];
    EXPECT_LE((rest.rows.position[i] - Vec3(at.x(), at.y(), at.z() - (1 - stretch) * (at.z() + 9)))
                  .norm(),
              2e-6);
    if (top[i] == 0) continue;
    EXPECT_NEAR(-force[3 * i + 2] / top[i], pressure, 1e-5 * pressure);
    whole -= force[3 * i + 2];
  }
  EXPECT_NEAR(whole, pressure * 300, 1e-5 * pressure * 300);
  EXPECT_LE(rest.summary.last.penetration, 1e-6);
}

TEST(Contact, ARunStoppedInItsLastPassReportsTheStateItReached) {
  model::Model m = solid_block(5, 4, 4, poisson, 0, [](int, int, int a) {
    return a == 3 ? PointSet::boundary : PointSet::soft_tissue;
  });
  const Vec3 z = Vec3::UnitZ();
  bind_face(m, plane(Vec3::Zero(), -z, {0, 0, -1.8}), Binding::touches, face_areas(m, z, 0));
  solve::Settings stopped = settings(1e-6);
  stopped.path.load_steps = 3;
  double now = 0;
  stopped.on_iterate = [&](double load, const solve::StateSnapshot&) { now = load; };
  stopped.abandoned = [&] { return now == 1; };
  const Rest rest = testing::find_rest(m, stopped);
  EXPECT_NEAR(rest.summary.path.load, 2.0 / 3, 1e-12);
  EXPECT_TRUE(rest.summary.path.last.stopped);
  EXPECT_FALSE(rest.summary.path.complete());
  const std::vector<double>& force = field(rest, "contact_force");
  double whole = 0;
  for (size_t i = 0; i < m.points.position.size(); ++i) whole -= force[3 * i + 2];
  EXPECT_GT(whole, 0.1);
  EXPECT_NEAR(rest.summary.contacts[0].force.z(), whole, 1e-3 * whole);
}

// A penalty 80 times softer than the tissue leaves 80/81 of the gap after each round.
TEST(Contact, APenaltyThatIsFarTooSoftIsStiffened) {
  model::Model m = solid_block(4, 4, 4, 0, 0, [](int, int, int a) {
    return a == 3 ? PointSet::boundary : PointSet::soft_tissue;
  });
  const Vec3 z = Vec3::UnitZ();
  bind_face(m, plane(Vec3::Zero(), -z, {0, 0, -0.9}), Binding::touches, face_areas(m, z, 0));
  m.contact.stiffness = young / 9 / 80;
  const Rest rest = testing::find_rest(m, settings(0.1));
  EXPECT_TRUE(rest.summary.path.complete()) << rest.summary.last.reason;
  double deepest = 0;
  for (size_t i = 0; i < m.points.position.size(); ++i) {
    const double before = m.points.position[i].z(), now = rest.rows.position[i].z();
    EXPECT_NEAR(now, before - 0.1 * (before + 9), 0.1);
    if (before == 0) deepest = std::max(deepest, now + 0.9);
  }
  EXPECT_GT(deepest, 1e-4);
  EXPECT_LE(deepest, 0.1);
  EXPECT_NEAR(rest.summary.last.penetration, deepest, 1e-9);
}

TEST(Contact, TheEstimateHoldsWherePointsTouchTwoPlanes) {
  model::Model m = solid_block(4, 4, 4, poisson, 0, [](int, int, int a) {
    return a == 3 ? PointSet::boundary : PointSet::soft_tissue;
  });
  const std::vector<double> top = face_areas(m, Vec3::UnitZ(), 0);
  for (const double slope : {-0.6, 0.6}) {
    const Vec3 normal(slope, 0, -1), on(5, 5, 0);
    bind_face(m, plane(on, normal, {0, 0, -1.5}), Binding::touches, top);
  }
  const Rest exact = testing::find_rest(m, settings(1e-7));
  EXPECT_TRUE(exact.summary.path.complete()) << exact.summary.last.reason;
  for (const double accuracy : {0.1, 0.03, 0.01, 0.001}) {
    const Rest rest = testing::find_rest(m, settings(accuracy));
    EXPECT_TRUE(rest.summary.path.complete()) << rest.summary.last.reason;
    double error = 0;
    for (size_t i = 0; i < rest.rows.position.size(); ++i)
      error = std::max(error, (rest.rows.position[i] - exact.rows.position[i]).norm());
    EXPECT_LE(error, rest.summary.last.displacement_error + 1e-7) << accuracy;
  }
}

/// A block whose top is pressed down by 0.9 mm, and by a plane from below whose height is `below`,
/// mm.
Rest press(std::optional<double> below, double way, double accuracy) {
  model::Model m = solid_block(4, 4, 4, poisson, 0, [](int, int, int a) {
    return a == 3 ? PointSet::held : PointSet::soft_tissue;
  });
  const Vec3 z = Vec3::UnitZ();
  const std::vector<double> top = face_areas(m, z, 0);
  testing::aim(m, [&](const Vec3& x) -> Vec3 { return x + Vec3(way, 0, 0); });
  bind_face(m, plane(Vec3::Zero(), -z, {0, 0, -0.9}), Binding::touches, top);
  if (below) bind_face(m, plane(*below * z, z), Binding::touches, top);
  return testing::find_rest(m, settings(accuracy));
}

// The upper plane ends 0.6 mm below the lower one: no place is outside both.
TEST(Contact, PointsBetweenBodiesThatOverlapRestOnTheFirst) {
  for (const double way : {0.1, 0.0}) {  // mm; without one there is no path
    const Rest alone = press({}, way, 1e-4), between = press(-0.3, way, 1e-4);
    EXPECT_TRUE(alone.summary.path.complete());
    EXPECT_FALSE(between.summary.path.complete());
    EXPECT_EQ(between.summary.path.load, 1);
    EXPECT_EQ(between.summary.path.last.overlapped, 16);
    EXPECT_EQ(between.summary.last.reason, "points of tissue between bodies that overlap: 16");
    for (size_t i = 0; i < alone.rows.position.size(); ++i)
      EXPECT_LE((alone.rows.position[i] - between.rows.position[i]).norm(), 2e-4);
    EXPECT_NEAR(between.summary.last.penetration, 0.6, 1e-3);
  }
}

TEST(Contact, PointsBetweenBodiesThatOverlapByLessThanTheAccuracyAreNotAtRest) {
  const Rest between = press(-0.84, 0.1, 0.1);
  EXPECT_FALSE(between.summary.path.complete());
  EXPECT_EQ(between.summary.path.last.overlapped, 16);
}

// The plane ends 0.3 mm below the top of a narrow box. One point between them has a way out past
// the side of the box, which is 1.8 mm away.
TEST(Contact, APointBetweenBodiesThatOverlapLeavesRoundTheNearEdge) {
  model::Model m = solid_block(4, 4, 4, poisson, 0, [](int, int, int a) {
    return a == 3 ? PointSet::held : PointSet::soft_tissue;
  });
  testing::aim(m, [](const Vec3& x) -> Vec3 { return x + Vec3(0, 0.1, 0); });
  const std::vector<double> top = face_areas(m, Vec3::UnitZ(), 0);
  bind_face(m, plane(Vec3::Zero(), -Vec3::UnitZ(), {0, 0, -0.9}), Binding::touches, top);
  const scene::Box narrow{{5.6, 5, -1.8}, {4.8, 6, 2.4}};
  bind_face(m, {"box", -1, narrow, Vec3::Zero()}, Binding::touches, top);
  const Rest rest = testing::find_rest(m, settings(1e-4));
  EXPECT_TRUE(rest.summary.path.complete()) << rest.summary.last.reason;
  EXPECT_LE(rest.summary.last.penetration, 1e-4);
  for (size_t i = 0; i < rest.rows.position.size(); ++i)
    if (m.points.position[i].isApprox(Vec3(5, 5, 0))) {
      EXPECT_NEAR(rest.rows.position[i].x(), 3.2, 2e-4) << rest.rows.position[i].transpose();
      EXPECT_LE(rest.rows.position[i].z(), -0.9 + 1e-4);
    }
}

TEST(Contact, ABlockThatSlidesAlongAPlaneMeetsNoResistance) {
  model::Model m = solid_block(6, 5, 4, poisson, 0, [](int, int, int a) {
    return a == 0 ? PointSet::held : PointSet::soft_tissue;
  });
  testing::aim(m, [](const Vec3& x) -> Vec3 { return x + Vec3(4, 3, 0); });
  bind_face(m, plane({0, 0, -9}, {0, 0, 1}), Binding::slides, face_areas(m, Vec3::UnitZ(), -9));
  const Rest rest = testing::find_rest(m, settings(1e-6));
  EXPECT_TRUE(rest.summary.path.complete()) << rest.summary.last.reason;
  for (size_t i = 0; i < m.points.position.size(); ++i)
    EXPECT_LE((rest.rows.position[i] - m.points.position[i] - Vec3(4, 3, 0)).norm(), 2e-6);
}

/// Factor on Hertz's force from the bottom of a layer of thickness h, χ = √(R δ)/h (Dimitriadis,
/// Horkay, Maresca, Kachar & Chadwick 2002, Biophysical Journal 82, Eq. 12, bonded).
double thin_layer(double chi) {
  constexpr double nu = poisson, pi = std::numbers::pi;
  const double a = -(1.2876 - 1.4678 * nu + 1.3442 * nu * nu) / (1 - nu),
               b = (0.6387 - 1.0277 * nu + 1.5164 * nu * nu) / (1 - nu);
  return 1 - 2 * a / pi * chi + 4 * a * a / (pi * pi) * chi * chi -
         8 / std::pow(pi, 3) * (a * a * a + 4 * pi * pi / 15 * b) * std::pow(chi, 3) +
         16 * a / std::pow(pi, 4) * (a * a * a + 3 * pi * pi / 5 * b) * std::pow(chi, 4);
}

/// The force on a ball of radius R pressed by δ into a layer, over that of Hertz for it.
double over_hertz(int columns, int layers) {
  constexpr double radius = 100, depth = 1;
  model::Model m = solid_block(columns, columns, layers, poisson, 0, [&](int i, int j, int a) {
    const bool rim = i == 0 || j == 0 || i + 1 == columns || j + 1 == columns || a + 1 == layers;
    return rim ? PointSet::boundary : PointSet::soft_tissue;
  });
  const double middle = 5.0 * (columns - 1) / 2;
  bind_face(m, {"ball", -1, scene::Sphere{{middle, middle, radius}, radius}, Vec3(0, 0, -depth)},
            Binding::touches, face_areas(m, Vec3::UnitZ(), 0));
  const Rest rest = testing::find_rest(m, settings(1e-4));
  EXPECT_TRUE(rest.summary.path.complete()) << rest.summary.last.reason;
  const std::vector<double>& force = field(rest, "contact_force");
  double whole = 0;
  for (size_t i = 2; i < force.size(); i += 3) whole -= force[i];
  const double modulus = young / (1 - poisson * poisson);
  const double chi = std::sqrt(radius * depth) / (3.0 * (layers - 1));
  return whole / (4.0 / 3 * modulus * std::sqrt(radius) * std::pow(depth, 1.5) * thin_layer(chi));
}

TEST(Contact, ABallPressedIntoALayerMeetsHertzsForce) { EXPECT_NEAR(over_hertz(25, 16), 1, 0.05); }

// Euler's column: straight it is balanced, and only the curvature there tells that it is not at
// rest.
TEST(Contact, ASlenderColumnThatAPlatePressesBuckles) {
  constexpr int layers = 12;
  const auto aside = [&](double pressed) {
    model::Model m = solid_block(2, 2, layers, poisson, 0, [&](int, int, int a) {
      return a + 1 == layers ? PointSet::boundary : PointSet::soft_tissue;
    });
    const Vec3 z = Vec3::UnitZ();
    bind_face(m, plane(Vec3::Zero(), -z, {0, 0, -pressed}), Binding::touches, face_areas(m, z, 0));
    const Rest rest = testing::find_rest(m, settings(0.001));
    EXPECT_TRUE(rest.summary.path.complete()) << rest.summary.last.reason;
    return testing::farthest_aside(m, rest);
  };
  EXPECT_NEAR(aside(0.3), 0.8426, 0.002);
  EXPECT_NEAR(aside(2), 14.96, 0.01);
}

/// A block of 30 × 40 × 9 mm whose ends and bottom are held, cut along its middle but for its ends.
model::Model cut_block(bool cut) {
  model::Model m = solid_block(7, 9, 4, poisson, 0, [](int, int j, int a) {
    return j == 0 || j == 8 || a == 3 ? PointSet::held : PointSet::soft_tissue;
  });
  for (const auto& prism : m.prisms.points)
    for (const auto& t : {std::array{prism[0], prism[1], prism[2]}})
      if (m.points.layer[t[0]] == 0) m.skin.push_back({t[0], t[1], t[2]});
  if (!cut) return m;
  m.contact.stiffness = 0.05;
  model::Cut path{{}, 4, true};
  for (int i = 0; i < 7; ++i) path.columns.push_back(4 * 7 + i);
  std::vector<Vec3> skin(7 * 9);
  for (size_t p = 0; p < m.points.layer.size(); ++p)
    if (m.points.layer[p] == 0) skin[m.points.column[p]] = m.points.position[p];
  std::vector<Triangle> triangles = m.skin;
  for (Triangle& t : triangles)
    for (int64_t& corner : t) corner = m.points.column[corner];
  model::add_skin_around(skin, triangles, path);
  model::cut_along(path, m);
  return m;
}

// The triangles beside the cut are no mirror images, so that the whole block carries some shear
// there, which sides without friction do not, and edges of cuts are rounded by 0.17 mm.
TEST(Contact, TheSidesOfACutThatIsPressedTogetherCarryWhatTheWholeBlockCarries) {
  model::Model whole = cut_block(false), parted = cut_block(true);
  const auto press = [](const Vec3& x) -> Vec3 { return {x.x(), 0.95 * x.y() + 1, x.z()}; };
  testing::aim(whole, press);
  testing::aim(parted, press);
  const Rest one = testing::find_rest(whole, settings(1e-5));
  const Rest two = testing::find_rest(parted, settings(1e-3));
  EXPECT_TRUE(two.summary.path.complete()) << two.summary.last.reason;
  for (size_t i = 0; i < whole.points.position.size(); ++i) {
    const bool edge = whole.points.layer[i] == 0 && whole.points.position[i].y() == 20;
    EXPECT_LE((one.rows.position[i] - two.rows.position[i]).norm(),
              edge ? 0.21 : 0.065);  // of 1 mm
  }
  EXPECT_LE(two.summary.last.penetration, 1e-3);
  const std::vector<double>& force = field(two, "contact_force");
  Vec3 sum = Vec3::Zero();
  double pressed = 0;
  for (size_t i = 0; i < force.size(); i += 3) {
    sum += Vec3(force[i], force[i + 1], force[i + 2]);
    pressed += std::abs(force[i + 1]) / 2;
  }
  EXPECT_GT(pressed, 0.05);
  EXPECT_LE(sum.norm(), 1e-12 * pressed);
}

TEST(Contact, TheSidesOfACutThatIsPulledApartLetGo) {
  model::Model parted = cut_block(true);
  testing::aim(parted, [](const Vec3& x) -> Vec3 { return {x.x(), 1.1 * x.y() - 2, x.z()}; });
  const Rest rest = testing::find_rest(parted, settings(1e-3));
  EXPECT_TRUE(rest.summary.path.complete()) << rest.summary.last.reason;
  for (const double p : field(rest, "contact_pressure")) EXPECT_EQ(p, 0);
}

}  // namespace contact_test
}  // namespace repose
