#include <utility>

#include "repose/model/skin_mesh.h"
#include "repose/surface/component.h"

namespace repose::model {
namespace {

std::vector<std::vector<int64_t>> groups_of(const SkinMesh& mesh,
                                            const std::vector<int64_t>& vertices) {
  std::vector<char> open(mesh.points.size(), 0);
  for (const int64_t v : vertices) open[v] = 1;
  std::vector<std::vector<int64_t>> groups;
  for (const int64_t v : vertices) {
    if (!open[v]) continue;
    open[v] = 0;
    groups.push_back({v});
    for (size_t next = 0; next < groups.back().size(); ++next)
      for (const int64_t e : mesh.edges_of[groups.back()[next]]) {
        const int64_t other = mesh.other_end(e, groups.back()[next]);
        if (!open[other]) continue;
        open[other] = 0;
        groups.back().push_back(other);
      }
  }
  return groups;
}

surface::Surface surface_at(const SkinMesh& mesh, const std::vector<int64_t>& vertices) {
  std::vector<Triangle> triangles;
  std::vector<char> taken(mesh.triangles.size(), 0);
  for (const int64_t v : vertices)
    for (const int64_t f : mesh.triangles_of[v])
      if (!std::exchange(taken[f], 1)) triangles.push_back(mesh.triangles[f]);
  return surface::compact("places", mesh.points, std::move(triangles));
}

}  // namespace

void refuse_places(const std::string& skin_name, const SkinMesh& mesh,
                   const std::vector<int64_t>& vertices, const std::string& what,
                   const std::string& remedy) {
  const auto groups = groups_of(mesh, vertices);
  std::string list;
  for (const std::vector<int64_t>& group : groups) {
    const Vec3& at = mesh.points[group.front()];
    list += fmt::format("{}vertex {} {:.2f}", list.empty() ? "" : ", ", group.front(), at);
    if (group.size() > 1) list += fmt::format(" and {} more around it", group.size() - 1);
  }
  throw RefusedPlaces(fmt::format("{}: {} in {} place{}, skin {}; {}", skin_name, what,
                                  groups.size(), groups.size() == 1 ? "" : "s", list, remedy),
                      what, surface_at(mesh, vertices));
}

}  // namespace repose::model
