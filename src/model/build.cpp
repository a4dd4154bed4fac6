#include "repose/model/build.h"

#include "add_contact.h"
#include "column_layout.h"
#include "layers.h"
#include "load_entry.h"
#include "loads.h"
#include "point_sets.h"
#include "repose/anatomy/complete.h"
#include "repose/base/error.h"
#include "repose/base/log.h"
#include "repose/model/collision.h"
#include "repose/model/instruments.h"
#include "repose/model/material.h"
#include "repose/model/stiffness.h"
#include "solved_skin.h"

namespace repose::model {
namespace {

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

/// Adds the properties of points and elements.
void complete(const scene::Scene& scene, const SkinMesh& mesh, Model& model) {
  const std::string file = scene.file.string();
  if (scene.tissue.material)
    require_regions(set_material(scene.tissue, file, model), file);
  else
    set_stiffness(scene.tissue, mesh, model);
  set_masses(scene.tissue, mesh, model);
  distribute_forces(scene, mesh, model);
  model.gravity = scene.gravity.value_or(Vec3::Zero());
}

}  // namespace

BuiltModel build_model(const scene::Scene& scene, const surface::Surface& skin,
                       const std::vector<surface::Surface>& bones) {
  ColumnLayout on = lay_out_columns(scene, skin, bones);
  BuiltModel built;
  built.model =
      make_layers(on.mesh, on.columns.deep, layer_depths(scene.tissue), scene.tissue.depths_mm,
                  scene.tissue.material ? Elements::solid : Elements::springs);
  set_points(on.rim, on.attachment, scene.moves, built.model);
  built.held = hold_by_instruments(scene, built.model);
  require_free_cuts(scene, on.cuts, built.model);
  const Counts counts = count(built.model);
  require_held(scene, on.mesh, on.field, counts, on.attachment);
  complete(scene, on.mesh, built.model);
  add_bones(scene, bones, built.model);
  add_contact(scene, on, built.model);
  built.cuts = std::move(on.cuts);
  built.report = on.report;
  report_columns(on, counts.bone, built.report);
  built.report.effective_modulus = effective_modulus(built.model);
  return built;
}

Anatomy load_anatomy(const scene::Scene& scene) {
  static const PetscLogEvent event = base::log_event("RpSurfaces");
  const base::Logged logged(event);
  GivenSkin given = load_skin(scene);
  Anatomy anatomy{scene, std::move(given.surface), {}, {}, {}, {}};
  Bones bones = read_bones(scene);
  anatomy.bones = std::move(bones.surfaces);
  anatomy.remarks = std::move(bones.remarks);
  anatomy.warnings = std::move(bones.warnings);
  anatomy.remarks.insert(anatomy.remarks.end(), scene.remarks.begin(), scene.remarks.end());
  anatomy::complete(anatomy.skin, anatomy.bones, anatomy.scene, anatomy.remarks);
  resolve_collisions(anatomy.bones, anatomy.scene, anatomy.remarks);
  report_initial_overlaps(anatomy.bones, scene, anatomy.warnings);
  if (scene.tissue.edge)
    remesh_skin(anatomy);
  else if (!given.obstacle.empty() && !replace_given_skin(anatomy, given.obstacle))
    anatomy.skin = surface::accept_surface(anatomy.skin, surface::Role::skin);
  return anatomy;
}

BuiltModel build_model(const Anatomy& anatomy) {
  static const PetscLogEvent event = base::log_event("RpBuild");
  const base::Logged logged(event);
  BuiltModel built = build_model(anatomy.scene, anatomy.skin, anatomy.bones);
  prepend_messages(anatomy, built.report);
  return built;
}

BuiltModel build_model(const scene::Scene& scene) {
  Anatomy anatomy = load_anatomy(scene);
  return build_on_solvable_skin(anatomy, [](const Anatomy& on) { return build_model(on); });
}

}  // namespace repose::model
