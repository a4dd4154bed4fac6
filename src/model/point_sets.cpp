#include "point_sets.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "repose/base/error.h"

namespace repose::model {
namespace {

double nearest_skin(const SkinMesh& mesh, const BoneField& bones, int32_t bone) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Vec3& x : mesh.points) nearest = std::min(nearest, bones.distance(bone, x));
  return nearest;
}

/// Why no tissue is attached to a bone, and what to do about it.
std::string explain_unattached(const scene::Scene& scene, const SkinMesh& mesh,
                               const BoneField& bones, int32_t bone, int64_t reached) {
  if (reached > 0 && scene.tissue.attach != scene::Attach::fixed)
    return fmt::format(
        "tissue.attach or a region lets all {} columns go that reach it; attach some to be fixed "
        "or slide, by tissue.attach or tissue.attach_regions",
        reached);
  if (reached > 0)
    return fmt::format(
        "all {} columns that reach it are let go: on the fixed rim, by a region, or within {} mm "
        "of a piece that moves differently; set tissue.release smaller, or attach some to be fixed "
        "or slide",
        reached, scene.tissue.release);
  const double distance = nearest_skin(mesh, bones, bone), within = scene.tissue.attach_within;
  if (distance > within)
    return fmt::format(
        "no column of tissue reaches it: it is {:.1f} mm from the skin and tissue.attach_within is "
        "{} mm; set attach_within greater or take the bone out",
        distance, within);
  return fmt::format(
      "no column of tissue reaches it, {:.1f} mm from the skin: other bone lies between, or the "
      "skin that is solved ends before it; solve more of the skin (tissue.face, tissue.margin), or "
      "take the bone out",
      distance);
}

[[noreturn]] void refuse_unheld(const scene::Scene& scene, const Attachment& attachment) {
  const std::string file = scene.file.string();
  const int64_t reached =
      std::accumulate(attachment.reached.begin(), attachment.reached.end(), int64_t{0});
  if (reached > 0)
    base::refuse(
        "{}: nothing holds the tissue: none of the {} columns that reach bone moves with it and no "
        "rim is fixed; set tissue.attach: fixed, attach: fixed in a region of "
        "tissue.attach_regions, or boundary: {{rim: fixed}}",
        file, reached);
  base::refuse(
      "{}: nothing holds the tissue: no column is attached to bone within {} mm and no rim is "
      "fixed; set tissue.attach_within greater or boundary: {{rim: fixed}}",
      file, scene.tissue.attach_within);
}

}  // namespace

std::vector<char> rim_columns(const SkinMesh& mesh, bool rim_fixed) {
  std::vector<char> rim(mesh.points.size(), 0);
  if (rim_fixed && !mesh.border_loops.empty())
    for (const int64_t v : mesh.border_loops.front()) rim[v] = 1;
  return rim;
}

void set_points(const std::vector<char>& rim, const ColumnEnds& ends,
                const std::vector<scene::RigidMotion>& moves, Model& model) {
  Points& points = model.points;
  const size_t layers = points.position.size() / rim.size();
  for (size_t c = 0; c < rim.size(); ++c) {
    const size_t first = c * layers, deepest = first + layers - 1;
    if (rim[c]) std::fill_n(points.set.begin() + first, layers, PointSet::boundary);
    const int32_t bone = ends.bone[c];
    if (rim[c] || bone < 0) continue;
    points.set[deepest] = PointSet::bone;
    points.bone[deepest] = bone;
    points.target[deepest] = moves[bone].apply(points.position[deepest]);
  }
}

void require_held(const scene::Scene& scene, const SkinMesh& mesh, const BoneField& bones,
                  const Counts& counts, Attachment& attachment) {
  const std::string file = scene.file.string();
  std::vector<int64_t> tied(bones.size(), 0);
  for (const auto* bones_of : {&attachment.bone, &attachment.slides_on, &attachment.support})
    for (const int32_t bone : *bones_of)
      if (bone >= 0) ++tied[bone];
  const bool touching =
      scene.contact && scene.contact->bones &&
      std::count(attachment.free.begin(), attachment.free.end(), 1) <
          std::accumulate(attachment.reached.begin(), attachment.reached.end(), int64_t{0});
  for (int32_t b = 0; b < bones.size(); ++b) {
    if (tied[b] > 0) continue;
    const std::string why = explain_unattached(scene, mesh, bones, b, attachment.reached[b]);
    const bool planned = scene.plan && std::ranges::binary_search(scene.plan->pieces, size_t(b));
    if ((planned || !scene.moves[b].is_identity()) && !(touching && attachment.reached[b] > 0))
      base::refuse("{}: bone '{}' moves but no tissue is attached to it: {}", file,
                   scene.bones[b].name, why);
    attachment.remarks.push_back(
        fmt::format("no tissue is attached to bone '{}': {}", scene.bones[b].name, why));
  }
  if (counts.soft == 0)
    base::refuse(
        "{}: no point of the tissue is free to move: all {} columns lie on the fixed rim; "
        "use a finer skin mesh or boundary: {{rim: free}}",
        file, mesh.points.size());
  if (counts.bone + counts.boundary == 0) refuse_unheld(scene, attachment);
}

}  // namespace repose::model
