#pragma once
#include <algorithm>
#include <vector>

#include "repose/base/agreement.h"
#include "repose/solve/repose.h"

/// Whole runs of the solver on the ranks of a test.
namespace repose::testing {

/// All of an array of which each rank has its slab, on every rank.
inline std::vector<double> gather(const double* slab, size_t size) {
  const int ranks = base::size(MPI_COMM_WORLD);
  const int mine = static_cast<int>(size);
  std::vector<int> counts(ranks), starts(ranks, 0);
  MPI_Allgather(&mine, 1, MPI_INT, counts.data(), 1, MPI_INT, MPI_COMM_WORLD);
  for (int r = 1; r < ranks; ++r) starts[r] = starts[r - 1] + counts[r - 1];
  std::vector<double> all(starts.back() + counts.back());
  MPI_Allgatherv(slab, mine, MPI_DOUBLE, all.data(), counts.data(), starts.data(), MPI_DOUBLE,
                 MPI_COMM_WORLD);
  return all;
}
inline std::vector<double> gather(const std::vector<double>& slab) {
  return gather(slab.data(), slab.size());
}
inline std::vector<Vec3> gather(const std::vector<Vec3>& slab) {
  const std::vector<double> flat =
      gather(slab.empty() ? nullptr : slab.data()->data(), 3 * slab.size());
  std::vector<Vec3> all(flat.size() / 3);
  for (size_t i = 0; i < all.size(); ++i) all[i] = Eigen::Map<const Vec3>(&flat[3 * i]);
  return all;
}

/// Outcome of a run, with all rows of its last step on every rank.
struct Rest {
  model::StepRows rows;
  solve::Summary summary;
};

/// mm, the farthest that a point moved across z.
inline double farthest_aside(const model::Model& model, const Rest& rest) {
  double farthest = 0;
  for (size_t i = 0; i < model.points.position.size(); ++i)
    farthest =
        std::max(farthest, (rest.rows.position[i] - model.points.position[i]).head<2>().norm());
  return farthest;
}

inline Rest find_rest(const model::Model& model, const solve::Settings& settings) {
  Rest rest;
  const auto keep = [&](const model::StepNumbers&, const model::StepRows& slabs) {
    rest.rows.position = gather(slabs.position);
    rest.rows.residual_force = gather(slabs.residual_force);
    rest.rows.volume_ratio = gather(slabs.volume_ratio);
    rest.rows.pressure = gather(slabs.pressure);
    rest.rows.elongation = gather(slabs.elongation);
    rest.rows.tension = gather(slabs.tension);
    rest.rows.point_fields.clear();
    for (const model::PointField& field : slabs.point_fields)
      rest.rows.point_fields.push_back({field.name, field.vector, gather(field.values)});
  };
  rest.summary = solve::find_repose(MPI_COMM_WORLD, model, settings, {}, keep);
  return rest;
}

}  // namespace repose::testing
