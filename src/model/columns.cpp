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

/// Bends columns that cross towards their neighbors, as long as that helps; returns how many.
/// `lay` finds the thickness again after those given were bent.
int64_t bend_folded(const SkinMesh& mesh, const std::vector<Cone>& cones,
                    const std::function<void(const std::vector<int64_t>&)>& lay,
                    const std::vector<double>& thickness, std::vector<Vec3>& directions) {
  std::vector<char> bent(directions.size(), 0);
  for (int round = 0; round < bends; ++round) {
    const std::vector<int64_t> crossing =
        vertices_of(mesh, folded_triangles(mesh, directions, thickness));
    if (crossing.empty()) break;
    bend(mesh, cones, crossing, directions);
    for (const int64_t v : crossing) bent[v] = 1;
    lay(crossing);
  }
  return std::count(bent.begin(), bent.end(), 1);
}

}  // namespace

Columns compute_columns(const SkinMesh& mesh, const BoneField& bones,
                        const std::vector<BoneField::Nearest>& nearest, const scene::Tissue& tissue,
                        const std::string& skin_name) {
  const std::vector<Cone> cones = inward_cones(mesh, skin_name);
  std::vector<Vec3> directions = column_directions(mesh, cones, nearest, tissue.attach_within,
                                                   smoothing_length(nearest, tissue));
  ColumnTracer tracer(mesh, bones, nearest, tissue);
  std::vector<double> laid;
  const auto lay = [&](const std::vector<int64_t>& changed) {
    tracer.trace(changed, directions);
    laid = column_thickness(mesh, tracer.reach(), tissue.free_thickness);
  };
  lay(base::all_rows(mesh.points.size()));

  Columns columns;
  if (tissue.edge) columns.bent = bend_folded(mesh, cones, lay, laid, directions);
  columns.thickness = laid;
  shorten_folded(mesh, directions, skin_name, columns.thickness);

  columns.holds = tracer.reach().holds;
  columns.deep.resize(mesh.points.size());
  for (size_t v = 0; v < columns.deep.size(); ++v) {
    columns.deep[v] = mesh.points[v] + columns.thickness[v] * directions[v];
    columns.shortened += columns.thickness[v] < laid[v];
  }
  return columns;
}

}  // namespace repose::model
