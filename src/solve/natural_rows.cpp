#include "repose/solve/natural_rows.h"

#include <algorithm>

#include "repose/base/agreement.h"
#include "repose/mechanics/prism_volume.h"
#include "repose/mechanics/spring_law.h"
#include "repose/solve/exact_volume.h"

namespace repose::solve {

using base::check;

namespace {

double tension(const model::Springs& springs, int64_t e, double elongation) {
  return mechanics::with_exponent(springs.exponent[e], [&]<int p>() {
    return mechanics::spring_tension<p>(elongation, springs.stiffness[e],
                                        1.0 / springs.reference[e]);
  });
}

/// [owned prisms] N/mm²; none where nothing is free to move.
std::vector<double> owned_pressures(Objective& objective) {
  std::vector<double> owned(objective.positions().part().owned_prisms, 0.0);
  const std::vector<double> pressure = pressures(objective);
  for (int64_t e = 0; e < objective.prisms().counted; ++e)
    owned[objective.prisms().row[e]] = pressure[e];
  return owned;
}

const double* numbers(std::span<const Vec3> points) {
  return points.empty() ? nullptr : points.data()->data();
}

}  // namespace

NaturalRows::Route::Route(MPI_Comm comm, std::span<const int64_t> rows, int64_t total, int block)
    : natural_size(block * base::slab(total, base::rank(comm), base::size(comm)).rows()) {
  const auto owned_rows = static_cast<PetscInt>(rows.size());
  check(VecCreateMPIWithArray(comm, 1, block * owned_rows, PETSC_DETERMINE, nullptr, owned.out()));
  check(VecCreateMPIWithArray(comm, 1, static_cast<PetscInt>(natural_size), PETSC_DETERMINE,
                              nullptr, natural.out()));
  PetscInt first = 0;
  check(VecGetOwnershipRange(owned, &first, nullptr));
  const std::vector<PetscInt> targets(rows.begin(), rows.end());
  base::IndexSetHandle from, to;
  check(ISCreateStride(comm, block * owned_rows, first, 1, from.out()));
  check(ISCreateBlock(comm, block, owned_rows, targets.data(), PETSC_COPY_VALUES, to.out()));
  check(VecScatterCreate(owned, from, natural, to, scatter.out()));
}

void NaturalRows::Route::carry(const double* owned_values, const double* natural_values,
                               ScatterMode mode) const {
  const bool forward = mode == SCATTER_FORWARD;
  check(VecPlaceArray(owned, owned_values));
  check(VecPlaceArray(natural, natural_values));
  const Vec from = forward ? owned : natural, to = forward ? natural : owned;
  check(VecScatterBegin(scatter, from, to, INSERT_VALUES, mode));
  check(VecScatterEnd(scatter, from, to, INSERT_VALUES, mode));
  check(VecResetArray(owned));
  check(VecResetArray(natural));
}

std::vector<double> NaturalRows::Route::bring(const std::vector<double>& values) const {
  std::vector<double> rows(natural_size);
  carry(values.data(), rows.data(), SCATTER_FORWARD);
  return rows;
}

NaturalRows::NaturalRows(MPI_Comm comm, const Part& part)
    : comm_(comm),
      part_(part),
      points_(comm, std::span(part.point_row).first(part.owned_points), part.total_points, 3) {}

void NaturalRows::add_springs(std::span<const Vec3> position, model::StepRows& rows) const {
  const model::Springs& springs = part_.model.springs;
  const Route route(comm_, part_.spring_row, part_.total_springs, 1);
  std::vector<double> values(part_.owned_springs);
  for (int64_t e = 0; e < part_.owned_springs; ++e) {
    const auto& [p, q] = springs.points[e];
    values[e] = (position[q] - position[p]).norm() - springs.rest_length[e];
  }
  rows.elongation = route.bring(values);
  for (int64_t e = 0; e < part_.owned_springs; ++e) values[e] = tension(springs, e, values[e]);
  rows.tension = route.bring(values);
}

void NaturalRows::add_prisms(Objective& objective, bool with_pressure,
                             model::StepRows& rows) const {
  const auto position = objective.positions().local();
  const model::Prisms& prisms = part_.model.prisms;
  const Route route(comm_, part_.prism_row, part_.total_prisms, 1);
  std::vector<double> ratio(part_.owned_prisms);
  for (int64_t e = 0; e < part_.owned_prisms; ++e) {
    std::array<Vec3, 6> corners;
    for (int c = 0; c < 6; ++c) corners[c] = position[prisms.points[e][c]];
    ratio[e] = mechanics::prism_volume(corners.data()) / prisms.rest_volume[e];
  }
  rows.volume_ratio = route.bring(ratio);
  if (with_pressure) rows.pressure = route.bring(owned_pressures(objective));
}

model::StepRows NaturalRows::rows(Objective& objective, bool with_pressure) const {
  const auto position = objective.positions().local();
  model::StepRows rows;
  rows.position = natural(position);
  rows.residual_force = natural(objective.residual_force());
  add_prisms(objective, with_pressure, rows);
  add_springs(position, rows);
  return rows;
}

std::vector<Vec3> NaturalRows::natural(std::span<const Vec3> values) const {
  std::vector<Vec3> rows(points_.natural_size / 3);
  points_.carry(numbers(values), numbers(rows), SCATTER_FORWARD);
  return rows;
}

std::vector<Vec3> NaturalRows::owned(const std::vector<Vec3>& slab) const {
  std::vector<Vec3> rows(part_.owned_points);
  points_.carry(numbers(rows), numbers(slab), SCATTER_REVERSE);
  return rows;
}

void NaturalRows::take(const std::vector<Vec3>& slab, const Positions& positions,
                       Vec displacement) const {
  std::vector<Vec3> rows = owned(slab);
  for (size_t i = 0; i < rows.size(); ++i) rows[i] -= part_.model.points.position[i];
  positions.keep_owned(rows, displacement);
}

}  // namespace repose::solve
