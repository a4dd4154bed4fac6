#include "columns.h"

#include <algorithm>
#include <functional>

#include "directions.h"
#include "fold.h"
#include "thickness.h"

namespace repose::model {
namespace {

constexpr double smoothing_per_depth = 0.5;
constexpr int bends = 12;

/// What is found along the directions, [V].
struct Laid {
  std::vector<double> thickness;
  std::vector<char> holds;
};

/// Over what length (mm) to smooth the directions: in proportion to how deep the tissue is likely
/// to be, because columns cross where their directions turn by much within their own length.
std::vector<double> smoothing_length(const std::vector<BoneField::Nearest>& nearest,
                                     const scene::Tissue& tissue) {
  std::vector<double> length(nearest.size());
  for (size_t v = 0; v < length.size(); ++v) {
    const double bone = nearest[v].distance;
    length[v] = smoothing_per_depth * (bone <= tissue.attach_within ? bone : tissue.free_thickness);
  }
  return length;
}

/// Bends columns that cross towards their neighbours, as long as that helps; returns how many.
int64_t bend_folded(const SkinMesh& mesh, const std::vector<Cone>& cones,
                    const std::function<Laid(const std::vector<Vec3>&)>& lay,
                    std::vector<Vec3>& directions, Laid& laid) {
  std::vector<char> bent(directions.size(), 0);
  for (int round = 0; round < bends; ++round) {
    std::vector<int64_t> crossing;
    for (const int64_t f : folded_triangles(mesh, directions, laid.thickness))
      for (const int64_t v : mesh.triangles[f]) crossing.push_back(v);
    if (crossing.empty()) break;
    std::sort(crossing.begin(), crossing.end());
    crossing.erase(std::unique(crossing.begin(), crossing.end()), crossing.end());
    bend(mesh, cones, crossing, directions);
    for (const int64_t v : crossing) bent[v] = 1;
    laid = lay(directions);
  }
  return std::count(bent.begin(), bent.end(), 1);
}

}  // namespace

Columns lay_columns(const SkinMesh& mesh, const BoneField& bones,
                    const std::vector<BoneField::Nearest>& nearest, const scene::Tissue& tissue,
                    const std::string& skin_name) {
  const std::vector<Cone> cones = inward_cones(mesh, skin_name);
  std::vector<Vec3> directions = column_directions(mesh, cones, nearest, tissue.attach_within,
                                                   smoothing_length(nearest, tissue));
  const auto lay = [&](const std::vector<Vec3>& along) -> Laid {
    const Reach reach = cast_columns(mesh, along, nearest, bones, tissue);
    return {column_thickness(mesh, reach, tissue.free_thickness), reach.holds};
  };
  Laid laid = lay(directions);

  Columns columns;
  if (tissue.edge) columns.bent = bend_folded(mesh, cones, lay, directions, laid);
  columns.thickness = laid.thickness;
  shorten_folded(mesh, directions, skin_name, columns.thickness);

  columns.holds = laid.holds;
  columns.deep.resize(mesh.points.size());
  for (size_t v = 0; v < columns.deep.size(); ++v) {
    columns.deep[v] = mesh.points[v] + columns.thickness[v] * directions[v];
    columns.shortened += columns.thickness[v] < laid.thickness[v];
  }
  return columns;
}

}  // namespace repose::model
