#include "columns.h"

#include <algorithm>
#include <functional>
#include <limits>

#include "directions.h"
#include "fold.h"
#include "smoothing.h"

namespace repose::model {
namespace {

constexpr double smoothing_per_depth = 0.5;
constexpr int bends = 12;
constexpr double deeper_than_nearest = 1.6, deeper_by = 2.0;  // mm
constexpr double bone_room = 0.95, skin_room = 0.45;
constexpr double held_weight = 100.0;
constexpr double spike_width = 1.5, spike_height = 0.2;  // mm

/// Distances that each column meets on its way inwards, [V] each; 0 before it is traced.
struct Reach {
  std::vector<double> to_bone;  ///< mm along the column to the first bone, infinite where none
  std::vector<double> room;     ///< mm a column that ends free may be long
  std::vector<char> holds;      ///< 1 where the bone met is the one beneath, near enough to attach
};

/// Casts rays down columns of a mesh. A bone holds a column where it is met within `attach_within`,
/// before the skin's own other side, and not much deeper than the nearest bone is away (1.6 times
/// and 2 mm: a ray that slips between teeth or into an orbit finds no bone). A free column keeps to
/// 0.95 of the way to bone and 0.45 of the way to the skin's other side.
class ColumnTracer {
 public:
  /// All arguments outlive it; `nearest` [V].
  ColumnTracer(const SkinMesh& mesh, const BoneField& bones,
               const std::vector<BoneField::Nearest>& nearest, const scene::Tissue& tissue);

  /// Traces the columns given by number along `directions` [V].
  void trace(const std::vector<int64_t>& columns, const std::vector<Vec3>& directions);
  const Reach& reach() const { return reach_; }

 private:
  const SkinMesh& mesh_;
  const BoneField& bones_;
  const std::vector<BoneField::Nearest>& nearest_;
  const scene::Tissue& tissue_;
  surface::DistanceTree skin_;
  Reach reach_;
};

/// Distance along a column to where it would leave the skin again, infinite within `reach`.
double to_other_side(const surface::DistanceTree& skin, const Vec3& from, const Vec3& direction,
                     double start, double reach) {
  const auto hit = skin.first_hit(from + start * direction, direction, reach);
  return hit ? start + hit->distance : std::numeric_limits<double>::infinity();
}

void flatten(const SkinMesh& mesh, std::vector<double>& thickness) {
  limit_slope(mesh, steepest_depth, base::all_rows(thickness.size()), thickness);
}

/// Cuts off what stands out by more than spike_height from the field smoothed over spike_width:
/// single columns that graze an edge of bone and meet it late.
void cut_spikes(const SkinMesh& mesh, std::vector<double>& thickness) {
  const auto vertices = static_cast<int64_t>(thickness.size());
  const Eigen::MatrixXd given = Eigen::Map<const Eigen::VectorXd>(thickness.data(), vertices);
  const std::vector<double> weight(vertices, 1.0), length(vertices, spike_width);
  const Eigen::MatrixXd smooth = smooth_field(mesh, given, weight, length);
  for (int64_t v = 0; v < vertices; ++v)
    thickness[v] = std::min(thickness[v], smooth(v, 0) + spike_height);
}

ColumnTracer::ColumnTracer(const SkinMesh& mesh, const BoneField& bones,
                           const std::vector<BoneField::Nearest>& nearest,
                           const scene::Tissue& tissue)
    : mesh_(mesh),
      bones_(bones),
      nearest_(nearest),
      tissue_(tissue),
      skin_({"skin", mesh.points, mesh.triangles}),
      reach_{std::vector<double>(mesh.points.size()), std::vector<double>(mesh.points.size()),
             std::vector<char>(mesh.points.size())} {}

void ColumnTracer::trace(const std::vector<int64_t>& columns, const std::vector<Vec3>& directions) {
  const double farthest =
      std::max(tissue_.attach_within, tissue_.free_thickness / std::min(bone_room, skin_room));
  for (const int64_t v : columns) {
    const Vec3& from = mesh_.points[v];
    const auto hit = bones_.first_hit(from, directions[v], farthest);
    reach_.to_bone[v] = hit.value_or(std::numeric_limits<double>::infinity());
    const double start = 1e-3 * std::sqrt(mesh_.vertex_area[v]);
    const double skin_distance = to_other_side(skin_, from, directions[v], start, farthest);
    const double deepest = std::min({tissue_.attach_within, skin_distance,
                                     deeper_than_nearest * nearest_[v].distance + deeper_by});
    reach_.holds[v] = reach_.to_bone[v] <= deepest;
    reach_.room[v] = std::min(bone_room * reach_.to_bone[v], skin_room * skin_distance);
  }
}

/// Thickness [V] in mm: down to the bone where it holds, elsewhere from the neighboring bone's
/// depth to `free_thickness` over about that distance, within the room there is. Then lowered,
/// never raised: until the deep surface is nowhere steeper than 45° to the skin, and where a single
/// column stands out (one that grazes an edge of bone).
std::vector<double> column_thickness(const SkinMesh& mesh, const Reach& reach,
                                     double free_thickness) {
  const auto vertices = static_cast<int64_t>(mesh.points.size());
  Eigen::MatrixXd given(vertices, 1);
  std::vector<double> weight(vertices);
  for (int64_t v = 0; v < vertices; ++v) {
    given(v, 0) = reach.holds[v] ? reach.to_bone[v] : std::min(free_thickness, reach.room[v]);
    weight[v] = reach.holds[v] ? held_weight : 1.0;
  }
  const std::vector<double> length(vertices, free_thickness);
  const Eigen::MatrixXd blended = smooth_field(mesh, given, weight, length);
  std::vector<double> thickness(vertices);
  for (int64_t v = 0; v < vertices; ++v)
    thickness[v] = reach.holds[v] ? reach.to_bone[v] : std::min(blended(v, 0), reach.room[v]);
  flatten(mesh, thickness);
  cut_spikes(mesh, thickness);
  flatten(mesh, thickness);
  return thickness;
}

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
