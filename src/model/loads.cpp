#include "loads.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "repose/base/error.h"

namespace repose::model {
namespace {

void set_layer_masses(const std::vector<double>& mass, const SkinMesh& mesh, Model& model) {
  const auto layers = static_cast<int64_t>(mass.size());
  const std::vector<Vec3>& x = model.points.position;
  std::vector<double> area(x.size(), 0), total(layers, 0);
  for (const Triangle& t : mesh.triangles)
    for (int64_t a = 0; a < layers; ++a) {
      const int64_t i = t[0] * layers + a, j = t[1] * layers + a, k = t[2] * layers + a;
      const double third = (x[j] - x[i]).cross(x[k] - x[i]).norm() / 6;
      for (const int64_t point : {i, j, k}) area[point] += third;
      total[a] += 3 * third;
    }
  for (size_t i = 0; i < x.size(); ++i) {
    const int32_t a = model.points.layer[i];
    model.points.mass[i] = mass[a] * area[i] / total[a];
  }
}

}  // namespace

void set_masses(const scene::Tissue& tissue, const SkinMesh& mesh, Model& model) {
  if (tissue.density) {
    for (size_t m = 0; m < model.prisms.points.size(); ++m)
      for (const int64_t point : model.prisms.points[m])
        model.points.mass[point] += *tissue.density * model.prisms.rest_volume[m] / 6;
    return;
  }
  if (tissue.mass.empty()) return;
  if (static_cast<int>(tissue.mass.size()) != tissue.layers)
    base::refuse("tissue.mass has {} values for {} layers; give one a layer (kg)",
                 tissue.mass.size(), tissue.layers);
  set_layer_masses(tissue.mass, mesh, model);
}

void distribute_forces(const scene::Scene& scene, const SkinMesh& mesh, Model& model) {
  const auto layers = static_cast<int64_t>(model.points.position.size() / mesh.points.size());
  for (size_t k = 0; k < scene.forces.size(); ++k) {
    const scene::Force& force = scene.forces[k];
    std::vector<int64_t> within;
    double area = 0, nearest = std::numeric_limits<double>::infinity();
    for (size_t v = 0; v < mesh.points.size(); ++v) {
      if (model.points.set[v * layers] != PointSet::soft_tissue) continue;
      const double distance = (mesh.points[v] - force.at).norm();
      nearest = std::min(nearest, distance);
      if (distance > force.radius) continue;
      within.push_back(static_cast<int64_t>(v));
      area += mesh.vertex_area[v];
    }
    if (within.empty())
      base::refuse(
          "{}: forces[{}]: no free skin point within {} mm of ({}, {}, {}), the nearest is {:.2f} "
          "mm away; move `at` to the skin or make `radius` larger",
          scene.file.string(), k, force.radius, force.at.x(), force.at.y(), force.at.z(), nearest);
    for (const int64_t v : within)
      model.points.external_force[v * layers] += force.force * (mesh.vertex_area[v] / area);
  }
}

}  // namespace repose::model
