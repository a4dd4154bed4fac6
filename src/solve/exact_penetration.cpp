#include "exact_penetration.h"

#include <algorithm>

#include "repose/base/agreement.h"

namespace repose::solve {

ExactPenetration::ExactPenetration(const discrete::Part& part)
    : part_(part), meshes_(part.body_meshes.size()) {}

/// mm inside a body, 0 outside, of a point given by RigidBody::beside().
double ExactPenetration::depth(size_t body, const mechanics::RigidBody& shape, const Vec3& beside) {
  const surface::Surface& mesh = part_.body_meshes[body];
  if (mesh.triangles.empty()) return std::max(0.0, -shape.distance(beside).value);
  if (!meshes_[body]) meshes_[body] = std::make_unique<model::MeshDepth>(mesh);
  return meshes_[body]->at(beside);
}

void ExactPenetration::measure_own(discrete::Objective& objective,
                                   std::vector<PenetrationDepth>& depths) {
  const std::vector<mechanics::RigidBody>& bodies = objective.contact().bodies().bodies();
  const model::ContactPairs& body_contact = part_.model.contact.pairs;
  for (size_t c = 0; c < body_contact.point.size(); ++c) {
    const int32_t body = body_contact.body[c];
    const Vec3& now = objective.positions().local()[body_contact.point[c]];
    const Vec3 beside = bodies[body].beside(now);
    if (bodies[body].lower_bound(beside, 0) > 0) continue;
    double deeper = depth(body, bodies[body], beside);
    if (deeper > 0)
      deeper -= depth(body, bodies[body], part_.model.points.position[body_contact.point[c]]);
    PenetrationDepth& on = depths[body];
    on.points += deeper > PenetrationDepth::reported;
    if (deeper <= on.deepest) continue;
    on.deepest = deeper;
    on.where = now;
  }
}

std::vector<PenetrationDepth> ExactPenetration::measure(discrete::Objective& objective) {
  MPI_Comm comm = objective.positions().comm();
  std::vector<PenetrationDepth> depths(part_.bodies.size());
  base::collective_try(comm, [&] { measure_own(objective, depths); });
  for (PenetrationDepth& on : depths) {
    on.points = base::sum_over_ranks(comm, on.points);
    on.deepest = base::max_over_ranks_with(comm, on.deepest, on.where);
  }
  return depths;
}

}  // namespace repose::solve
