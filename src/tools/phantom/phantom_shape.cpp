#include "phantom_shape.h"

#include <vector>

#include "phantom_solid.h"

namespace repose::tools::phantom {
namespace {

constexpr double joint_gap = 2.5;  // mm of clearance of the skull around the mandible
constexpr double min_tissue = 5;   // mm of skin over any bone

/// Teeth from the back to the midline: position on the arch and radius; `root` and `tip` in z.
void add_teeth(std::vector<Part>& parts, const std::vector<Bead>& arch, double root, double tip) {
  const double up = tip > root ? 1 : -1;
  for (const Bead& tooth : arch) {
    Vec3 a = tooth.center, b = tooth.center;
    a.z() = root;
    b.z() = tip - up * tooth.radius;
    parts.push_back(chain({{a, 0.8 * tooth.radius}, {b, tooth.radius}}, 1.0));
  }
}

std::vector<Part> mandible_parts() {
  const Bead gonion{{44, -17, -45}, 4}, notch{{47, -19, -13}, 4}, coronoid{{46, -36, 2}, 2.8};
  const Bead front{{39, -46, -40}, 4}, back{{48.5, -4, -12}, 4};
  const std::vector<Bead> lower{{{43.5, -18, -47}, 4.8}, {{38, -41, -53}, 4.8},
                                {{29, -60, -57}, 5},     {{18.5, -75, -60.5}, 5.4},
                                {{8, -81.5, -62}, 6},    {{0, -82.5, -62}, 6.2}};
  const std::vector<Bead> ridge{{{39, -44, -36}, 4.2},  {{30, -52, -34}, 4.8},
                                {{25, -65, -34}, 4.8},  {{17.5, -76, -34}, 4.4},
                                {{8, -81.8, -34}, 4.2}, {{0, -82.8, -34}, 4.2}};
  std::vector<Part> parts{
      ellipsoid({50, 0, 0}, {9.5, 5.5, 5}, 0),  // condyle
      chain({{{49.5, -1, -2}, 4}, back, gonion}, 3),
      sheet({back, gonion, notch, front, coronoid}, 4),  // ramus
      chain(lower, 5),
      chain(ridge, 4),
      sheet({lower[0], ridge[0], lower[1], ridge[1], lower[2], ridge[2], lower[3], ridge[3],
             lower[4], ridge[4], lower[5], ridge[5]},
            4),
  };
  parts.push_back(ellipsoid({0, -84.5, -62}, {12, 6, 7}, 8));  // mental protuberance
  add_teeth(parts,
            {{{29.5, -46, 0}, 4.6},
             {{27, -56.5, 0}, 4.8},
             {{24.2, -65.5, 0}, 3.6},
             {{20.8, -72.3, 0}, 3.5},
             {{15.7, -78.3, 0}, 3.4},
             {{9.5, -82.3, 0}, 2.9},
             {{3.1, -84.0, 0}, 2.9}},
            -33, -24.5);
  return parts;
}

std::vector<Part> cranium_parts() {
  return {
      ellipsoid({0, 8, 62}, {70, 92, 64}, 0),
      ellipsoid({0, 12, 18}, {56, 60, 22}, 12),              // base
      ellipsoid({52, 4, 18}, {13, 22, 13}, 8),               // temporal bone above the joint
      chain({{{52, 26, 8}, 9}, {{49, 23, -12}, 5}}, 6),      // mastoid
      ellipsoid({0, -35, 26}, {36, 36, 26}, 12),             // sphenoid
      chain({{{21, -40, -4}, 5}, {{22, -34, 18}, 8}}, 6),    // pterygoid
      chain({{{0, -80, 57}, 8}, {{28, -78, 60}, 6.5}}, 10),  // brow
      chain({{{28, -78, 60}, 6.5}, {{49, -66, 52}, 5.5}}, 6),
  };
}

void add_midface(std::vector<Part>& parts) {
  const std::vector<Bead> alveolar{{{29.5, -46, -5}, 6.2},
                                   {{26, -63, -5}, 6.2},
                                   {{17, -76.5, -5}, 5.7},
                                   {{8, -82.5, -5}, 5.3},
                                   {{0, -83.8, -5}, 5.3}};
  parts.push_back(ellipsoid({0, -58, 4}, {30, 26, 13}, 8));  // palate and nasal floor
  parts.push_back(ellipsoid({0, -52, 15}, {36, 24, 26}, 8));
  parts.push_back(chain({{{23, -67, 0}, 10}, {{26, -67, 22}, 10}}, 8));
  parts.push_back(chain(alveolar, 6));
  parts.push_back(chain({{{33, -69, 16}, 8}, {{52, -59, 20}, 6.5}}, 8));  // cheek bone
  parts.push_back(
      chain({{{52, -58, 22}, 6}, {{50, -60, 50}, 4.2}}, 5));  // lateral rim of the orbit
  parts.push_back(chain({{{14, -79, 25}, 4.5}, {{38, -71, 23}, 4.5}}, 5));  // lower rim
  parts.push_back(chain({{{8.5, -81, 52}, 5}, {{14, -78, 14}, 4.5}}, 5));
  parts.push_back(chain(
      {{{54, -55, 20}, 5}, {{62, -38, 17}, 3.4}, {{63.5, -16, 14}, 3.4}, {{60, 4, 15}, 5}}, 4));
  parts.push_back(cut(chain({{{32.5, -94, 41}, 19.5}, {{20, -46, 39}, 5}}, 3)));  // orbit
  parts.push_back(cut(chain({{{0, -92, 11}, 12}, {{0, -92, 24}, 7}}, 2)));        // nasal aperture
  parts.push_back(cut(chain({{{0, -72, 11}, 9}, {{0, -72, 22}, 6}}, 3)));
  parts.push_back(chain({{{0, -82, 53}, 6}, {{0, -96, 30}, 3}}, 4));   // nasal bones
  parts.push_back(chain({{{0, -62, 22}, 2}, {{0, -85, 1}, 2.2}}, 3));  // vomer and nasal spine
}

std::vector<Part> skull_parts() {
  std::vector<Part> parts = cranium_parts();
  add_midface(parts);
  add_teeth(parts,
            {{{30, -45, 0}, 4.7},
             {{28.5, -55.5, 0}, 5},
             {{26, -64.5, 0}, 3.8},
             {{22.5, -71.7, 0}, 3.8},
             {{17.3, -78.3, 0}, 3.7},
             {{10.8, -83, 0}, 3.3},
             {{3.9, -85.4, 0}, 3.8}},
            -7, -20.5);
  return parts;
}

std::vector<Part> skin_parts() {
  std::vector<Part> parts{
      ellipsoid({0, 8, 60}, {78, 99, 74}, 0),
      ellipsoid({0, -28, 8}, {74, 58, 54}, 10),                 // middle face
      ellipsoid({0, -36, -14}, {59, 54, 57}, 12),               // lower face
      ellipsoid({38, -55, 12}, {24, 25, 25}, 16),               // cheek
      chain({{{46, -17, -42}, 13}, {{20, -66, -52}, 14}}, 16),  // jaw line
      ellipsoid({0, -77, -60}, {20, 18, 15}, 14),               // chin
      chain({{{0, -80, 60}, 11}, {{30, -77, 63}, 11}}, 14),     // brow
      chain({{{46, -52, 56}, 14}, {{52, -44, 36}, 15}}, 14),    // temple
      cut(ellipsoid({30, -104, 42}, {20, 18, 10}, 14)),
      ellipsoid({31, -72.5, 42}, {14, 14, 11}, 5),             // eye
      chain({{{0, -88, 50}, 5.5}, {{0, -107, 16}, 7.2}}, 12),  // nose
      chain({{{0, -84, 44}, 6}, {{0, -90, 14}, 10}}, 12),
      chain({{{0, -90, 1}, 6.5}, {{0, -103, 13}, 6}}, 8),
      ellipsoid({9.5, -94, 9}, {7, 10, 6.5}, 10),
      ellipsoid({0, -78, -10}, {26, 17, 18}, 10),  // around the mouth
  };
  parts.push_back(chain({{{23, -85, -23}, 2.5},
                         {{11, -95, -17}, 4},
                         {{4, -97.3, -15.6}, 4.2},
                         {{0, -97.3, -15.6}, 4.2}},
                        8));  // upper lip
  parts.push_back(chain({{{23, -85, -23}, 2.5},
                         {{13, -92.5, -29}, 4.4},
                         {{5, -95.3, -30.5}, 5},
                         {{0, -95.3, -30.5}, 5}},
                        8));  // lower lip
  return parts;
}

double skull_distance(const Vec3& point, double mandible) {
  static const std::vector<Part> parts = skull_parts();
  return soft_max(signed_distance(parts, point), joint_gap - mandible, 1.0);
}

}  // namespace

double mandible_distance(const Vec3& point) {
  static const std::vector<Part> parts = mandible_parts();
  return signed_distance(parts, point);
}

double skull_distance(const Vec3& point) { return skull_distance(point, mandible_distance(point)); }

double skin_distance(const Vec3& point) {
  static const std::vector<Part> parts = skin_parts();
  const double mandible = mandible_distance(point);
  const double bones = soft_min(skull_distance(point, mandible), mandible, 8.0);
  return soft_min(signed_distance(parts, point), bones - min_tissue, 8.0);
}

}  // namespace repose::tools::phantom
