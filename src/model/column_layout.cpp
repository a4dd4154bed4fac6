#include "column_layout.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "anatomy_check.h"
#include "point_sets.h"
#include "release.h"
#include "repose/base/error.h"
#include "repose/surface/edges.h"

namespace repose::model {
namespace {

constexpr double far_apart = 200, near = 50;  // mm

using Box = Eigen::AlignedBox3d;

std::string corner_text(const Box& box) {
  return fmt::format("{:.0f} to {:.0f} mm", box.min(), box.max());
}

void refuse_far_apart(const std::string& skin_name, const surface::Surface& bone,
                      const Box& skin_box, const Box& bone_box) {
  const Vec3 turn(-1, -1, 1);
  Box turned;
  turned.extend(turn.cwiseProduct(bone_box.min()));
  turned.extend(turn.cwiseProduct(bone_box.max()));
  const bool other_frame = skin_box.exteriorDistance(turned) <= near;
  base::refuse("{} is at {}, but {} at {}: {:.0f} mm apart; {}", skin_name, corner_text(skin_box),
               bone.name, corner_text(bone_box), skin_box.exteriorDistance(bone_box),
               other_frame ? "one is in LPS and the other in RAS coordinates, export both in one"
                           : "export both in the coordinates of one scan, in mm");
}

/// Refuses a skin and bones that are not where they belong: bounding boxes more than 200 mm apart
/// (files in different coordinates: the message says which, and whether turning LPS into RAS would
/// bring them together; InputError), or skin vertices inside bone (RefusedPlaces, skin_mesh.h).
void require_same_place(const SkinMesh& mesh, const std::string& skin_name,
                        const std::vector<surface::Surface>& bones, const BoneField& field) {
  const Box skin_box = surface::bounding_box(mesh.points);
  for (const surface::Surface& bone : bones)
    if (const Box box = surface::bounding_box(bone.points);
        skin_box.exteriorDistance(box) > far_apart)
      refuse_far_apart(skin_name, bone, skin_box, box);
  std::vector<int64_t> inside;
  for (size_t v = 0; v < mesh.points.size(); ++v)
    if (field.containing(mesh.points[v]) >= 0) inside.push_back(static_cast<int64_t>(v));
  if (!inside.empty())
    refuse_places(
        skin_name, mesh, inside,
        fmt::format("{} of {} vertices lie inside bone (the first in {})", inside.size(),
                    mesh.points.size(), bones[field.containing(mesh.points[inside.front()])].name),
        "the skin must be outside all bone: check that both come from one scan and in one "
        "frame");
}

/// Turns the skin round where most of it, by area, has the nearest bone on its outer side: an open
/// patch has no defined outside. Returns whether it did.
bool face_outwards(const std::vector<BoneField::Nearest>& nearest, SkinMesh& mesh) {
  double towards_bone = 0;
  for (size_t v = 0; v < nearest.size(); ++v) {
    if (nearest[v].bone < 0) continue;
    const Vec3 towards = nearest[v].point - mesh.points[v];
    towards_bone += mesh.vertex_area[v] * (mesh.vertex_normal[v].dot(towards) > 0 ? 1 : -1);
  }
  if (towards_bone >= 0) return false;
  flip(mesh);
  return true;
}

constexpr double gap_worth_saying = 0.5;  // mm

std::vector<BoneField::Nearest> nearest_bone(const SkinMesh& mesh, const BoneField& bones) {
  std::vector<BoneField::Nearest> nearest;
  nearest.reserve(mesh.points.size());
  for (const Vec3& x : mesh.points) nearest.push_back(bones.nearest(x));
  return nearest;
}

void require_one_of_each(const scene::Scene& scene, const std::vector<surface::Surface>& bones) {
  if (bones.size() != scene.bones.size() || scene.moves.size() != scene.bones.size())
    throw base::InternalError(fmt::format("{} bones, {} bone surfaces, {} moves: not one of each",
                                          scene.bones.size(), bones.size(), scene.moves.size()));
}

/// The skin with the paths of the incisions as edges.
SkinMesh mesh_with_paths(const scene::Scene& scene, const surface::Surface& skin,
                         std::vector<Cut>& cuts) {
  SkinMesh mesh = make_skin_mesh(skin);
  if (scene.incisions.empty()) return mesh;
  surface::Surface refined = skin;
  cuts = insert_paths(scene.incisions, scene.file.string(), refined);
  for (Cut& cut : cuts) cut.meets = scene.contact && scene.contact->cuts;
  return make_skin_mesh(refined);
}

/// Least share of the tissue on each bone that stays attached, [bones]: of the piece of a
/// genioplasty, which goes with a broad pedicle of soft tissue. Empty without landmarks.
std::vector<double> pedicles(const scene::Scene& scene) {
  std::vector<double> shares;
  if (!scene.anatomy) return shares;
  shares.assign(scene.bones.size(), 0);
  for (const scene::Osteotomy& cut : scene.osteotomies)
    if (cut.made_by == scene::OsteotomyTemplate::genioplasty)
      shares[cut.piece] = scene.anatomy->pedicle;
  return shares;
}

/// Share of the release distance on both sides of which a solid is supported elastically. The
/// paper's functionals know no such support, so that columns of springs are held or released.
double release_band(const scene::Scene& scene) { return scene.tissue.material ? 0.4 : 0; }

/// Releases tissue near pieces that move differently, and reports where the pedicle limits it.
void release_from_bones(const scene::Scene& scene, const MotionRange& range, ColumnLayout& layout) {
  const double distance = scene.tissue.release;
  const std::vector<double> pedicle = pedicles(scene);
  const std::vector<double> limits = release_near_other_pieces(
      layout.columns.deep, layout.field, range,
      {distance, scene.tissue.released, release_band(scene), pedicle, layout.mesh.vertex_area},
      layout.attachment);
  for (size_t b = 0; b < limits.size(); ++b)
    if (limits[b] < distance)
      layout.attachment.remarks.push_back(fmt::format(
          "pedicle by landmarks: tissue on '{}' is released within {:.1f} in place of {:g} mm of "
          "other pieces, so that {:g} % of it stays attached",
          scene.bones[b].name, limits[b], distance, 100 * pedicle[b]));
}

/// Chooses the columns that are held as the rim; those released from bone, as do those near other
/// pieces.
void settle_rim(const scene::Scene& scene, const MotionRange& range, ColumnLayout& layout) {
  Attachment& attachment = layout.attachment;
  std::vector<char>& rim = layout.rim;
  rim = rim_columns(layout.mesh, scene.rim != scene::Rim::free);
  const auto let_go = [&] {
    for (size_t c = 0; c < rim.size(); ++c)
      if (rim[c]) attachment.bone[c] = attachment.slides_on[c] = attachment.support[c] = -1;
  };
  if (scene.rim == scene::Rim::fixed) let_go();
  const std::vector<int32_t> sliding = attachment.slides_on;
  release_from_bones(scene, range, layout);
  if (scene.rim != scene::Rim::automatic) return;
  const std::vector<char> border = rim;
  const auto stays = [&](size_t c, int32_t bone) {
    return bone >= 0 && range.travel(layout.columns.deep[c], bone) <= negligible_travel;
  };
  for (size_t c = 0; c < rim.size(); ++c) {
    attachment.supported_whole[c] = rim[c] && stays(c, attachment.support[c]);
    rim[c] = rim[c] && stays(c, attachment.bone[c] >= 0 ? attachment.bone[c] : sliding[c]);
  }
  const bool held = std::ranges::any_of(rim, [](char fixed) { return fixed != 0; }) ||
                    std::ranges::any_of(attachment.bone, [](int32_t bone) { return bone >= 0; });
  if (!held) rim = border;  // nothing else holds the tissue
  let_go();
}

}  // namespace

ColumnLayout lay_out_columns(const scene::Scene& scene, const surface::Surface& skin,
                             const std::vector<surface::Surface>& bones) {
  require_one_of_each(scene, bones);
  const MotionRange range(scene, bones);
  std::vector<Cut> cuts;
  SkinMesh mesh = mesh_with_paths(scene, skin, cuts);
  ColumnLayout layout{std::move(mesh), std::move(cuts), BoneField(bones), {}, {}, {}, {}};
  BuildReport& report = layout.report;
  require_same_place(layout.mesh, skin.name, bones, layout.field);
  const std::vector<BoneField::Nearest> nearest = nearest_bone(layout.mesh, layout.field);
  if (face_outwards(nearest, layout.mesh))
    report.remarks.push_back(
        fmt::format("{}: its outside faced the bones, the skin was turned round", skin.name));
  report.warnings = check_anatomy(scene, range, layout.mesh, bones);
  layout.columns = compute_columns(layout.mesh, layout.field, nearest, scene.tissue, skin.name);
  open_gaps(layout.mesh.points, scene, layout.columns);
  layout.attachment = attach_columns(layout.columns, layout.field, scene);
  settle_rim(scene, range, layout);
  if (const std::string border =
          describe_near_border(scene, range, bones, layout.mesh, layout.field);
      !border.empty())
    (scene.rim == scene::Rim::fixed ? report.warnings : report.remarks).push_back(border);
  release_near_rim(layout.columns.deep, layout.rim, range,
                   {scene.tissue.release, scene.tissue.released, release_band(scene)},
                   layout.attachment);
  if (const auto supported =
          std::ranges::count_if(layout.attachment.support, [](int32_t bone) { return bone >= 0; });
      supported > 0)
    layout.attachment.remarks.push_back(
        fmt::format("{} of the released columns are supported elastically: they end about as far "
                    "from other pieces as tissue is released",
                    supported));
  return layout;
}

void add_bones(const scene::Scene& scene, const std::vector<surface::Surface>& bones,
               Model& model) {
  model.bone_surfaces = bones;
  for (size_t b = 0; b < bones.size(); ++b) {
    model.bones.push_back(scene.bones[b].name);
    model.bone_surfaces[b].name = scene.bones[b].name;
    model.bone_transform.push_back(scene.moves[b].matrix());
  }
}

void prepend_messages(const Anatomy& anatomy, BuildReport& report) {
  report.remarks.insert(report.remarks.begin(), anatomy.remarks.begin(), anatomy.remarks.end());
  report.warnings.insert(report.warnings.begin(), anatomy.warnings.begin(), anatomy.warnings.end());
}

void report_columns(int64_t attached, ColumnLayout& layout) {
  const Columns& columns = layout.columns;
  const Attachment& attachment = layout.attachment;
  BuildReport& report = layout.report;
  report.attached = attached;
  report.free_deep = std::ranges::count(layout.rim, 0) - attached;
  std::vector<double> sorted = columns.thickness;
  std::sort(sorted.begin(), sorted.end());
  report.thickness_min = sorted.front();
  report.thickness_median = sorted[sorted.size() / 2];
  report.thickness_max = sorted.back();
  report.shortened = columns.shortened;
  report.released = attachment.released;
  report.remarks.insert(report.remarks.end(), attachment.remarks.begin(), attachment.remarks.end());
  if (columns.bent > 0)
    report.remarks.push_back(fmt::format(
        "{} columns were bent towards their neighbors, which they crossed", columns.bent));
  if (columns.shortened > 0)
    report.remarks.push_back(
        fmt::format("{} columns were shortened so that neighbors do not cross", columns.shortened));
  if (attachment.largest_gap > gap_worth_saying)
    report.remarks.push_back(
        fmt::format("deepest points attached to bone end up to {:.2f} mm short of it, where bone "
                    "falls away steeply or columns were shortened",
                    attachment.largest_gap));
}

}  // namespace repose::model
