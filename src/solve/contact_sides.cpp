#include "contact_sides.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace repose::solve {

namespace {

/// [local points] Blocks on the diagonal of the semidefinite Hessian without contact. Collective.
std::vector<Mat3> diagonal_blocks(discrete::Tangent& tangent, Vec displacement, size_t points) {
  std::vector<Mat3> blocks(points, Mat3::Zero());
  tangent.assemble(displacement);
  tangent.visit_spd_blocks([&](int32_t p, int32_t q, const Mat3& block) {
    if (p == q) blocks[p] += block;
  });
  return blocks;
}

/// Let go, a point with compliance s C and the contact's force f moves by −s C f and has ½ s fᵀCf
/// less energy; to stay outside the other plane, of gap g and normal m, it must have
/// ½ (s mᵀCf − g)² / (s mᵀCm) more. Returns the s at which they are equal.
double softness(const mechanics::LinearGap& other, const Mat3& compliance, const Vec3& force) {
  const Vec3& m = other.gradient.front().second;
  const Vec3 moved = compliance * force;
  const double reach = std::sqrt(force.dot(moved) * m.dot(compliance * m)) - m.dot(moved);
  return -other.gap / reach;
}

}  // namespace

std::vector<OtherSide> promising_sides(discrete::Objective& objective, discrete::Tangent& tangent,
                                       Vec displacement) {
  constexpr double softest = 4;
  const mechanics::BodyContact& contact = objective.contact().bodies();
  const auto position = objective.positions().local();
  const std::vector<Mat3> blocks = diagonal_blocks(tangent, displacement, position.size());
  std::vector<OtherSide> found;
  for (mechanics::LinearGap& gap : contact.other_sides(position)) {
    const size_t c = gap.constraint;
    const Vec3 force = contact.multipliers()[c] * gap.area * contact.normal(c);
    const double s = softness(gap, blocks[gap.gradient.front().first].inverse(), force);
    if (s > 0 && s < softest) found.push_back({std::move(gap), s});
  }
  std::ranges::sort(found, {}, &OtherSide::softness);
  return found;
}

}  // namespace repose::solve
