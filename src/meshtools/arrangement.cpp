#include "arrangement.h"

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/intersections.h>

#include <algorithm>

#include "../surface/cgal.h"
#include "repose/base/error.h"
#include "repose/surface/edges.h"
#include "repose/surface/intersections.h"

namespace repose::meshtools {
using namespace surface;
namespace {

using Exact = CGAL::Exact_predicates_exact_constructions_kernel;
using ExactPoint = Exact::Point_3;
using Mesh = CGAL::Surface_mesh<ExactPoint>;

Mesh exact_mesh(const Surface& surface) {
  Mesh mesh;
  for (const Vec3& p : surface.points) mesh.add_vertex({p.x(), p.y(), p.z()});
  using Vertex = Mesh::Vertex_index;
  for (const Triangle& t : surface.triangles)
    mesh.add_face(Vertex(t[0]), Vertex(t[1]), Vertex(t[2]));
  return mesh;
}

/// Corefinement would go astray where triangles that intersect each other are cut.
void refuse_tangled(const Surface& bone, const std::vector<Surface>& sheets) {
  const auto meets = [&](int64_t row) {
    const Triangle3 triangle = to_cgal(bone, bone.triangles[row]);
    return std::any_of(sheets.begin(), sheets.end(), [&](const Surface& sheet) {
      return std::any_of(sheet.triangles.begin(), sheet.triangles.end(), [&](const Triangle& t) {
        return CGAL::do_intersect(triangle, to_cgal(sheet, t));
      });
    });
  };
  for (const auto& [a, b] : self_intersections(bone))
    if (meets(a) || meets(b))
      base::refuse(
          "{}: the surface intersects itself where the cut runs (triangles {} and {}); repair it "
          "in a mesh editor or cut elsewhere",
          bone.name, a, b);
}

/// Cuts all meshes along the lines in which any two of them meet: the sheets (from 1 on) among
/// themselves first, while they have few triangles.
void refine(std::vector<Mesh>& meshes) {
  for (size_t i = 1; i < meshes.size(); ++i)
    for (size_t j = i + 1; j < meshes.size(); ++j)
      CGAL::Polygon_mesh_processing::corefine(meshes[i], meshes[j]);
  for (size_t i = 1; i < meshes.size(); ++i)
    CGAL::Polygon_mesh_processing::corefine(meshes[0], meshes[i]);
}

/// The triangles of several meshes on one list of points, equal points being one.
class Joined {
 public:
  explicit Joined(const std::vector<Mesh>& meshes) {
    std::vector<int64_t> first;
    std::vector<ExactPoint> all;
    for (const Mesh& mesh : meshes) {
      first.push_back(std::ssize(all));
      for (const auto vertex : mesh.vertices()) all.push_back(mesh.point(vertex));
    }
    const std::vector<int64_t> number = join(all);
    for (size_t m = 0; m < meshes.size(); ++m)
      for (const auto face : meshes[m].faces()) {
        const auto h = meshes[m].halfedge(face);
        const auto row = [&](auto vertex) { return number[first[m] + vertex.idx()]; };
        triangles.push_back({row(meshes[m].source(h)), row(meshes[m].target(h)),
                             row(meshes[m].target(meshes[m].next(h)))});
        mesh_of.push_back(static_cast<int32_t>(m));
      }
  }

  std::vector<ExactPoint> points;
  std::vector<Triangle> triangles;
  std::vector<int32_t> mesh_of;

 private:
  /// Fills `points`; returns the row there of each of `all`.
  std::vector<int64_t> join(const std::vector<ExactPoint>& all) {
    std::vector<int64_t> order = base::all_rows(all.size()), number(all.size());
    std::sort(order.begin(), order.end(), [&](int64_t a, int64_t b) {
      return CGAL::compare_xyz(all[a], all[b]) == CGAL::SMALLER;
    });
    for (const int64_t i : order) {
      if (points.empty() || points.back() != all[i]) points.push_back(all[i]);
      number[i] = std::ssize(points) - 1;
    }
    return number;
  }
};

/// The triangles at an edge in the order of their angle about it, from the first one on.
class Around {
 public:
  Around(const Joined& all, const HalfEdge& any, const std::string& name)
      : all_(all),
        low_(all.points[any.low]),
        high_(all.points[any.high]),
        zero_(apex(any)),
        name_(name) {}

  void sort(std::vector<HalfEdge>& fan) const {
    std::sort(fan.begin() + 1, fan.end(), [&](const HalfEdge& a, const HalfEdge& b) {
      const int half = half_of(a), other = half_of(b);
      return half != other ? half < other
                           : CGAL::orientation(low_, high_, apex(a), apex(b)) == CGAL::POSITIVE;
    });
    for (size_t k = 0; k < fan.size(); ++k) refuse_overlap(fan[k], fan[(k + 1) % fan.size()]);
  }

 private:
  const ExactPoint& apex(const HalfEdge& h) const {
    return all_.points[all_.triangles[h.triangle][(h.corner + 2) % 3]];
  }

  /// Angle −1: 0, 0: in (0, π), 1: π, 2: in (π, 2π).
  int half_of(const HalfEdge& h) const {
    const auto side = CGAL::orientation(low_, high_, zero_, apex(h));
    if (side != CGAL::COPLANAR) return 1 - static_cast<int>(side);
    const auto same = CGAL::coplanar_orientation(low_, high_, zero_, apex(h));
    return same == CGAL::POSITIVE ? -1 : 1;
  }

  void refuse_overlap(const HalfEdge& a, const HalfEdge& b) const {
    if (CGAL::orientation(low_, high_, apex(a), apex(b)) != CGAL::COPLANAR ||
        CGAL::coplanar_orientation(low_, high_, apex(a), apex(b)) != CGAL::POSITIVE)
      return;
    base::refuse("{}: a cut runs along triangles of the surface; shift it by 0.01 mm", name_);
  }

  const Joined& all_;
  const ExactPoint &low_, &high_, &zero_;
  const std::string& name_;
};

/// The two sides of each triangle (2 t in front, 2 t + 1 behind) united to cells: around every edge
/// a triangle's side and the facing side of the next triangle bound the same cell.
UnionFind unite_sides(const Joined& all, const EdgeTable& edges, const std::string& name) {
  UnionFind cells(2 * std::ssize(all.triangles));
  // A triangle that runs from low to high has its front towards greater angles.
  const auto ahead = [](const HalfEdge& h) { return 2 * h.triangle + (h.rising ? 0 : 1); };
  const auto behind = [](const HalfEdge& h) { return 2 * h.triangle + (h.rising ? 1 : 0); };
  for (int64_t e = 0; e < edges.edges(); ++e) {
    std::vector<HalfEdge> fan(edges[e].begin(), edges[e].end());
    if (fan.size() > 2) Around(all, fan[0], name).sort(fan);
    for (size_t k = 0; k < fan.size(); ++k)
      cells.unite(ahead(fan[k]), behind(fan[(k + 1) % fan.size()]));
  }
  return cells;
}

/// For each triangle whether it hangs together with the bone over edges.
std::vector<bool> on_the_bone(const Joined& all, const EdgeTable& edges) {
  const auto count = std::ssize(all.triangles);
  UnionFind parts = connected(all.triangles, edges);
  std::vector<bool> with_bone(count, false), result(count, false);
  for (int64_t t = 0; t < count; ++t)
    if (all.mesh_of[t] == 0) with_bone[parts.find(t)] = true;
  for (int64_t t = 0; t < count; ++t) result[t] = with_bone[parts.find(t)];
  return result;
}

Vec3 rounded(const ExactPoint& point) {
  const auto& p = CGAL::exact(point);
  return {CGAL::to_double(p.x()), CGAL::to_double(p.y()), CGAL::to_double(p.z())};
}

}  // namespace

Arrangement arrange(const Surface& bone, const std::vector<Surface>& sheets) {
  refuse_tangled(bone, sheets);
  std::vector<Mesh> meshes{exact_mesh(bone)};
  for (const Surface& sheet : sheets) meshes.push_back(exact_mesh(sheet));
  refine(meshes);
  const Joined all(meshes);
  const EdgeTable edges(all.triangles);
  UnionFind cells = unite_sides(all, edges, bone.name);
  const std::vector<bool> kept = on_the_bone(all, edges);

  Arrangement result;
  for (const ExactPoint& p : all.points) result.points.push_back(rounded(p));
  for (size_t t = 0; t < all.triangles.size(); ++t) {
    if (!kept[t]) continue;
    const auto side = 2 * static_cast<int64_t>(t);
    result.triangles.push_back(all.triangles[t]);
    result.origin.push_back(all.mesh_of[t] - 1);
    result.cells.push_back({cells.find(side), cells.find(side + 1)});
  }
  return result;
}

}  // namespace repose::meshtools
