#include "release.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace repose::model {
namespace {

constexpr double full_difference = 4;  // mm, of displacements, from which the distance is the whole
constexpr double alike = 1e-9;         // mm: pieces whose displacements differ by less move alike

/// Share of the release distance up to which tissue is released from bone whose displacement
/// differs by so many mm there; 0 where the pieces move alike.
double released_share(double difference) {
  return difference <= alike ? 0 : std::min(1.0, difference / full_difference);
}

/// Least release distance, mm, at which tissue at `point`, attached to the bone `own`, is released
/// because of another bone; infinite where all bones move alike.
double releasing_distance(const Vec3& point, int32_t own, const BoneField& bones,
                          const MotionRange& range) {
  double least = INFINITY;
  for (int32_t piece = 0; piece < bones.size(); ++piece) {
    const double share = released_share(range.difference(point, own, piece));
    if (share > 0) least = std::min(least, bones.distance(piece, point) / share);
  }
  return least;
}

/// Largest of ascending `columns` (releasing distance and area of each) up to which columns lie
/// with no more than `share` of the whole area; negative if there is none.
double distance_of_share(const std::vector<std::array<double, 2>>& columns, double share) {
  double whole = 0;
  for (const auto& [distance, area] : columns) whole += area;
  double within = 0, below = -1;  // `below` of those as far as the present one, which go together
  for (size_t k = 0; k < columns.size(); ++k) {
    if (k > 0 && columns[k - 1][0] < columns[k][0]) below = columns[k - 1][0];
    within += columns[k][1];
    if (within > share * whole) return below;
  }
  return columns.empty() ? -1 : columns.back()[0];
}

/// Release distance of each bone, mm: release.distance, or less where that leaves less than the
/// pedicle attached. `releasing` [V] is the releasing_distance of each column.
std::vector<double> distances_of_bones(const std::vector<double>& releasing,
                                       const Attachment& attachment, size_t bones,
                                       const Release& release) {
  std::vector<double> limits(bones, release.distance);
  if (release.pedicle.empty()) return limits;
  std::vector<std::vector<std::array<double, 2>>> columns(bones);
  for (size_t v = 0; v < releasing.size(); ++v)
    if (attachment.bone[v] >= 0)
      columns[attachment.bone[v]].push_back({releasing[v], release.area[v]});
  for (size_t b = 0; b < bones; ++b) {
    if (!(release.pedicle[b] > 0)) continue;
    std::ranges::sort(columns[b]);
    limits[b] = std::min(limits[b], distance_of_share(columns[b], 1 - release.pedicle[b]));
  }
  return limits;
}

}  // namespace

std::vector<double> release_near_other_pieces(const std::vector<Vec3>& deep, const BoneField& bones,
                                              const MotionRange& range, const Release& release,
                                              Attachment& attachment) {
  if (!(release.distance > 0)) return std::vector<double>(bones.size(), release.distance);
  std::vector<double> releasing(deep.size(), INFINITY);
  for (size_t v = 0; v < deep.size(); ++v)
    if (attachment.bone[v] >= 0)
      releasing[v] = releasing_distance(deep[v], attachment.bone[v], bones, range);
  const std::vector<double> limits =
      distances_of_bones(releasing, attachment, bones.size(), release);
  for (size_t v = 0; v < deep.size(); ++v) {
    const int32_t own = attachment.bone[v];
    if (own < 0 || releasing[v] > limits[own]) continue;
    attachment.settle(v, release.how);
    ++attachment.released;
  }
  return limits;
}

void release_near_rim(const std::vector<Vec3>& deep, const std::vector<char>& rim,
                      const MotionRange& range, const Release& release, Attachment& attachment) {
  if (!(release.distance > 0)) return;
  std::vector<Vec3> fixed;
  for (size_t v = 0; v < deep.size(); ++v)
    if (rim[v]) fixed.push_back(deep[v]);
  for (size_t v = 0; v < deep.size(); ++v) {
    if (attachment.bone[v] < 0) continue;
    const double near =
        release.distance * released_share(range.travel(deep[v], attachment.bone[v]));
    if (!(near > 0) || std::none_of(fixed.begin(), fixed.end(), [&](const Vec3& p) {
          return (p - deep[v]).squaredNorm() <= near * near;
        }))
      continue;
    attachment.settle(v, release.how);
    ++attachment.released;
  }
}

}  // namespace repose::model
