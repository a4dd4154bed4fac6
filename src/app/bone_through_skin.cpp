#include "bone_through_skin.h"

#include <algorithm>
#include <array>
#include <optional>

#include "report.h"
#include "repose/model/instruments.h"
#include "repose/scene/rigid_motion.h"
#include "repose/surface/triangle_tree.h"

namespace repose::app {

namespace {

constexpr double reported = 0.3;  // mm

/// The middles of a triangle and of its edges.
std::array<Vec3, 4> between(const surface::Corners& corner) {
  const auto& [a, b, c] = corner;
  return {(a + b + c) / 3, (a + b) / 2, (b + c) / 2, (c + a) / 2};
}

struct Through {
  int64_t triangles = 0;
  double depth = 0;  // mm
  Vec3 where = Vec3::Zero();
};

/// Returns where triangles pass through a bone, all at the bone's initial position: `now`, and
/// `initial` before the move.
Through pass_through(const surface::Surface& initial, const surface::Surface& now,
                     const surface::Surface& bone) {
  const surface::TriangleTree near(bone);
  std::optional<model::MeshDepth> depth;
  Through found;
  int64_t hint = -1;
  for (const Triangle& triangle : now.triangles) {
    const auto at = between(surface::corners(now, triangle));
    const double reach = 2 * (at[1] - at[2]).squaredNorm() + 2 * (at[2] - at[3]).squaredNorm();
    hint = near.any_within(at[0], reach, hint);
    if (hint < 0) continue;
    if (!depth) depth.emplace(bone);
    const auto before = between(surface::corners(initial, triangle));
    double deepest = reported;
    for (size_t k = 0; k < at.size(); ++k) {
      double deeper = depth->at(at[k]);
      if (deeper > deepest) deeper -= depth->at(before[k]);
      deepest = std::max(deepest, deeper);
    }
    if (deepest <= reported) continue;
    ++found.triangles;
    if (deepest <= found.depth) continue;
    found.depth = deepest;
    found.where = at[0];
  }
  return found;
}

}  // namespace

std::string describe_bone_through_skin(const surface::Surface& initial,
                                       const std::vector<Vec3>& now, const model::Model& model) {
  std::string text;
  for (const auto& body : model.contact.bodies) {
    const int32_t b = body.bone;
    if (b < 0 || model.bone_transform.empty()) continue;
    const auto motion = scene::RigidMotion::from_matrix(model.bone_transform[b]);
    const scene::RigidMotion back = motion.inverse();
    surface::Surface beside = initial;
    for (size_t i = 0; i < now.size(); ++i) beside.points[i] = back.apply(now[i]);
    const Through found = pass_through(initial, beside, model.bone_surfaces[b]);
    if (found.triangles == 0) continue;
    text += report_row(
        "bone through skin",
        "{} triangles of the skin, whose points are outside, are up to {:.1f} mm inside {}, most "
        "at {:.1f} mm: tissue is thinner there than its triangles; use a finer skin (tissue.edge)",
        found.triangles, found.depth, model.bones[b], motion.apply(found.where));
  }
  return text;
}

}  // namespace repose::app
