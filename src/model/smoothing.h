#pragma once
#include <Eigen/Core>
#include <vector>

#include "repose/model/skin_mesh.h"

/// Fields over the skin made smoother, independent of how finely it is meshed.
namespace repose::model {

/// Minimizes Σ_v a_v w_v |f_v − g_v|² + Σ_e c_e ℓ_e² |f_p − f_q|² over the field f: `given` g is
/// [V × k], `weight` w > 0 [V] says how much each value is trusted, `length` ℓ (mm) [V] over what
/// distance to smooth (averaged over an edge's ends), a_v is the vertex area and
/// c_e = ⅔ edge_area / |e|² the positive form of the finite-element weights (equal to them on
/// equilateral triangles), so that f never leaves the range of g. By sparse Cholesky factors.
Eigen::MatrixXd smooth_field(const SkinMesh& mesh, const Eigen::MatrixXd& given,
                             const std::vector<double>& weight, const std::vector<double>& length);

/// The steepest that depths below the skin may be, mm per mm along it.
constexpr double steepest_depth = 1.0;

/// Lowers values until |f_p − f_q| ≤ slope · |e| on every edge: the largest such field below
/// `values`. Only vertices in `seeds` may be out of order with their neighbors at first.
/// O(V log V) where all are seeds, else about proportional to what changes. Returns the vertices
/// that were lowered (an entry for each time).
std::vector<int64_t> limit_slope(const SkinMesh& mesh, double slope,
                                 const std::vector<int64_t>& seeds, std::vector<double>& values);

}  // namespace repose::model
