#include "plan_pieces.h"

#include <algorithm>

#include "report.h"
#include "repose/base/agreement.h"
#include "repose/model/material.h"

namespace repose::app {

namespace {

/// On rank 0.
std::vector<solve::PlanPiece> find_pieces(const Job& job) {
  const model::Model& model = job.local_model.global_metadata;
  const scene::Plan* plan =
      job.anatomy && job.anatomy->scene.plan ? &*job.anatomy->scene.plan : nullptr;
  std::vector<solve::PlanPiece> pieces;
  for (size_t b = 0; b < model.bone_transform.size(); ++b) {
    const auto motion = scene::RigidMotion::from_matrix(model.bone_transform[b]);
    if (plan ? !std::ranges::binary_search(plan->pieces, b) : motion.is_identity()) continue;
    const surface::Surface& bone = model.bone_surfaces[b];
    const Vec3 centroid = scene::centroid(bone.points, bone.triangles);
    pieces.push_back({static_cast<int32_t>(b), centroid, scene::placement_of(motion, centroid)});
  }
  return pieces;
}

/// From the skin down.
std::vector<solve::Stratum> strata_of(const scene::Material& material) {
  std::vector<solve::Stratum> strata;
  const auto add = [&](double thickness, const scene::Elasticity& elasticity) {
    const model::Moduli moduli = model::moduli(elasticity);
    strata.push_back({thickness, moduli.shear, moduli.volume});
  };
  for (const scene::Stratum& stratum : material.strata) add(stratum.thickness, stratum.elasticity);
  add(0, material.deep);
  return strata;
}

}  // namespace

solve::Derivatives plan_derivatives(MPI_Comm comm, const Job& job) {
  solve::Derivatives by;
  base::on_root(comm, [&] { by.pieces = find_pieces(job); });
  base::broadcast(comm, by.pieces);
  if (!job.material || job.reference_state || job.material->dilatation == scene::Dilatation::nodal)
    return by;
  const model::Model& model = job.local_model.part.model;
  by.strata = strata_of(*job.material);
  by.in_region = model::in_regions(job.material->regions, model);
  by.support_shares = model::support_shares(*job.material, model);
  return by;
}

std::string describe_tangents(const std::vector<model::PointField>& fields) {
  int columns = 0, found = 0;
  bool of_strata = false;
  for (const model::PointField& field : fields) {
    if (!field.name.starts_with("tangent_")) continue;
    ++columns;
    of_strata = of_strata || field.name.starts_with("tangent_young");
    found += std::ranges::all_of(field.flags, [](const auto& flag) { return flag.second; });
  }
  if (columns == 0) return "";
  const std::string missing =
      found == columns ? "" : "; the others are 0, and their flags finished and convex say why";
  return report_row("tangents", "{} of {} derivatives by motions of pieces{}{}", found, columns,
                    of_strata ? " and stiffnesses of strata"
                              : "; none by stiffnesses, which need a scene with tissue.material, "
                                "without turgor, gravity and dilatation: nodal",
                    missing);
}

}  // namespace repose::app
