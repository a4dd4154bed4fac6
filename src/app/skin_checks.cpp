#include "skin_checks.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>

#include "report.h"
#include "repose/model/instruments.h"
#include "repose/model/skin_mesh.h"
#include "repose/scene/rigid_motion.h"
#include "repose/surface/triangle_tree.h"

namespace repose::app {

namespace {

constexpr double reported = 0.3;  // mm
constexpr double sample = 0.5;    // mm, between points at which depths are taken
constexpr int most_parts = 16;    // of an edge

/// Returns a triangle's points i a + j b + k c with i + j + k = 1, multiples of 1/parts, without
/// its corners.
std::vector<Vec3> between(const surface::Corners& corner, int parts) {
  const auto& [a, b, c] = corner;
  std::vector<Vec3> at;
  for (int i = 0; i < parts; ++i)
    for (int j = 0; i + j <= parts && j < parts; ++j)
      if (i + j > 0) at.push_back(c + (i * (a - c) + j * (b - c)) / parts);
  return at;
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
    const surface::Corners corner = surface::corners(now, triangle);
    const double longest = surface::longest_side(corner);
    hint = near.any_within(corner[0], longest * longest, hint);
    if (hint < 0) continue;
    if (!depth) depth.emplace(bone);
    const int parts = std::clamp(static_cast<int>(longest / sample), 2, most_parts);
    const auto at = between(corner, parts),
               before = between(surface::corners(initial, triangle), parts);
    double deepest = reported;
    for (size_t k = 0; k < at.size(); ++k) {
      double deeper = depth->at(at[k]);
      if (deeper > deepest) deeper -= depth->at(before[k]);
      if (deeper <= deepest) continue;
      deepest = deeper;
      if (deeper > found.depth) {
        found.depth = deeper;
        found.where = at[k];
      }
    }
    found.triangles += deepest > reported;
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

std::string describe_moving_border(const surface::Surface& initial, const std::vector<Vec3>& now) {
  constexpr double reported = 1;  // mm
  const model::SkinMesh mesh = model::make_skin_mesh(initial);
  if (mesh.border_loops.empty()) return "";
  const std::vector<int64_t>& border = mesh.border_loops.front();
  const auto place = [&](int64_t v) {
    return std::array{mesh.points[v].x(), mesh.points[v].y(), mesh.points[v].z()};
  };
  std::map<std::array<double, 3>, int> vertices;  // more than one at a place: sides of a cut
  for (const int64_t v : border) ++vertices[place(v)];
  double most = reported;
  int64_t where = -1;
  for (const int64_t v : border) {
    const double moved = (now[v] - mesh.points[v]).norm();
    if (moved < most || vertices[place(v)] > 1) continue;
    most = moved;
    where = v;
  }
  if (where < 0) return "";
  return report_row("border of the skin",
                    "the skin that is solved ends where it still moves by {:.1f} mm, at {:.1f} mm: "
                    "less certain there; give or solve more of it (tissue.margin, tissue.face)",
                    most, now[where]);
}

}  // namespace repose::app
