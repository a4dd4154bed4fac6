#include "loads.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "layers.h"
#include "repose/base/error.h"
#include "repose/model/instruments.h"

namespace repose::model {
namespace {

/// [layers] mm².
std::vector<double> layer_areas(const scene::Tissue& tissue, const SkinMesh& mesh,
                                const std::vector<Vec3>& deep) {
  if (static_cast<int>(tissue.mass.size()) != tissue.layers)
    base::refuse("tissue.mass has {} values for {} layers; give one a layer (kg)",
                 tissue.mass.size(), tissue.layers);
  const std::vector<double> depths = layer_depths(tissue);
  std::vector<double> total(depths.size(), 0);
  for (const Triangle& t : mesh.triangles) {
    std::array<std::vector<Vec3>, 3> at;
    for (int k = 0; k < 3; ++k)
      at[k] = column_points(mesh.points[t[k]], deep[t[k]], depths, tissue.depths_mm);
    for (size_t a = 0; a < total.size(); ++a)
      total[a] += 3 * ((at[1][a] - at[0][a]).cross(at[2][a] - at[0][a]).norm() / 6);
  }
  return total;
}

/// [V] N, each force shared over the free columns within its radius in proportion to the skin area
/// around them, so that the shares sum to it exactly (to rounding).
std::vector<Vec3> distribute_forces(const scene::Scene& scene, const SkinMesh& mesh,
                                    const std::vector<char>& free) {
  std::vector<Vec3> at(mesh.points.size(), Vec3::Zero());
  for (size_t k = 0; k < scene.forces.size(); ++k) {
    const scene::Force& force = scene.forces[k];
    std::vector<int64_t> within;
    double area = 0, nearest = std::numeric_limits<double>::infinity();
    for (size_t v = 0; v < mesh.points.size(); ++v) {
      if (!free[v]) continue;
      const double distance = (mesh.points[v] - force.at).norm();
      nearest = std::min(nearest, distance);
      if (distance > force.radius) continue;
      within.push_back(static_cast<int64_t>(v));
      area += mesh.vertex_area[v];
    }
    if (within.empty())
      base::refuse(
          "{}: forces[{}]: no free skin point within {} mm of {}, the nearest is {:.2f} mm away; "
          "move `at` to the skin or make `radius` larger",
          scene.file.string(), k, force.radius, force.at, nearest);
    for (const int64_t v : within) at[v] += force.force * (mesh.vertex_area[v] / area);
  }
  return at;
}

void set_layer_masses(const std::vector<double>& mass, const std::vector<double>& total,
                      const SkinMesh& mesh, Model& model) {
  const std::vector<double> area = point_areas(mesh, model);
  for (size_t i = 0; i < area.size(); ++i) {
    const int32_t a = model.points.layer[i];
    model.points.mass[i] = mass[a] * area[i] / total[a];
  }
}

void set_masses(const scene::Tissue& tissue, const SkinMesh& mesh, const std::vector<double>& total,
                Model& model) {
  if (tissue.density) {
    for (size_t m = 0; m < model.prisms.points.size(); ++m)
      for (const int64_t point : model.prisms.points[m])
        model.points.mass[point] += *tissue.density * model.prisms.rest_volume[m] / 6;
    return;
  }
  if (!tissue.mass.empty()) set_layer_masses(tissue.mass, total, mesh, model);
}

}  // namespace

std::vector<double> point_areas(const SkinMesh& mesh, const Model& model) {
  const size_t layers = model.points.position.size() / std::max<size_t>(mesh.points.size(), 1);
  std::vector<double> area(model.points.position.size(), 0.0);
  const auto& x = model.points.position;
  for (const Triangle& t : mesh.triangles)
    for (size_t l = 0; l < layers; ++l) {
      const size_t a = t[0] * layers + l, b = t[1] * layers + l, c = t[2] * layers + l;
      const double share = (x[b] - x[a]).cross(x[c] - x[a]).norm() / 6;
      for (const size_t p : {a, b, c}) area[p] += share;
    }
  return area;
}

ColumnLoads column_loads(const scene::Scene& scene, const SkinMesh& mesh, const Columns& columns,
                         const std::vector<char>& rim) {
  ColumnLoads loads = hold_by_instruments(scene, mesh.points, rim);
  std::vector<char> free(rim.size());
  for (size_t c = 0; c < rim.size(); ++c) free[c] = !rim[c] && loads.instrument[c] < 0;
  loads.force = distribute_forces(scene, mesh, free);
  if (!scene.tissue.mass.empty() && !scene.tissue.density)
    loads.layer_area = layer_areas(scene.tissue, mesh, columns.deep);
  return loads;
}

void set_loads(const scene::Tissue& tissue, const SkinMesh& mesh, const ColumnLoads& loads,
               Model& model) {
  Points& points = model.points;
  const size_t columns = loads.instrument.size(), layers = points.position.size() / columns;
  for (size_t c = 0; c < columns; ++c) {
    points.external_force[c * layers] = loads.force[c];
    if (loads.instrument[c] < 0) continue;
    points.set[c * layers] = PointSet::held;
    points.target[c * layers] = loads.target[c];
  }
  set_masses(tissue, mesh, loads.layer_area, model);
}

}  // namespace repose::model
