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

std::vector<Vec3> as_points(const std::vector<double>& numbers) {
  std::vector<Vec3> points(numbers.size() / 3);
  for (size_t i = 0; i < points.size(); ++i) points[i] = Eigen::Map<const Vec3>(&numbers[3 * i]);
  return points;
}

}  // namespace

NaturalRows::Route NaturalRows::make_route(MPI_Comm comm, const std::vector<int64_t>& rows,
                                           int64_t total, int block) {
  Route route;
  route.block = block;
  const auto owned = static_cast<PetscInt>(rows.size());
  const auto slab = base::slab(total, base::rank(comm), base::size(comm));
  const auto mine = static_cast<PetscInt>(slab.rows());
  check(VecCreateMPI(comm, block * owned, PETSC_DETERMINE, route.owned.out()));
  check(VecCreateMPI(comm, block * mine, PETSC_DETERMINE, route.natural.out()));
  PetscInt first = 0;
  check(VecGetOwnershipRange(route.owned, &first, nullptr));
  const std::vector<PetscInt> targets(rows.begin(), rows.end());
  base::IndexSetHandle from, to;
  check(ISCreateStride(comm, block * owned, first, 1, from.out()));
  check(ISCreateBlock(comm, block, owned, targets.data(), PETSC_COPY_VALUES, to.out()));
  check(VecScatterCreate(route.owned, from, route.natural, to, route.scatter.out()));
  return route;
}

NaturalRows::NaturalRows(MPI_Comm comm, const Part& part)
    : part_(part),
      points_(make_route(comm, {part.point_row.begin(), part.point_row.begin() + part.owned_points},
                         part.total_points, 3)),
      springs_(make_route(comm, part.spring_row, part.total_springs, 1)),
      prisms_(make_route(comm, part.prism_row, part.total_prisms, 1)) {}

std::vector<double> NaturalRows::bring(const Route& route, const double* values) {
  PetscInt owned = 0, mine = 0;
  check(VecGetLocalSize(route.owned, &owned));
  check(VecGetLocalSize(route.natural, &mine));
  PetscScalar* target = nullptr;
  check(VecGetArrayWrite(route.owned, &target));
  std::copy(values, values + owned, target);
  check(VecRestoreArrayWrite(route.owned, &target));
  check(VecScatterBegin(route.scatter, route.owned, route.natural, INSERT_VALUES, SCATTER_FORWARD));
  check(VecScatterEnd(route.scatter, route.owned, route.natural, INSERT_VALUES, SCATTER_FORWARD));
  const PetscScalar* source = nullptr;
  check(VecGetArrayRead(route.natural, &source));
  std::vector<double> natural(source, source + mine);
  check(VecRestoreArrayRead(route.natural, &source));
  return natural;
}

model::StepRows NaturalRows::rows(Objective& objective, bool with_pressure) const {
  const auto position = objective.positions().local();
  const model::Springs& springs = part_.model.springs;
  const model::Prisms& prisms = part_.model.prisms;
  std::vector<double> elongation(part_.owned_springs), force(part_.owned_springs);
  for (int64_t e = 0; e < part_.owned_springs; ++e) {
    const auto& [p, q] = springs.points[e];
    elongation[e] = (position[q] - position[p]).norm() - springs.rest_length[e];
    force[e] = tension(springs, e, elongation[e]);
  }
  std::vector<double> ratio(part_.owned_prisms);
  for (int64_t e = 0; e < part_.owned_prisms; ++e) {
    std::array<Vec3, 6> corners;
    for (int c = 0; c < 6; ++c) corners[c] = position[prisms.points[e][c]];
    ratio[e] = mechanics::prism_volume(corners.data()) / prisms.rest_volume[e];
  }
  const std::vector<Vec3> residual = objective.residual_force();
  model::StepRows rows;
  rows.position = natural(position);
  rows.residual_force = natural(residual);
  rows.volume_ratio = bring(prisms_, ratio.data());
  if (with_pressure) rows.pressure = bring(prisms_, owned_pressures(objective).data());
  rows.elongation = bring(springs_, elongation.data());
  rows.tension = bring(springs_, force.data());
  return rows;
}

std::vector<Vec3> NaturalRows::natural(std::span<const Vec3> values) const {
  return as_points(bring(points_, values.empty() ? nullptr : values.data()->data()));
}

std::vector<Vec3> NaturalRows::owned(const std::vector<Vec3>& slab) const {
  const Route& route = points_;
  PetscScalar* source = nullptr;
  check(VecGetArrayWrite(route.natural, &source));
  for (size_t i = 0; i < slab.size(); ++i) Eigen::Map<Vec3>(source + 3 * i) = slab[i];
  check(VecRestoreArrayWrite(route.natural, &source));
  check(VecScatterBegin(route.scatter, route.natural, route.owned, INSERT_VALUES, SCATTER_REVERSE));
  check(VecScatterEnd(route.scatter, route.natural, route.owned, INSERT_VALUES, SCATTER_REVERSE));
  const PetscScalar* values = nullptr;
  check(VecGetArrayRead(route.owned, &values));
  std::vector<Vec3> rows(part_.owned_points);
  for (size_t i = 0; i < rows.size(); ++i) rows[i] = Eigen::Map<const Vec3>(values + 3 * i);
  check(VecRestoreArrayRead(route.owned, &values));
  return rows;
}

void NaturalRows::take(const std::vector<Vec3>& slab, const Positions& positions,
                       Vec displacement) const {
  std::vector<Vec3> rows = owned(slab);
  for (size_t i = 0; i < rows.size(); ++i) rows[i] -= part_.model.points.position[i];
  positions.keep_owned(rows, displacement);
}

}  // namespace repose::solve
