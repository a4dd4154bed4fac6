#include "repose/model/build.h"

#include "column_layout.h"
#include "region.h"
#include "repose/anatomy/complete.h"
#include "repose/base/log.h"
#include "repose/model/collision.h"
#include "repose/surface/read.h"
#include "solved_skin.h"

namespace repose::model {

BuiltModel build_model(const scene::Scene& scene, const surface::Surface& skin,
                       const std::vector<surface::Surface>& bones) {
  return ColumnGeometry(scene, skin, bones).build_whole();
}

Anatomy load_anatomy(const scene::Scene& scene) {
  static const PetscLogEvent event = base::log_event("RpSurfaces");
  const base::Logged logged(event);
  GivenSkin given = load_skin(scene);
  check_painted_meshes(scene.tissue, given.surface);
  Anatomy anatomy{scene, std::move(given.surface), {}, {}, {}, {}};
  Bones bones = read_bones(scene, &anatomy.skin);
  anatomy.bones = std::move(bones.surfaces);
  anatomy.remarks = std::move(bones.remarks);
  anatomy.warnings = std::move(bones.warnings);
  anatomy.remarks.insert(anatomy.remarks.end(), scene.remarks.begin(), scene.remarks.end());
  anatomy.warnings.insert(anatomy.warnings.end(), scene.warnings.begin(), scene.warnings.end());
  anatomy::complete(anatomy.skin, anatomy.scene, anatomy.remarks);
  anatomy.move_warnings =
      resolve_collisions(anatomy.bones, anatomy.scene, anatomy.remarks, anatomy.warnings);
  if (scene.tissue.edge)
    remesh_skin(anatomy);
  else if (!given.obstacle.empty() && !replace_given_skin(anatomy, given.obstacle))
    anatomy.skin = surface::accept_surface(anatomy.skin, surface::Role::skin);
  return anatomy;
}

BuiltModel build_model(const Anatomy& anatomy) { return ColumnGeometry(anatomy).build_whole(); }

BuiltModel build_model(const scene::Scene& scene) {
  Anatomy anatomy = load_anatomy(scene);
  return build_on_solvable_skin(anatomy, [](const Anatomy& on) { return build_model(on); });
}

}  // namespace repose::model
