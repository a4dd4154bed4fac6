#include <CGAL/Labeled_mesh_domain_3.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/facets_in_complex_3_to_triangle_mesh.h>
#include <CGAL/make_mesh_3.h>

#include <Eigen/Dense>
#include <algorithm>

#include "../../surface/cgal.h"
#include "phantom_shape.h"
#include "repose/base/error.h"
#include "repose/surface/read.h"
#include "repose/tools/phantom/phantom.h"

namespace repose::tools::phantom {
using namespace surface;
namespace {

using Domain = CGAL::Labeled_mesh_domain_3<Kernel>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain>::type;
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;

/// Bound on a triangle's circumradius: for edges of the length requested around the face and the
/// jaw's joint, growing behind them to four times that.
struct Sizing {
  using FT = Kernel::FT;
  double edge;
  FT operator()(const Point3& point, int, const Domain::Index&) const {
    const double behind = (from_cgal(point) - Vec3(0, -50, 0)).norm() - 95;
    return 0.75 * edge * std::clamp(1 + behind / 25, 1.0, 4.0);
  }
};

Surface mesh_bone(double (*distance)(const Vec3&), double edge, const char* name) {
  if (!(edge >= phantom_bone_edge_min && edge <= phantom_bone_edge_max))
    base::refuse("bone_edge: {} mm is not in {} … {} mm", edge, phantom_bone_edge_min,
                 phantom_bone_edge_max);
  namespace parameters = CGAL::parameters;
  const auto inside = [distance](const Point3& point) { return distance(from_cgal(point)); };
  const Domain domain =
      Domain::create_implicit_mesh_domain(inside, Kernel::Sphere_3(Point3(0, 0, 40), 160.0 * 160.0),
                                          parameters::relative_error_bound = 1e-7);
  const double deviation = std::min(0.12 * edge, 0.6);
  const Criteria criteria(Criteria::Facet_criteria(25, Sizing{edge}, deviation),
                          Criteria::Cell_criteria(0, 0));
  const Complex complex = CGAL::make_mesh_3<Complex>(
      domain, criteria, parameters::no_perturb(), parameters::no_exude(), parameters::manifold());
  CGAL::Surface_mesh<Point3> mesh;
  CGAL::facets_in_complex_3_to_triangle_mesh(complex, mesh);
  return weld_and_orient(surface_of(mesh, name));  // CGAL leaves open which side is out
}

}  // namespace

Surface make_phantom_skull(double edge) { return mesh_bone(skull_distance, edge, "phantom skull"); }

Surface make_phantom_mandible(double edge) {
  return mesh_bone(mandible_distance, edge, "phantom mandible");
}

}  // namespace repose::tools::phantom
