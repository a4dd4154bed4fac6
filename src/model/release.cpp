#include "release.h"

#include <algorithm>

namespace repose::model {
namespace {

constexpr double full_difference = 4;  // mm, of displacements, from which the distance is the whole
constexpr double alike = 1e-9;         // mm: pieces whose displacements differ by less move alike

/// mm, up to which tissue is released from bone whose displacement differs by so many mm there.
double released_within(const Release& release, double difference) {
  if (difference <= alike) return -1;
  return release.distance * std::min(1.0, difference / full_difference);
}

/// Returns whether tissue at `point`, attached to the bone `own`, is released because of another
/// bone.
bool is_near_other(const Vec3& point, int32_t own, const BoneField& bones, const MotionRange& range,
                   const Release& release) {
  for (int32_t piece = 0; piece < bones.size(); ++piece) {
    const double near = released_within(release, range.difference(point, own, piece));
    if (near >= 0 && bones.distance(piece, point) <= near) return true;
  }
  return false;
}

}  // namespace

void release_near_other_pieces(const std::vector<Vec3>& deep, const BoneField& bones,
                               const MotionRange& range, const Release& release,
                               Attachment& attachment) {
  if (!(release.distance > 0)) return;
  for (size_t v = 0; v < deep.size(); ++v) {
    const int32_t own = attachment.bone[v];
    if (own < 0 || !is_near_other(deep[v], own, bones, range, release)) continue;
    attachment.settle(v, release.how);
    ++attachment.released;
  }
}

void release_near_rim(const std::vector<Vec3>& deep, const std::vector<char>& rim,
                      const MotionRange& range, const Release& release, Attachment& attachment) {
  if (!(release.distance > 0)) return;
  std::vector<Vec3> fixed;
  for (size_t v = 0; v < deep.size(); ++v)
    if (rim[v]) fixed.push_back(deep[v]);
  for (size_t v = 0; v < deep.size(); ++v) {
    if (attachment.bone[v] < 0) continue;
    const double near = released_within(release, range.travel(deep[v], attachment.bone[v]));
    if (near < 0 || std::none_of(fixed.begin(), fixed.end(), [&](const Vec3& p) {
          return (p - deep[v]).squaredNorm() <= near * near;
        }))
      continue;
    attachment.settle(v, release.how);
    ++attachment.released;
  }
}

}  // namespace repose::model
