#include "repose/meshtools/remesh.h"

#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Surface_mesh.h>

#include <Eigen/Geometry>
#include <cmath>

#include "../surface/cgal.h"
#include "repose/base/error.h"
#include "repose/surface/component.h"

namespace repose::meshtools {
using namespace surface;
namespace {

using Mesh = CGAL::Surface_mesh<Point3>;

Mesh mesh_of(const Surface& surface) {
  Mesh mesh;
  std::vector<Mesh::Vertex_index> vertex;
  for (const Vec3& point : surface.points) vertex.push_back(mesh.add_vertex(to_cgal(point)));
  for (const auto& [a, b, c] : surface.triangles)
    if (mesh.add_face(vertex[a], vertex[b], vertex[c]) == Mesh::null_face())
      throw base::InternalError(surface.name + ": a surface to be remeshed is not manifold");
  return mesh;
}

}  // namespace

double even_edge(const Surface& surface) {
  const double triangle = area_of(surface) / static_cast<double>(surface.triangles.size());
  return std::sqrt(4 * triangle / std::sqrt(3.0));
}

Surface remesh(const Surface& surface, double edge) {
  constexpr unsigned rounds = 3;
  Mesh mesh = mesh_of(surface);
  CGAL::Polygon_mesh_processing::isotropic_remeshing(
      faces(mesh), edge, mesh, CGAL::parameters::number_of_iterations(rounds));
  mesh.collect_garbage();
  Surface result = surface_of(mesh, surface.name);
  if (result.triangles.empty())
    base::refuse("{}: nothing is left of the surface with edges of {:g} mm; ask for shorter ones",
                 surface.name, edge);
  return result;
}

}  // namespace repose::meshtools
