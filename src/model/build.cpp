#include "repose/model/build.h"

#include <algorithm>

#include "add_contact.h"
#include "attachment.h"
#include "columns.h"
#include "layers.h"
#include "load_entry.h"
#include "loads.h"
#include "orientation.h"
#include "point_sets.h"
#include "release.h"
#include "repose/base/error.h"
#include "repose/base/log.h"
#include "repose/model/collision.h"
#include "repose/model/material.h"
#include "repose/model/stiffness.h"
#include "solved_skin.h"

namespace repose::model {
namespace {

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

/// Which columns are held as the rim; those let go of bone, as do those near other pieces.
std::vector<char> settle_rim(const scene::Scene& scene, const SkinMesh& mesh,
                             const Columns& columns, const BoneField& field,
                             Attachment& attachment) {
  std::vector<char> rim = rim_columns(mesh, scene.rim != scene::Rim::free);
  const auto let_go = [&] {
    for (size_t c = 0; c < rim.size(); ++c)
      if (rim[c]) attachment.bone[c] = attachment.slides_on[c] = -1;
  };
  if (scene.rim == scene::Rim::fixed) let_go();
  release_near_other_pieces(columns.deep, field, scene.moves,
                            {scene.tissue.release, scene.tissue.released}, attachment);
  if (scene.rim != scene::Rim::automatic) return rim;
  for (size_t c = 0; c < rim.size(); ++c) {
    const int32_t bone = attachment.bone[c];
    rim[c] = rim[c] && bone >= 0 && scene.moves[bone].is_identity();
  }
  let_go();
  return rim;
}

void require_free_cuts(const scene::Scene& scene, const std::vector<Cut>& cuts,
                       const Model& model) {
  const auto layers = static_cast<int64_t>(scene.tissue.layers);
  for (size_t i = 0; i < cuts.size(); ++i)
    for (const int64_t column : cuts[i].columns) {
      if (model.points.set[column * layers] != PointSet::held) continue;
      const Vec3& at = model.points.position[column * layers];
      base::refuse(
          "{}: {}: an instrument holds the skin on the path near ({:.2f}, {:.2f}, "
          "{:.2f}); move one of them",
          scene.file.string(), scene.incisions[i].name, at.x(), at.y(), at.z());
    }
}

/// Everything of the model but its geometry and point sets.
void complete(const scene::Scene& scene, const SkinMesh& mesh,
              const std::vector<surface::Surface>& bones, Model& model) {
  if (scene.tissue.material)
    set_material(scene.tissue, scene.file.string(), model);
  else
    set_stiffness(scene.tissue, mesh, model);
  set_masses(scene.tissue, mesh, model);
  spread_forces(scene, mesh, model);
  model.gravity = scene.gravity.value_or(Vec3::Zero());
  model.bone_surfaces = bones;
  for (size_t b = 0; b < bones.size(); ++b) {
    model.bones.push_back(scene.bones[b].name);
    model.bone_surfaces[b].name = scene.bones[b].name;
    model.bone_transform.push_back(scene.moves[b].matrix());
  }
}

void report_columns(const Columns& columns, const Attachment& attachment, BuildReport& report) {
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
        "{} columns were bent towards their neighbours, which they crossed", columns.bent));
  if (columns.shortened > 0)
    report.remarks.push_back(fmt::format(
        "{} columns were shortened so that neighbours do not cross", columns.shortened));
  if (attachment.largest_gap > gap_worth_saying)
    report.remarks.push_back(
        fmt::format("deepest points attached to bone end up to {:.2f} mm short of it, where bone "
                    "falls away steeply or columns were shortened",
                    attachment.largest_gap));
}

void report_model(const SkinMesh& mesh, const std::vector<char>& rim, const Model& model,
                  BuildReport& report) {
  const auto columns = static_cast<int64_t>(mesh.points.size());
  report.skin_vertices = columns;
  report.skin_edges = static_cast<int64_t>(mesh.edges.size());
  report.skin_triangles = static_cast<int64_t>(mesh.triangles.size());
  report.attached = count(model).bone;
  report.free_deep = columns - report.attached - std::count(rim.begin(), rim.end(), 1);
  report.effective_modulus = effective_modulus(model);
}

}  // namespace

BuiltModel build_model(const scene::Scene& scene, const surface::Surface& skin,
                       const std::vector<surface::Surface>& bones) {
  require_one_of_each(scene, bones);
  const std::vector<double> depths = layer_depths(scene.tissue);
  BuiltModel built;
  SkinMesh mesh = mesh_with_paths(scene, skin, built.cuts);
  const BoneField field(bones);
  require_same_place(mesh, skin.name, bones, field);
  const std::vector<BoneField::Nearest> nearest = nearest_bone(mesh, field);

  if (face_outwards(nearest, mesh))
    built.report.remarks.push_back(
        fmt::format("{}: its outside faced the bones, the skin was turned round", skin.name));
  const Columns columns = lay_columns(mesh, field, nearest, scene.tissue, skin.name);
  Attachment attachment = attach_columns(columns, field, scene.tissue);
  const std::vector<char> rim = settle_rim(scene, mesh, columns, field, attachment);
  release_near_rim(columns.deep, rim, scene.moves, {scene.tissue.release, scene.tissue.released},
                   attachment);

  built.model = make_layers(mesh, columns.deep, depths, scene.tissue.depths_mm,
                            scene.tissue.material ? Elements::solid : Elements::springs);
  set_points(rim, attachment, scene.moves, built.model);
  built.held = hold_by_instruments(scene, built.model);
  require_free_cuts(scene, built.cuts, built.model);
  require_held(scene, mesh, field, built.model, attachment);
  complete(scene, mesh, bones, built.model);
  add_contact(scene, mesh, attachment, built.model);
  report_columns(columns, attachment, built.report);
  report_model(mesh, rim, built.model, built.report);
  return built;
}

Anatomy load_anatomy(const scene::Scene& scene) {
  static const PetscLogEvent event = base::log_event("RpSurfaces");
  const base::Logged logged(event);
  const auto role = scene.tissue.edge ? surface::Role::raw : surface::Role::skin;
  Anatomy anatomy{scene, load_entry(scene.skin, role), {}, {}, {}};
  Bones bones = read_bones(scene);
  anatomy.bones = std::move(bones.surfaces);
  anatomy.remarks = std::move(bones.remarks);
  anatomy.remarks.insert(anatomy.remarks.end(), scene.remarks.begin(), scene.remarks.end());
  heed_collisions(anatomy.bones, anatomy.scene, anatomy.remarks);
  if (scene.tissue.edge) solve_remeshed(anatomy);
  return anatomy;
}

BuiltModel build_model(const Anatomy& anatomy) {
  static const PetscLogEvent event = base::log_event("RpBuild");
  const base::Logged logged(event);
  BuiltModel built = build_model(anatomy.scene, anatomy.skin, anatomy.bones);
  built.report.remarks.insert(built.report.remarks.begin(), anatomy.remarks.begin(),
                              anatomy.remarks.end());
  return built;
}

BuiltModel build_model(const scene::Scene& scene) { return build_model(load_anatomy(scene)); }

}  // namespace repose::model
