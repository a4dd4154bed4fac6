#include "thickness.h"

#include <algorithm>
#include <limits>

#include "smoothing.h"

namespace repose::model {
namespace {

constexpr double deeper_than_nearest = 1.6, deeper_by = 2.0;  // mm
constexpr double bone_room = 0.95, skin_room = 0.45;
constexpr double held_weight = 100.0;
constexpr double spike_width = 1.5, spike_height = 0.2;  // mm

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

}  // namespace

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

}  // namespace repose::model
