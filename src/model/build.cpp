#include "repose/model/build.h"

#include <numeric>

#include "column_layout.h"
#include "repose/anatomy/complete.h"
#include "repose/base/log.h"
#include "repose/model/collision.h"
#include "solved_skin.h"

namespace repose::model {

BuiltModel build_model(const scene::Scene& scene, const surface::Surface& skin,
                       const std::vector<surface::Surface>& bones) {
  const ColumnGeometry geometry(scene, skin, bones);
  BuiltModel built;
  std::vector<int64_t> columns(geometry.skin().points.size()), found;
  std::iota(columns.begin(), columns.end(), 0);
  built.model = build_local(scene, bones, geometry.piece(columns), found);
  require_regions(found, scene.file.string());
  Contact& contact = built.model.contact;
  const std::vector<ColumnSums> sums = column_sums(built.model, geometry.layers());
  contact.stiffness = contact_stiffness(scene, sums);
  contact.spacing = geometry.spacing();
  if (contact.pairs.point.empty()) contact.bodies.clear();
  built.held = geometry.held();
  built.cuts = {geometry.cuts().begin(), geometry.cuts().end()};
  built.report = geometry.report();
  std::erase_if(built.model.elements, [](const auto& elements) { return elements.size() == 0; });
  const std::string adhesion = remark_on_adhesion(scene, built.model);
  if (!adhesion.empty()) built.report.remarks.push_back(adhesion);
  built.report.effective_modulus = effective_modulus(sums);
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
  BuiltModel built = build_model(anatomy.scene, anatomy.skin, anatomy.bones);
  prepend_messages(anatomy, built.report);
  return built;
}

BuiltModel build_model(const scene::Scene& scene) {
  Anatomy anatomy = load_anatomy(scene);
  return build_on_solvable_skin(anatomy, [](const Anatomy& on) { return build_model(on); });
}

}  // namespace repose::model
