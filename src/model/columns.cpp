#include "repose/model/columns.h"

#include "repose/model/directions.h"
#include "repose/model/fold.h"
#include "repose/model/thickness.h"

namespace repose::model {
namespace {

constexpr double smoothing_per_depth = 0.5;

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

}  // namespace

Columns lay_columns(const SkinMesh& mesh, const BoneField& bones,
                    const std::vector<BoneField::Nearest>& nearest, const scene::Tissue& tissue,
                    const std::string& skin_name) {
  const std::vector<Cone> cones = inward_cones(mesh, skin_name);
  const std::vector<Vec3> directions = column_directions(mesh, cones, nearest, tissue.attach_within,
                                                         smoothing_length(nearest, tissue));
  const Reach reach = cast_columns(mesh, directions, nearest, bones, tissue);

  Columns columns;
  columns.thickness = column_thickness(mesh, reach, tissue.free_thickness);
  const std::vector<double> before = columns.thickness;
  shorten_folded(mesh, directions, skin_name, columns.thickness);

  columns.holds = reach.holds;
  columns.deep.resize(mesh.points.size());
  for (size_t v = 0; v < columns.deep.size(); ++v) {
    columns.deep[v] = mesh.points[v] + columns.thickness[v] * directions[v];
    columns.shortened += columns.thickness[v] < before[v];
  }
  return columns;
}

}  // namespace repose::model
