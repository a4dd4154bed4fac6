#pragma once
#include <algorithm>

#include "../discrete/gathered.h"
#include "repose/solve/repose.h"

/// Whole runs of the solver on the ranks of a test.
namespace repose::testing {

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
