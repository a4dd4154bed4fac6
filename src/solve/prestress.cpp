#include "repose/solve/prestress.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "repose/base/agreement.h"
#include "repose/base/error.h"
#include "repose/mechanics/spring_law.h"
#include "repose/solve/message.h"
#include "repose/solve/part.h"
#include "repose/solve/tangent.h"
#include "repose/solve/tangent_solver.h"

namespace repose::solve {

using base::check;
using model::Model;

namespace {

constexpr double balanced = 1e-12;  // of the largest force before

double length(const Model& model, size_t spring) {
  const auto& [p, q] = model.springs.points[spring];
  return (model.points.position[q] - model.points.position[p]).norm();
}

/// Which local springs are skin, whose tension is given. The names are known on rank 0.
std::vector<char> skin_springs(MPI_Comm comm, const Model& whole, const Part& part) {
  const auto name = std::find(whole.spring_sets.begin(), whole.spring_sets.end(), "layer 0");
  auto set = static_cast<int32_t>(name - whole.spring_sets.begin());
  MPI_Bcast(&set, 1, MPI_INT32_T, 0, comm);
  std::vector<char> skin;
  for (int32_t s : part.model.springs.set) skin.push_back(s == set);
  return skin;
}

/// The elongation at which a spring carries `tension`: Newton's method on the monotone law, from a
/// point beyond the root, where it converges without overshooting.
double elongation_at(const model::Springs& springs, size_t j, double tension) {
  const double inverse = 1.0 / springs.reference[j], k0 = springs.stiffness[j];
  return mechanics::with_exponent(springs.exponent[j], [&]<int p>() {
    double s = k0 > 0 ? tension / k0 : 0.0;
    for (int i = 0; i < 200; ++i) {
      const double step = (mechanics::spring_tension<p>(s, k0, inverse) - tension) /
                          mechanics::spring_tangent<p>(s, k0, inverse);
      if (!(std::abs(step) > 1e-17 * std::abs(s))) break;
      s -= step;
    }
    return s;
  });
}

/// The part whose Hessian at the initial position is A K Aᵀ: linear springs at rest, none in the
/// skin.
Part stiffness_part(Part part, const std::vector<char>& skin) {
  Model& model = part.model;
  model.prisms = {};
  part.owned_prisms = part.total_prisms = 0;
  for (size_t j = 0; j < skin.size(); ++j) {
    model.springs.exponent[j] = 0;
    model.springs.rest_length[j] = length(model, j);
    if (skin[j]) model.springs.stiffness[j] = 0;
  }
  return part;
}

/// A K Aᵀ and its solver. One object so that they live and end together.
class Stiffness {
 public:
  Stiffness(MPI_Comm comm, const Part& part, const std::vector<char>& skin)
      : part_(stiffness_part(part, skin)),
        positions_(comm, part_),
        objective_(positions_, {}),
        tangent_(objective_),
        solver_(positions_, tangent_),
        skin_(skin) {}

  /// Adds to `tension` [local springs] the K Aᵀ μ with (A K Aᵀ) μ = −`force`.
  void balance(Vec force, std::vector<double>& tension) {
    base::VecHandle multiplier = positions_.make_vector();
    const base::VecHandle initial = positions_.make_vector();
    check(VecScale(force, -1));
    solver_.solve(initial, force, multiplier, 1e-10);
    const Model& model = part_.model;
    std::vector<Vec3> mu(model.points.position.size(), Vec3::Zero());
    positions_.spread(multiplier, mu);
    for (size_t j = 0; j < skin_.size(); ++j) {
      const auto& [p, q] = model.springs.points[j];
      const double r = length(model, j);
      if (skin_[j] || r == 0) continue;
      const Vec3 u = (model.points.position[q] - model.points.position[p]) / r;
      tension[j] += model.springs.stiffness[j] * u.dot(mu[p] - mu[q]);
    }
  }

 private:
  Part part_;
  Positions positions_;
  Objective objective_;
  Tangent tangent_;
  TangentSolver solver_;
  const std::vector<char>& skin_;
};

/// The forces on the soft-tissue points at the initial position.
base::VecHandle initial_forces(MPI_Comm comm, const Part& part) {
  Positions positions(comm, part);
  Objective objective(positions, {});
  const base::VecHandle at_rest = positions.make_vector();
  base::VecHandle forces = positions.make_vector();
  positions.update(at_rest);
  positions.keep_owned(objective.residual_force(), forces);
  return forces;
}

/// The largest force that the rounding of lengths alone can leave on a soft-tissue point, N: each
/// spring's tension is known to its tangent times half a unit in the last place of its length.
/// Collective.
double rounding_force(MPI_Comm comm, const Part& part) {
  const Model& model = part.model;
  std::vector<double> force(model.points.position.size(), 0.0);
  for (size_t j = 0; j < model.springs.points.size(); ++j) {
    const double r = length(model, j);
    const double tangent = mechanics::with_exponent(model.springs.exponent[j], [&]<int p>() {
      return mechanics::spring_tangent<p>(r - model.springs.rest_length[j],
                                          model.springs.stiffness[j],
                                          1.0 / model.springs.reference[j]);
    });
    for (const int64_t point : model.springs.points[j])
      force[point] += 0.5 * std::numeric_limits<double>::epsilon() * r * tangent;
  }
  double largest = 0;
  for (int64_t i = 0; i < part.owned_points; ++i)
    if (part.unknown[i] >= 0) largest = std::max(largest, force[i]);
  MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, comm);
  return largest;
}

[[noreturn]] void refuse_rest_length(const Model& whole, int64_t spring, double tension,
                                     int64_t impossible) {
  const auto& [p, q] = whole.springs.points[spring];
  const Vec3& at = whole.points.position[p];
  base::refuse(
      "the initial equilibrium asks {} springs to be shorter than nothing at rest; the first is "
      "spring {} ({}, points {} and {} near ({:.2f}, {:.2f}, {:.2f}) mm): it would have to carry "
      "{:.3g} N over {:.3g} mm; lower tissue.turgor or the mass, or raise the stiffness of that "
      "set",
      impossible, spring, whole.spring_sets[whole.springs.set[spring]], p, q, at.x(), at.y(),
      at.z(), tension, length(whole, spring));
}

/// Refuses on all ranks where an owned spring of a rank has no positive rest length. Collective.
void require_rest_lengths(MPI_Comm comm, const Model& whole, const Part& part,
                          const std::vector<double>& tension) {
  struct {
    double row;
    int rank;
  } first{std::numeric_limits<double>::infinity(), base::rank(comm)};
  double worst = 0;
  int64_t impossible = 0;
  for (int64_t j = 0; j < part.owned_springs; ++j) {
    if (part.model.springs.rest_length[j] > 0) continue;
    ++impossible;
    const auto row = static_cast<double>(part.spring_row[j]);
    if (row < first.row) first.row = row, worst = tension[j];
  }
  MPI_Allreduce(MPI_IN_PLACE, &impossible, 1, MPI_INT64_T, MPI_SUM, comm);
  if (impossible == 0) return;
  MPI_Allreduce(MPI_IN_PLACE, &first, 1, MPI_DOUBLE_INT, MPI_MINLOC, comm);
  MPI_Bcast(&worst, 1, MPI_DOUBLE, first.rank, comm);
  base::on_first_rank(
      comm, [&] { refuse_rest_length(whole, static_cast<int64_t>(first.row), worst, impossible); });
}

/// l_j = r_j − T⁻¹(T_j) for all local springs but the skin's.
void set_rest_lengths(const std::vector<char>& skin, const std::vector<double>& tension,
                      Model& model) {
  for (size_t j = 0; j < skin.size(); ++j)
    if (!skin[j])
      model.springs.rest_length[j] = length(model, j) - elongation_at(model.springs, j, tension[j]);
}

/// Refuses on all ranks, naming the point with the largest force. Collective.
void refuse_unbalanced(MPI_Comm comm, const Model& whole, const Part& part, Vec force,
                       const Prestress& so_far) {
  const PetscScalar* values = nullptr;
  check(VecGetArrayRead(force, &values));
  int64_t worst = -1;
  for (int64_t i = 0; i < part.owned_points; ++i) {
    if (part.unknown[i] < 0) continue;
    const auto* f = values + 3 * (part.unknown[i] - part.first_unknown);
    if (Eigen::Map<const Vec3>(f).norm() >= so_far.residual) worst = part.point_row[i];
  }
  check(VecRestoreArrayRead(force, &values));
  MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_INT64_T, MPI_MAX, comm);
  base::on_first_rank(comm, [&] {
    const Vec3& at = whole.points.position[worst];
    base::refuse(
        "the initial equilibrium leaves {:.3g} N (of {:.3g} N) on point {} at ({:.2f}, {:.2f}, "
        "{:.2f}) mm: its springs cannot hold it; give tissue.springs a stiffness there",
        so_far.residual, so_far.largest_force, worst, at.x(), at.y(), at.z());
  });
}

/// Brings the rest lengths of all ranks together into `whole` on rank 0. Collective.
void collect(MPI_Comm comm, const Part& part, Model& whole) {
  std::vector<int64_t> row = part.spring_row;
  std::vector<double> rest = part.model.springs.rest_length;
  rest.resize(row.size());
  if (base::rank(comm) > 0) {
    Sender(comm, 0)(row, rest);
    return;
  }
  for (int sender = 0; sender < base::size(comm); ++sender) {
    if (sender > 0) Receiver(comm, sender)(row, rest);
    for (size_t j = 0; j < row.size(); ++j) whole.springs.rest_length[row[j]] = rest[j];
  }
}

double least_rest_ratio(const Model& model) {
  double least = 1;
  for (size_t j = 0; j < model.springs.points.size(); ++j)
    if (length(model, j) > 0)
      least = std::min(least, model.springs.rest_length[j] / length(model, j));
  return least;
}

}  // namespace

Prestress prestress(MPI_Comm comm, Model& model, Recording as) {
  MPI_Bcast(&as, sizeof as, MPI_BYTE, 0, comm);
  Part part = distribute(comm, model);
  const std::vector<char> skin = skin_springs(comm, model, part);
  for (size_t j = 0; j < skin.size(); ++j)
    part.model.springs.rest_length[j] = length(part.model, j) / (skin[j] ? 1 + as.turgor : 1.0);
  part.model.gravity = as.gravity;
  for (Vec3& force : part.model.points.external_force) force.setZero();

  Prestress result;
  Stiffness stiffness(comm, part, skin);
  std::vector<double> tension(skin.size(), 0.0);
  constexpr int most_refinements = 6;
  for (int pass = 0; pass <= most_refinements; ++pass) {
    const base::VecHandle force = initial_forces(comm, part);
    result.residual = largest_block(force);
    if (pass == 0) result.largest_force = result.residual;
    if (result.residual <= balanced * result.largest_force) break;
    if (pass == most_refinements) {
      if (result.residual <= rounding_force(comm, part)) break;
      refuse_unbalanced(comm, model, part, force, result);
    }
    stiffness.balance(force, tension);
    set_rest_lengths(skin, tension, part.model);
    require_rest_lengths(comm, model, part, tension);
  }
  collect(comm, part, model);
  result.least_rest_ratio = least_rest_ratio(part.model);
  MPI_Allreduce(MPI_IN_PLACE, &result.least_rest_ratio, 1, MPI_DOUBLE, MPI_MIN, comm);
  return result;
}

}  // namespace repose::solve
