#include "repose/meshtools/signed_distance.h"

#include "repose/surface/component.h"
#include "repose/surface/edges.h"
#include "repose/surface/triangle_tree.h"

namespace repose::meshtools {
using namespace surface;
namespace {

constexpr double on_border_of_triangle = 1e-9;  // barycentric

}  // namespace

SignedDistance::SignedDistance(const Surface& surface)
    : surface_(surface),
      tree_(surface),
      vertex_normal_(angle_normals(surface)),
      side_(surface.triangles.size()) {
  for (const Triangle& triangle : surface.triangles)
    face_normal_.push_back(scaled_normal(corners(surface, triangle)).normalized());
  const EdgeTable edges(surface.triangles);
  vertex_on_border_ = border_vertices(edges, surface.points.size());
  for (int64_t e = 0; e < edges.edges(); ++e) {
    Feature side{Vec3::Zero(), edges[e].size() == 1};
    for (const HalfEdge& half : edges[e]) side.normal += face_normal_[half.triangle];
    for (const HalfEdge& half : edges[e]) side_[half.triangle][half.corner] = side;
  }
}

SignedDistance::Feature SignedDistance::feature_at(const DistanceTree::Nearest& nearest) const {
  const Triangle& triangle = surface_.triangles[nearest.triangle];
  const Vec3 weight = barycentric(corners(surface_, triangle), nearest.point);
  const auto small = (weight.array() < on_border_of_triangle).count();
  int smallest = 0, largest = 0;
  weight.minCoeff(&smallest);
  weight.maxCoeff(&largest);
  if (small == 0) return {face_normal_[nearest.triangle], false};
  if (small == 1) return side_[nearest.triangle][(smallest + 1) % 3];
  return {vertex_normal_[triangle[largest]], vertex_on_border_[triangle[largest]] != 0};
}

SignedDistance::Answer SignedDistance::at(const Vec3& point) const {
  const auto nearest = tree_.nearest(point);
  const Feature feature = feature_at(nearest);
  const bool behind = (point - nearest.point).dot(feature.normal) < 0;
  return {behind ? -nearest.distance : nearest.distance, feature.border};
}

}  // namespace repose::meshtools
