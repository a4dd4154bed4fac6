#include "release.h"

#include <algorithm>

#include "repose/model/collision.h"

namespace repose::model {
namespace {

/// For each bone, the bones that move differently from it.
std::vector<std::vector<int32_t>> others(const std::vector<scene::RigidMotion>& moves) {
  std::vector<std::vector<int32_t>> differing(moves.size());
  for (size_t own = 0; own < moves.size(); ++own)
    for (size_t other = 0; other < moves.size(); ++other)
      if (!move_alike(moves[own], moves[other]))
        differing[own].push_back(static_cast<int32_t>(other));
  return differing;
}

}  // namespace

void release_near_other_pieces(const std::vector<Vec3>& deep, const BoneField& bones,
                               const std::vector<scene::RigidMotion>& moves, const Release& release,
                               Attachment& attachment) {
  if (!(release.distance > 0)) return;
  const std::vector<std::vector<int32_t>> differing = others(moves);
  for (size_t v = 0; v < deep.size(); ++v) {
    if (attachment.bone[v] < 0) continue;
    const std::vector<int32_t>& pieces = differing[attachment.bone[v]];
    if (std::none_of(pieces.begin(), pieces.end(), [&](int32_t piece) {
          return bones.distance(piece, deep[v]) <= release.distance;
        }))
      continue;
    attachment.settle(v, release.how);
    ++attachment.released;
  }
}

void release_near_rim(const std::vector<Vec3>& deep, const std::vector<char>& rim,
                      const std::vector<scene::RigidMotion>& moves, const Release& release,
                      Attachment& attachment) {
  if (!(release.distance > 0)) return;
  std::vector<Vec3> fixed;
  for (size_t v = 0; v < deep.size(); ++v)
    if (rim[v]) fixed.push_back(deep[v]);
  const double reach = release.distance * release.distance;
  for (size_t v = 0; v < deep.size(); ++v) {
    if (attachment.bone[v] < 0 || moves[attachment.bone[v]].is_identity()) continue;
    if (std::none_of(fixed.begin(), fixed.end(),
                     [&](const Vec3& p) { return (p - deep[v]).squaredNorm() <= reach; }))
      continue;
    attachment.settle(v, release.how);
    ++attachment.released;
  }
}

}  // namespace repose::model
