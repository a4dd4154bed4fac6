#include "smoothing.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <queue>

#include "repose/base/error.h"

namespace repose::model {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

/// Lower triangle of diag(a w) + Σ_e c_e ℓ_e² (graph Laplacian of e).
Sparse smoothing_matrix(const SkinMesh& mesh, const Eigen::VectorXd& data,
                        const std::vector<double>& length) {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(mesh.points.size() + 3 * mesh.edges.size());
  for (int64_t v = 0; v < data.size(); ++v) entries.emplace_back(v, v, data[v]);
  for (size_t e = 0; e < mesh.edges.size(); ++e) {
    const auto [p, q] = mesh.edges[e];
    const double over = 0.5 * (length[p] + length[q]) / mesh.edge_length(e);
    const double c = 2.0 / 3.0 * mesh.edge_area[e] * over * over;
    entries.emplace_back(p, p, c);
    entries.emplace_back(q, q, c);
    entries.emplace_back(q, p, -c);  // q > p
  }
  Sparse matrix(data.size(), data.size());
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace

Eigen::MatrixXd smooth_field(const SkinMesh& mesh, const Eigen::MatrixXd& given,
                             const std::vector<double>& weight, const std::vector<double>& length) {
  const auto vertices = static_cast<int64_t>(mesh.points.size());
  Eigen::VectorXd data(vertices);
  for (int64_t v = 0; v < vertices; ++v) data[v] = mesh.vertex_area[v] * weight[v];
  const Eigen::SimplicialLDLT<Sparse> factors(smoothing_matrix(mesh, data, length));
  if (factors.info() != Eigen::Success)
    throw base::InternalError("a field over the skin cannot be smoothed: its matrix is singular");
  return factors.solve(data.asDiagonal() * given);
}

std::vector<int64_t> limit_slope(const SkinMesh& mesh, double slope,
                                 const std::vector<int64_t>& seeds, std::vector<double>& values) {
  using Entry = std::pair<double, int64_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (const int64_t v : seeds) queue.emplace(values[v], v);
  std::vector<int64_t> lowered;
  while (!queue.empty()) {
    const auto [value, v] = queue.top();
    queue.pop();
    if (value > values[v]) continue;
    for (const int64_t e : mesh.edges_of[v]) {
      const int64_t other = mesh.other_end(e, v);
      const double limit = value + slope * mesh.edge_length(e);
      if (values[other] <= limit) continue;
      values[other] = limit;
      lowered.push_back(other);
      queue.emplace(limit, other);
    }
  }
  return lowered;
}

}  // namespace repose::model
