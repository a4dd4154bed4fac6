#include "directions.h"

#include <algorithm>
#include <cmath>

#include "repose/model/skin_mesh.h"
#include "smoothing.h"

namespace repose::model {
namespace {

constexpr double target_cosine = 0.3;     // 72.5° to each triangle's normal
constexpr double smallest_cosine = 0.02;  // of the cone's axis: below it the skin is folded
constexpr int local_rounds = 4;

/// The triangle around `v` whose inward normal is furthest from `u`: its unit normal and cosine.
std::pair<Vec3, double> worst_normal(const SkinMesh& mesh, int64_t v, const Vec3& u) {
  std::pair<Vec3, double> worst{Vec3::Zero(), 2.0};
  for (const int64_t f : mesh.triangles_of[v]) {
    const Vec3 n = mesh.triangle_normal[f].normalized();
    if (n.dot(u) < worst.second) worst = {n, n.dot(u)};
  }
  return worst;
}

/// Center of the smallest cap that holds all normals around `v` (Badoiu & Clarkson 2003: step
/// towards the furthest by 1/k), the direction with the largest smallest cosine.
Cone widest_cone(const SkinMesh& mesh, int64_t v) {
  Vec3 axis = mesh.vertex_normal[v];
  Cone best{axis, worst_normal(mesh, v, axis).second};
  for (int k = 2; k < 200 && best.cosine < 0.7; ++k) {
    axis = (axis + (worst_normal(mesh, v, axis).first - axis) / k).normalized();
    const double cosine = worst_normal(mesh, v, axis).second;
    if (cosine > best.cosine) best = {axis, cosine};
  }
  return best;
}

/// The direction near `u` that lies in the cone: pushed inwards along the normals it violates,
/// and turned to the axis where that does not end.
Vec3 into_cone(const SkinMesh& mesh, int64_t v, const Cone& cone, Vec3 u) {
  for (int round = 0; round < 20; ++round) {
    const auto [normal, cosine] = worst_normal(mesh, v, u);
    if (cosine >= cone.cosine) return u;
    u = (u + (1.05 * (cone.cosine - cosine) + 1e-3) * normal).normalized();
  }
  for (const double part : {0.25, 0.5, 0.75}) {
    Vec3 turned = (u + part * (cone.axis - u)).normalized();
    if (worst_normal(mesh, v, turned).second >= cone.cosine) return turned;
  }
  return cone.axis;
}

/// 0 where the nearest bone says nothing about the direction, 1 where it says all.
double trust(const Vec3& normal, const Vec3& towards, double distance, double attach_within) {
  const double inward = std::clamp((normal.dot(towards) - 0.3) / 0.5, 0.0, 1.0);
  const double near = std::clamp(3.0 - 2.5 * distance / attach_within, 0.0, 1.0);
  return inward * near;
}

}  // namespace

void bend(const SkinMesh& mesh, const std::vector<Cone>& cones,
          const std::vector<int64_t>& vertices, std::vector<Vec3>& directions) {
  const std::vector<Vec3> old = directions;
  for (const int64_t v : vertices) {
    Vec3 sum = Vec3::Zero();
    for (const int64_t e : mesh.edges_of[v]) sum += old[mesh.other_end(e, v)];
    sum /= static_cast<double>(mesh.edges_of[v].size());
    directions[v] = into_cone(mesh, v, cones[v], (old[v] + sum).normalized());
  }
}

std::vector<Cone> inward_cones(const SkinMesh& mesh, const std::string& skin_name) {
  std::vector<Cone> cones(mesh.points.size());
  std::vector<int64_t> folded;
  for (size_t v = 0; v < cones.size(); ++v) {
    cones[v] = widest_cone(mesh, v);
    if (!(cones[v].cosine >= smallest_cosine)) folded.push_back(static_cast<int64_t>(v));
    cones[v].cosine = std::min(target_cosine, 0.7 * cones[v].cosine);
  }
  if (!folded.empty())
    refuse_places(skin_name, mesh, folded,
                  "the skin is folded (no direction is inward of all triangles around a vertex)",
                  "leave tissue.edge to the program, or smooth it there");
  return cones;
}

std::vector<Vec3> column_directions(const SkinMesh& mesh, const std::vector<Cone>& cones,
                                    const std::vector<BoneField::Nearest>& nearest,
                                    double attach_within, const std::vector<double>& length) {
  const auto vertices = static_cast<int64_t>(mesh.points.size());
  Eigen::MatrixXd requested(vertices, 3);
  std::vector<double> weight(vertices);
  for (int64_t v = 0; v < vertices; ++v) {
    const Vec3& normal = mesh.vertex_normal[v];
    const Vec3 towards = (nearest[v].point - mesh.points[v]).normalized();
    const double t = trust(normal, towards, nearest[v].distance, attach_within);
    requested.row(v) = (t * towards + (1 - t) * normal).normalized();
    weight[v] = 0.2 + 0.8 * t;
  }
  const Eigen::MatrixXd smoothed = smooth_field(mesh, requested, weight, length);
  std::vector<Vec3> directions(vertices);
  for (int64_t v = 0; v < vertices; ++v)
    directions[v] = into_cone(mesh, v, cones[v], smoothed.row(v).transpose().normalized());
  const std::vector<int64_t> all = base::all_rows(directions.size());
  for (int round = 0; round < local_rounds; ++round) bend(mesh, cones, all, directions);
  return directions;
}

}  // namespace repose::model
