#include "repose/model/solved_skin.h"

#include <fmt/format.h>

#include "repose/surface/face.h"

namespace repose::model {
namespace {

surface::FaceRequest request_of(const Anatomy& anatomy) {
  const scene::Scene& scene = anatomy.scene;
  const double edge = *scene.tissue.edge;
  surface::FaceRequest request{edge > 0 ? edge : surface::edge_for(anatomy.skin)};
  if (!scene.instruments.empty()) return request;
  for (size_t b = 0; b < anatomy.bones.size(); ++b)
    if (!scene.moves[b].is_identity()) request.beneath.push_back(anatomy.bones[b]);
  for (const scene::Force& force : scene.forces) request.places.push_back(force.at);
  for (const scene::Incision& cut : scene.incisions)
    request.places.insert(request.places.end(), cut.path.begin(), cut.path.end());
  return request;
}

}  // namespace

void solve_remeshed(Anatomy& anatomy) {
  const surface::FaceRequest request = request_of(anatomy);
  surface::Face face = surface::solvable_face(anatomy.skin, request);
  anatomy.remarks.push_back(fmt::format(
      "the skin that is solved has {} vertices with edges of {:.3g} mm, no angle below {:.0f}°; of "
      "them 95 % lie within {:.2f} mm of the given skin ({} triangles), all within {:.2f} mm",
      face.skin.points.size(), request.edge, face.least_angle, face.off_95,
      anatomy.skin.triangles.size(), face.off_most));
  anatomy.given_skin = std::move(anatomy.skin);
  anatomy.skin = std::move(face.skin);
}

}  // namespace repose::model
