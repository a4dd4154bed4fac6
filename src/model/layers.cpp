#include "layers.h"

#include <fmt/format.h>

#include <algorithm>

#include "repose/base/error.h"
#include "repose/model/prism_geometry.h"

namespace repose::model {
namespace {

constexpr int fewest = 2, maximum = 64;

/// Fractions of a column's thickness: those of `depths_mm`, but nowhere deeper than even ones, then
/// even ones to the end.
std::vector<double> fractions_of(const std::vector<double>& depths_mm, double thickness,
                                 size_t layers) {
  std::vector<double> fractions;
  const auto even = [&](size_t a) {
    return static_cast<double>(a) / static_cast<double>(layers - 1);
  };
  for (size_t a = 0; a < std::min(depths_mm.size(), layers - 1); ++a)
    fractions.push_back(std::min(depths_mm[a] / thickness, even(a)));
  const size_t given = fractions.size();
  const double last = fractions.back();
  for (size_t a = given; a < layers; ++a)
    fractions.push_back(last + (1 - last) * static_cast<double>(a - given + 1) /
                                   static_cast<double>(layers - given));
  return fractions;
}

void add_points(const SkinMesh& mesh, const std::vector<Vec3>& deep,
                const std::vector<double>& even_depths, const std::vector<double>& depths_mm,
                Points& points) {
  const size_t rows = deep.size() * even_depths.size();
  points.position.reserve(rows);
  points.layer.reserve(rows);
  points.column.reserve(rows);
  for (size_t c = 0; c < deep.size(); ++c) {
    const std::vector<Vec3> column = column_points(mesh.points[c], deep[c], even_depths, depths_mm);
    points.position.insert(points.position.end(), column.begin(), column.end());
    for (size_t a = 0; a < column.size(); ++a) {
      points.layer.push_back(static_cast<int32_t>(a));
      points.column.push_back(static_cast<int64_t>(c));
    }
  }
  points.set.assign(rows, PointSet::soft_tissue);
  points.target = points.position;
  points.bone.assign(rows, -1);
  points.mass.assign(rows, 0);
  points.external_force.assign(rows, Vec3::Zero());
}

/// Adds the springs one set at a time.
void add_springs(const SkinMesh& mesh, int64_t layers, Model& model) {
  Springs& springs = model.springs;
  const std::vector<Vec3>& x = model.points.position;
  const auto open = [&](const char* kind, int64_t number) {
    model.spring_sets.push_back(fmt::format("{} {}", kind, number));
  };
  const auto add = [&](int64_t p, int64_t q) {
    springs.points.push_back({p, q});
    springs.set.push_back(static_cast<int32_t>(model.spring_sets.size()) - 1);
    springs.rest_length.push_back((x[q] - x[p]).norm());
  };
  const int64_t columns = std::ssize(mesh.points), edges = std::ssize(mesh.edges);
  const int64_t rows = layers * edges + (layers - 1) * (columns + 2 * edges);
  springs.points.reserve(rows);
  springs.set.reserve(rows);
  springs.rest_length.reserve(rows);
  for (int64_t a = 0; a < layers; ++a) {
    open("layer", a);
    for (const auto& [c, d] : mesh.edges) add(c * layers + a, d * layers + a);
  }
  for (int64_t a = 0; a + 1 < layers; ++a) {
    open("connecting", a);
    for (int64_t c = 0; c < columns; ++c) add(c * layers + a, c * layers + a + 1);
  }
  for (int64_t a = 0; a + 1 < layers; ++a) {
    open("diagonal", a);
    for (const auto& [c, d] : mesh.edges) {
      add(c * layers + a, d * layers + a + 1);
      add(d * layers + a, c * layers + a + 1);
    }
  }
  springs.stiffness.assign(rows, 0);
  springs.exponent.assign(rows, 0);
  springs.reference.assign(rows, 1);
}

void add_prisms(const SkinMesh& mesh, int64_t layers, Model& model) {
  const size_t rows = (layers - 1) * mesh.triangles.size();
  model.prisms.points.reserve(rows);
  model.prisms.rest_volume.reserve(rows);
  for (int64_t a = 0; a + 1 < layers; ++a)
    for (const Triangle& t : mesh.triangles) {
      const int64_t i = t[0] * layers + a, j = t[2] * layers + a, k = t[1] * layers + a;
      model.prisms.points.push_back({i, j, k, i + 1, j + 1, k + 1});
      model.prisms.rest_volume.push_back(
          prism_volume(base::pick(model.points.position, model.prisms.points.back()).data()));
    }
}

}  // namespace

std::vector<double> layer_depths(const scene::Tissue& tissue) {
  const int layers = tissue.layers;
  if (layers < fewest || layers > maximum)
    base::refuse("tissue.layers is {}, allowed are {} to {}", layers, fewest, maximum);
  std::vector<double> depths = tissue.depths;
  if (depths.empty())
    for (int a = 0; a < layers; ++a) depths.push_back(static_cast<double>(a) / (layers - 1));
  if (static_cast<int>(depths.size()) != layers)
    base::refuse("tissue.depths has {} fractions for {} layers; give one a layer", depths.size(),
                 layers);
  if (depths.front() != 0 || depths.back() != 1)
    base::refuse("tissue.depths runs from {} to {}; the first must be 0 (skin), the last 1 (bone)",
                 depths.front(), depths.back());
  for (int a = 1; a < layers; ++a)
    if (!(depths[a] > depths[a - 1]))
      base::refuse("tissue.depths: {} after {}; each must be greater than the one before it",
                   depths[a], depths[a - 1]);
  return depths;
}

std::vector<Vec3> column_points(const Vec3& skin, const Vec3& deep,
                                const std::vector<double>& depths,
                                const std::vector<double>& depths_mm) {
  std::vector<Vec3> points;
  const std::vector<double> fractions =
      depths_mm.empty() ? depths : fractions_of(depths_mm, (deep - skin).norm(), depths.size());
  for (const double f : fractions) points.push_back((1 - f) * skin + f * deep);
  return points;
}

Model make_layers(const SkinMesh& mesh, const std::vector<Vec3>& deep,
                  const std::vector<double>& depths, const std::vector<double>& depths_mm,
                  Elements elements) {
  Model model;
  const auto layers = static_cast<int64_t>(depths.size());
  add_points(mesh, deep, depths, depths_mm, model.points);
  if (elements == Elements::springs) add_springs(mesh, layers, model);
  add_prisms(mesh, layers, model);
  for (const Triangle& t : mesh.triangles)
    model.skin.push_back({t[0] * layers, t[1] * layers, t[2] * layers});
  return model;
}

}  // namespace repose::model
