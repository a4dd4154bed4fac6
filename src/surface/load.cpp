#include "repose/base/error.h"
#include "repose/surface/defects.h"
#include "repose/surface/edges.h"
#include "repose/surface/read.h"

namespace repose::surface {
namespace {

constexpr double min_size = 2, largest_size = 2000;  // mm, bounding diagonal

const char* noun(Role role) {
  return role == Role::skin ? "skin" : role == Role::bone ? "bone" : "mesh";
}

std::string position(const Surface& surface, int64_t vertex) {
  const Vec3& p = surface.points[vertex];
  return fmt::format("{:.2f} mm", p);
}

void check_size(const Surface& surface) {
  const double size = bounding_diagonal(surface.points);
  if (size >= min_size && size <= largest_size) return;
  const bool small = size < min_size;
  base::refuse(
      "{}: {:.4g} mm across (bounding diagonal), expected {} to {} mm: it seems to be in "
      "{}; scale the mesh to millimeters ({})",
      surface.name, size, min_size, largest_size, small ? "meters" : "micrometers",
      small ? "times 1000" : "divided by 1000");
}

void check_manifold(const Surface& surface, const Defects& d, Role role) {
  if (d.non_manifold_edges > 0)
    base::refuse(
        "{}: {} non-manifold edge(s) (more than two triangles), the first from {} to {}; "
        "a {} must be manifold: repair it in a mesh editor",
        surface.name, d.non_manifold_edges, position(surface, d.first_non_manifold_edge[0]),
        position(surface, d.first_non_manifold_edge[1]), noun(role));
  if (d.non_manifold_vertices > 0)
    base::refuse(
        "{}: {} non-manifold vertex(es) (sheets that touch in a point only), the first at "
        "{}; a {} must be manifold: repair it in a mesh editor",
        surface.name, d.non_manifold_vertices, position(surface, d.first_non_manifold_vertex),
        noun(role));
  if (d.misoriented_edges > 0)
    base::refuse(
        "{}: {} edge(s) where no consistent orientation is possible (as on a Möbius "
        "strip); a {} must have two sides: repair it in a mesh editor",
        surface.name, d.misoriented_edges, noun(role));
}

void check_one_component(const Surface& surface, const Defects& d) {
  if (d.components == 1) return;
  const auto sizes = component_sizes(surface.triangles, EdgeTable(surface.triangles));
  base::refuse(
      "{}: {} separate components (the largest of {} and {} triangles); a skin must be "
      "one: keep the largest only",
      surface.name, d.components, sizes[0], sizes[1]);
}

void check_closed(const Surface& surface, const Defects& d) {
  if (d.border_loops > 0)
    base::refuse(
        "{}: open: {} border loop(s) of {} edges in all; a bone must be closed: fill the "
        "holes in a mesh editor",
        surface.name, d.border_loops, d.border_edges);
  if (!d.outward)
    base::refuse("{}: closed but encloses no volume; a bone must be a solid: check the mesh",
                 surface.name);
}

}  // namespace

Surface load_surface(const std::filesystem::path& file, Role role) {
  return accept_surface(read_surface(file), role);
}

Surface accept_surface(const Surface& raw, Role role) {
  if (role != Role::mesh) check_size(raw);
  if (role == Role::raw) return raw;
  Surface surface = weld_and_orient(raw);
  if (surface.triangles.empty())
    base::refuse("{}: none of its {} triangles has an area; export the mesh again", surface.name,
                 raw.triangles.size());
  Defects defects = inspect(surface, false);
  if (role == Role::mesh && defects.non_manifold_edges == 0 && defects.non_manifold_vertices > 0) {
    split_fans(surface);
    defects = inspect(surface, false);
  }
  check_manifold(surface, defects, role);
  if (role == Role::skin) check_one_component(surface, defects);
  if (role == Role::bone) check_closed(surface, defects);
  return surface;
}

}  // namespace repose::surface
