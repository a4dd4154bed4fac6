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

/// Releasing distance at which columns (releasing distance and area of each) that lie nearer, in
/// ascending order, have no more than `share` of the whole area; infinite where that is all of
/// them. It is continuous in their distances.
double distance_of_share(const std::vector<std::array<double, 2>>& columns, double share) {
  double whole = 0, within = 0;
  for (const auto& [distance, area] : columns) whole += area;
  if (!(share > 0)) return 0;
  for (const auto& [distance, area] : columns) {
    within += area;
    if (within > share * whole) return distance;
  }
  return INFINITY;
}

/// Share, 0 to 1, by which tissue whose releasing distance is `releasing` mm is held where it is
/// released up to `limit` mm, with the band on both sides of it as a share of that.
double held_share(double releasing, double limit, double band) {
  if (!(limit > 0) || !(band > 0)) return releasing < limit ? 0 : 1;
  return std::clamp((releasing / limit - 1 + band) / (2 * band), 0.0, 1.0);
}

/// The share by which an elastic support holds.
double share_of_stiffness(double stiffness) { return stiffness / (1 + stiffness); }

/// Lets go of a column but for the share `held`: by an elastic support that is rigid at 1 and
/// vanishes at 0.
void release_column(size_t column, double held, scene::Attach how, Attachment& attachment) {
  constexpr double negligible = 1e-4;
  if (held > 1 - negligible || how == scene::Attach::fixed) return;
  const double stiffness = held / (1 - held);
  if (attachment.bone[column] >= 0) {
    ++attachment.released;
    attachment.support[column] = attachment.bone[column];
    attachment.support_stiffness[column] = stiffness;
    attachment.settle(column, how);
  }
  double& support = attachment.support_stiffness[column];
  support = std::min(support, stiffness);
  if (support < negligible) attachment.support[column] = -1;
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
  for (size_t v = 0; v < deep.size(); ++v)
    if (const int32_t own = attachment.bone[v]; own >= 0)
      release_column(v, held_share(releasing[v], limits[own], release.band), release.how,
                     attachment);
  return limits;
}

void release_near_rim(const std::vector<Vec3>& deep, const std::vector<char>& rim,
                      const MotionRange& range, const Release& release, Attachment& attachment) {
  if (!(release.distance > 0)) return;
  std::vector<std::pair<Vec3, double>> held;  // deepest points of the rim, and how far it is
  for (size_t v = 0; v < deep.size(); ++v)
    if (rim[v])
      held.emplace_back(deep[v], 1);
    else if (attachment.supported_whole[v])
      held.emplace_back(deep[v], share_of_stiffness(attachment.support_stiffness[v]));
  for (size_t v = 0; v < deep.size(); ++v) {
    const int32_t own = std::max(attachment.bone[v], attachment.support[v]);
    const double share =
        own < 0 || attachment.supported_whole[v] ? 0 : released_share(range.travel(deep[v], own));
    if (!(share > 0)) continue;
    double releasing = INFINITY;
    for (const auto& [at, by] : held)
      releasing = std::min(releasing, (at - deep[v]).norm() / (by * share));
    release_column(v, held_share(releasing, release.distance, release.band), release.how,
                   attachment);
  }
}

}  // namespace repose::model
