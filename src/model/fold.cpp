#include "fold.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <iterator>

#include "repose/model/skin_mesh.h"
#include "smoothing.h"

namespace repose::model {
namespace {

constexpr double min_margin = 0.05;
constexpr double shortening = 0.9;
constexpr double thinnest = 0.05;  // mm

/// Least value of c[0] + c[1] s + c[2] s² for s in [0, 1].
double min_on_unit_interval(const std::array<double, 3>& c) {
  double minimum = std::min(c[0], c[0] + c[1] + c[2]);
  if (c[2] > 0) {
    const double s = std::clamp(-c[1] / (2 * c[2]), 0.0, 1.0);
    minimum = std::min(minimum, c[0] + s * (c[1] + s * c[2]));
  }
  return minimum;
}

double margin_of(const SkinMesh& mesh, int64_t triangle, const std::vector<Vec3>& directions,
                 const std::vector<double>& thickness) {
  const auto [i, j, k] = mesh.triangles[triangle];
  return fold_margin(
      {mesh.points[i], mesh.points[j], mesh.points[k]},
      {thickness[i] * directions[i], thickness[j] * directions[j], thickness[k] * directions[k]});
}

}  // namespace

double fold_margin(const std::array<Vec3, 3>& skin, const std::array<Vec3, 3>& column) {
  const Vec3 a1 = skin[2] - skin[0], a2 = skin[1] - skin[0];  // inward order
  const Vec3 b1 = column[2] - column[0], b2 = column[1] - column[0];
  const Vec3 n0 = a1.cross(a2), n1 = a1.cross(b2) + b1.cross(a2), n2 = b1.cross(b2);
  double margin = 1;
  for (const Vec3& w : column) {
    const double minimum = min_on_unit_interval({n0.dot(w), n1.dot(w), n2.dot(w)});
    margin = std::min(margin, minimum / (n0.norm() * w.norm()));
  }
  return margin;
}

std::vector<int64_t> folded_triangles(const SkinMesh& mesh, const std::vector<Vec3>& directions,
                                      const std::vector<double>& thickness) {
  std::vector<int64_t> folded;
  for (size_t f = 0; f < mesh.triangles.size(); ++f)
    if (!(margin_of(mesh, static_cast<int64_t>(f), directions, thickness) >= min_margin))
      folded.push_back(static_cast<int64_t>(f));
  return folded;
}

void shorten_folded(const SkinMesh& mesh, const std::vector<Vec3>& directions,
                    const std::string& skin_name, std::vector<double>& thickness) {
  std::vector<int64_t> stuck;
  const auto too_thin = [&](int64_t v) { return !(shortening * thickness[v] > thinnest); };
  std::vector<int64_t> folded = folded_triangles(mesh, directions, thickness);
  while (!folded.empty()) {
    std::vector<int64_t> changed = vertices_of(mesh, folded);
    std::copy_if(changed.begin(), changed.end(), std::back_inserter(stuck), too_thin);
    std::erase_if(changed, too_thin);
    for (const int64_t v : changed) thickness[v] *= shortening;
    const std::vector<int64_t> drawn = limit_slope(mesh, steepest_depth, changed, thickness);
    changed.insert(changed.end(), drawn.begin(), drawn.end());
    folded = triangles_at(mesh, changed);
    std::erase_if(
        folded, [&](int64_t f) { return margin_of(mesh, f, directions, thickness) >= min_margin; });
  }
  std::erase_if(stuck, [&](int64_t v) {
    const auto around = triangles_at(mesh, {v});
    return std::all_of(around.begin(), around.end(), [&](int64_t f) {
      return margin_of(mesh, f, directions, thickness) >= min_margin;
    });
  });
  if (!stuck.empty())
    refuse_places(skin_name, mesh, stuck,
                  fmt::format("no sound column of tissue fits (neighboring ones cross even where "
                              "they are only {:g} mm long)",
                              thinnest),
                  "leave tissue.edge to the program, or smooth or coarsen the skin there");
}

}  // namespace repose::model
