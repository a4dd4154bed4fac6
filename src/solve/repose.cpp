#include "repose/solve/repose.h"

#include <fmt/format.h>

#include <cmath>

#include "repose/base/agreement.h"
#include "repose/base/progress.h"
#include "repose/solve/natural_rows.h"

namespace repose::solve {

using base::check;

namespace {

double force_sum(MPI_Comm comm, const std::vector<Vec3>& owned) {
  double sum = 0;
  for (const Vec3& f : owned) sum += f.norm();
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, comm);
  return sum;
}

model::StepNumbers numbers_of(Objective& objective, const Settings& settings,
                              const Outcome& outcome, double load) {
  const mechanics::Totals totals = objective.totals();
  const mechanics::Weights& weights = settings.weights;
  model::StepNumbers n;
  n.load = load;
  n.volume = settings.volume;
  n.lambda = settings.lambda;
  if (weights.volume == mechanics::VolumeTerm::penalty) n.bulk_modulus = weights.volume_weight;
  n.f_e = totals.spring_energy;
  n.potential = objective.potential();
  n.f_f = force_sum(objective.positions().comm(), objective.residual_force());
  n.f_v = totals.volume_squares;
  n.penalty = n.bulk_modulus * totals.penalty_unit;
  n.objective = outcome.objective;
  n.gradient_max = outcome.gradient_max;
  n.volume_error_max = totals.volume_error_max;
  n.inverted_prisms = totals.inverted;
  n.displacement_error = outcome.displacement_error;
  n.iterations = outcome.iterations;
  n.reason = outcome.reason;
  n.converged = outcome.converged;
  return n;
}

/// Shows each iteration on a terminal.
class Watcher {
 public:
  explicit Watcher(MPI_Comm comm) : progress_(comm) {}
  void operator()(const Iteration& i) {
    const std::string to_go = std::isfinite(i.millimetres_to_go) && i.millimetres_to_go > 0
                                  ? fmt::format("{:.3g} mm to go", i.millimetres_to_go)
                                  : std::string("far from rest");
    progress_.show(fmt::format("load {:.3f}  iteration {}  objective {:.6g} N mm  largest force "
                               "{:.3g} N  {}",
                               i.load, i.number, i.objective, i.largest_force, to_go),
                   i.load);
  }

 private:
  base::Progress progress_;
};

/// Sets the unknowns to the displacements that take the initial positions to `start`.
void restart_from(MPI_Comm comm, const Part& part, const std::vector<Vec3>& start,
                  Vec displacement) {
  std::vector<PetscInt> from, to;
  for (int64_t i = 0; i < part.owned_points; ++i)
    if (part.unknown[i] >= 0) {
      from.push_back(static_cast<PetscInt>(part.point_row[i]));
      to.push_back(static_cast<PetscInt>(part.unknown[i]));
    }
  base::VecHandle natural;
  check(VecCreateMPIWithArray(comm, 3, static_cast<PetscInt>(3 * start.size()), PETSC_DETERMINE,
                              start.empty() ? nullptr : start.data()->data(), natural.out()));
  base::IndexSetHandle source, target;
  const auto count = static_cast<PetscInt>(from.size());
  check(ISCreateBlock(comm, 3, count, from.data(), PETSC_COPY_VALUES, source.out()));
  check(ISCreateBlock(comm, 3, count, to.data(), PETSC_COPY_VALUES, target.out()));
  base::ScatterHandle scatter;
  check(VecScatterCreate(natural, source, displacement, target, scatter.out()));
  check(VecScatterBegin(scatter, natural, displacement, INSERT_VALUES, SCATTER_FORWARD));
  check(VecScatterEnd(scatter, natural, displacement, INSERT_VALUES, SCATTER_FORWARD));
  PetscScalar* values = nullptr;
  check(VecGetArray(displacement, &values));
  for (int64_t i = 0; i < part.owned_points; ++i)
    if (part.unknown[i] >= 0)
      Eigen::Map<Vec3>(values + 3 * (part.unknown[i] - part.first_unknown)) -=
          part.model.points.position[i];
  check(VecRestoreArray(displacement, &values));
}

}  // namespace

Summary find_repose(MPI_Comm comm, const model::Model& model, const Settings& settings,
                    const std::vector<Vec3>& start, base::Stages& stages, const Receiver& receive) {
  const Part part = distribute(comm, model);
  if (part.total_unknowns == 0)
    base::refuse("the model has no soft-tissue point: nothing is free to move");
  Positions positions(comm, part);
  Objective objective(positions, settings.weights);
  const NaturalRows natural(comm, part);
  base::VecHandle displacement = positions.make_vector();
  if (settings.path.start_load > 0) restart_from(comm, part, start, displacement);
  stages.end("distribute");

  Minimiser minimiser(objective, Watcher(comm));
  LoadPath path(objective, minimiser, settings.path);
  Summary summary;
  int64_t evaluations_before = 0;
  summary.path = path.run(displacement, [&](const Outcome& outcome, double load, double seconds) {
    summary.last = numbers_of(objective, settings, outcome, load);
    summary.last.seconds = seconds;
    summary.last.evaluations = objective.evaluations() - evaluations_before;
    evaluations_before = objective.evaluations();
    receive(summary.last, natural.rows(objective));
  });
  summary.unknowns = 3 * part.total_unknowns;
  summary.evaluations = objective.evaluations();
  summary.assemblies = minimiser.assemblies();
  stages.end("solve");
  return summary;
}

}  // namespace repose::solve
