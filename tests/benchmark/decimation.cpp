/// CGAL's ways to decimate, for comparison, and one measure for the results of all:
///     benchmark_decimation lindstrom_turk IN.ply OUT.ply TRIANGLES     plain edge collapse
///     benchmark_decimation garland_heckbert IN.ply OUT.ply TRIANGLES   plain edge collapse
///     benchmark_decimation envelope IN.ply OUT.ply DISTANCE            within CGAL's envelope
///     benchmark_decimation measure IN.ply RESULT.ply …                 distances and defects
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/distance.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/GarlandHeckbert_plane_policies.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_cost.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_placement.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Polyhedral_envelope_filter.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include <cstdio>
#include <string>

#include "repose/surface/defects.h"
#include "repose/surface/read.h"
#include "repose/tools/decimation/hausdorff.h"

namespace {

using namespace repose;
namespace sms = CGAL::Surface_mesh_simplification;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

Mesh to_cgal(const surface::Surface& surface) {
  Mesh mesh;
  for (const Vec3& p : surface.points) mesh.add_vertex({p.x(), p.y(), p.z()});
  for (const auto& t : surface.triangles)
    mesh.add_face(Mesh::Vertex_index(t[0]), Mesh::Vertex_index(t[1]), Mesh::Vertex_index(t[2]));
  return mesh;
}

surface::Surface from_cgal(Mesh& mesh) {
  mesh.collect_garbage();
  surface::Surface surface{"decimated", {}, {}};
  for (const auto v : mesh.vertices()) {
    const auto& p = mesh.point(v);
    surface.points.emplace_back(p.x(), p.y(), p.z());
  }
  for (const auto f : mesh.faces()) {
    Triangle triangle{};
    int k = 0;
    for (const auto v : mesh.vertices_around_face(mesh.halfedge(f)))
      triangle[k++] = static_cast<int64_t>(v.idx());
    surface.triangles.push_back(triangle);
  }
  return surface;
}

void collapse(const std::string& how, Mesh& mesh, double number) {
  const sms::Count_stop_predicate<Mesh> count(static_cast<size_t>(1.5 * number));
  if (how == "lindstrom_turk") {
    sms::edge_collapse(mesh, count);
  } else if (how == "garland_heckbert") {
    const sms::GarlandHeckbert_plane_policies<Mesh, Kernel> policies(mesh);
    sms::edge_collapse(
        mesh, count,
        CGAL::parameters::get_cost(policies.get_cost()).get_placement(policies.get_placement()));
  } else {
    const sms::Polyhedral_envelope_filter<Kernel> filter(number);
    sms::edge_collapse(mesh, sms::Count_stop_predicate<Mesh>(0), CGAL::parameters::filter(filter));
  }
}

/// triangles, distance to the input (lower, upper), CGAL's figure for it, from the input, defects
void measure(const surface::Surface& input, const std::string& file) {
  const surface::Surface result = surface::read_surface(file);
  const auto to = tools::decimation::one_sided_distance(result, input, 1e-3);
  const auto from = tools::decimation::one_sided_distance(input, result, 1e-2);
  const surface::Defects defects = surface::inspect(result);
  double cgal = NAN;
  if (defects.non_manifold_edges + defects.non_manifold_vertices + defects.misoriented_edges == 0)
    cgal = CGAL::Polygon_mesh_processing::bounded_error_Hausdorff_distance<CGAL::Sequential_tag>(
        to_cgal(result), to_cgal(input), 1e-3);
  std::printf("%zu\t%.5f\t%.5f\t%.5f\t%.4f\t%s\n", result.triangles.size(), to.lower, to.upper,
              cgal, from.upper, describe(defects).c_str());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return 1;
  const std::string how = argv[1];
  const surface::Surface input = surface::weld_and_orient(surface::read_surface(argv[2]));
  if (how == "measure") {
    for (int i = 3; i < argc; ++i) measure(input, argv[i]);
    return 0;
  }
  Mesh mesh = to_cgal(input);
  collapse(how, mesh, std::stod(argv[4]));
  surface::write_ply(argv[3], from_cgal(mesh));
  return 0;
}
