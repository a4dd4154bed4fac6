#include "repose/tools/phantom/phantom.h"

#include <algorithm>
#include <cmath>

#include "phantom_shape.h"
#include "repose/base/error.h"

namespace repose::tools::phantom {
using namespace surface;
namespace {

using Distance = double (*)(const Vec3&);

/// Where a point first meets a solid on its way along a direction, by sphere tracing.
Vec3 first_met(Distance distance, Vec3 point, const Vec3& direction) {
  const Vec3 step = direction.normalized();
  double left = distance(point);
  while (left > 1e-9) {
    point += 0.8 * left * step;
    left = distance(point);
  }
  return point;
}

struct Probe {
  const char* name;
  Distance solid;
  Vec3 from, direction;
};

/// Landmarks as a person would take them, each found by a straight probe.
std::map<std::string, Vec3> landmarks() {
  const Vec3 back(0, 1, 0), up(0, 0, 1), down(0, 0, -1), left(1, 0, 0), right(-1, 0, 0);
  const std::vector<Probe> probes{
      {"glabella_soft", skin_distance, {0, -200, 60}, back},
      {"nasion_soft", skin_distance, {0, -200, 47}, back},
      {"pronasale", skin_distance, {0, -200, 15.5}, back},
      {"subnasale", skin_distance, {0, -200, -4}, back},
      {"upper_lip", skin_distance, {0, -200, -15.6}, back},
      {"lower_lip", skin_distance, {0, -200, -30.5}, back},
      {"pogonion_soft", skin_distance, {0, -200, -61}, back},
      {"menton_soft", skin_distance, {0, -80, -200}, up},
      {"nasion_bone", skull_distance, {0, -200, 52}, back},
      {"upper_incisor_edge", skull_distance, {3.9, -85.4, -60}, up},
      {"orbitale_right", skull_distance, {-30, -76, 44}, down},
      {"orbitale_left", skull_distance, {30, -76, 44}, down},
      {"zygion_right", skull_distance, {-120, -30, 15.5}, left},
      {"zygion_left", skull_distance, {120, -30, 15.5}, right},
      {"lower_incisor_edge", mandible_distance, {3.1, -84, 20}, down},
      {"pogonion_bone", mandible_distance, {0, -200, -62}, back},
      {"menton_bone", mandible_distance, {0, -83, -200}, up},
      {"gonion_right", mandible_distance, {-44, 40, -102}, {0, -1, 1}},
      {"gonion_left", mandible_distance, {44, 40, -102}, {0, -1, 1}},
      {"condyle_right_lateral_pole", mandible_distance, {-80, 0, 0}, left},
      {"condyle_left_lateral_pole", mandible_distance, {80, 0, 0}, right},
      {"coronoid_right_tip", mandible_distance, {-46, -36, 30}, down},
      {"coronoid_left_tip", mandible_distance, {46, -36, 30}, down}};
  std::map<std::string, Vec3> result{{"condyle_right_center", {-50, 0, 0}},
                                     {"condyle_left_center", {50, 0, 0}}};
  for (const Probe& probe : probes)
    result[probe.name] = first_met(probe.solid, probe.from, probe.direction);
  return result;
}

/// The skin's mean edge, mm: 9.8 at the paper's 477 vertices.
double skin_edge(int64_t vertices) {
  return 9.8 * std::sqrt(phantom_vertices_min / static_cast<double>(vertices));
}

}  // namespace

Phantom make_phantom(const PhantomOptions& options) {
  Phantom phantom;
  phantom.skin = make_phantom_skin(options.skin_vertices);
  const double edge = options.bone_edge != 0
                          ? options.bone_edge
                          : std::clamp(skin_edge(options.skin_vertices), 1.0, 5.0);
  phantom.skull = make_phantom_skull(edge);
  phantom.mandible = make_phantom_mandible(edge);
  phantom.landmarks = landmarks();
  return phantom;
}

}  // namespace repose::tools::phantom
