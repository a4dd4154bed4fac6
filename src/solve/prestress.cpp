#include "repose/solve/prestress.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>

#include "repose/base/agreement.h"
#include "repose/base/collective.h"
#include "repose/base/error.h"
#include "repose/base/log.h"
#include "repose/discrete/natural_rows.h"
#include "repose/discrete/tangent.h"
#include "repose/linear/tangent_solver.h"
#include "repose/mechanics/prism_volume.h"
#include "repose/mechanics/spring_law.h"
#include "repose/model/material.h"

namespace repose::solve {

using base::check;
using model::Model;

namespace {

constexpr double balanced = 1e-12;  // of the largest force before

/// A prism's volume at the initial position and its derivatives.
mechanics::PrismSlope<double> volume_slope(const Model& model, size_t prism) {
  return mechanics::PrismSlope(
      mechanics::PrismEdges<double>(mechanics::triples(model::corners_of(model, prism))));
}

/// Returns a flag for each local spring: 1 in the skin, whose tension is given. The names are known
/// on rank 0.
std::vector<char> skin_springs(MPI_Comm comm, const discrete::LocalModel& local_model) {
  const std::vector<std::string>& names = local_model.global_metadata.spring_sets;
  auto set = static_cast<int32_t>(std::ranges::find(names, "layer 0") - names.begin());
  base::broadcast(comm, set);
  std::vector<char> skin;
  for (int32_t s : local_model.part.model.springs.set) skin.push_back(s == set);
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

/// Removes what is not tissue: its tensions balance the forces on points that slide, too, and
/// neither bodies nor further terms carry any.
void keep_tissue_alone(discrete::Part& part) {
  part.contact = false;
  part.model.contact = {};
  part.model.elements.clear();
}

/// Linear springs at rest between the points of `part` and, of a solid, prisms at rest. At the
/// initial position the Hessian of their energy is A K Aᵀ.
discrete::Part stiffness_part(discrete::Part part, const std::vector<char>& skin) {
  keep_tissue_alone(part);
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

/// Returns the part of the quadratic form Σ q² r⁴/(Y v) + Σ p² V/K: springs of stiffness Y v / r²
/// in place of its edges, prisms of modulus K that are at rest.
discrete::Part solid_stiffness_part(discrete::Part part) {
  constexpr double pairs = 15;
  keep_tissue_alone(part);
  Model& model = part.model;
  model::Springs& springs = model.springs;
  std::map<std::array<int64_t, 2>, double> share;  // Σ E V / 15, N·mm
  for (size_t m = 0; m < model.prisms.points.size(); ++m) {
    const double shear = model.prisms.shear_modulus[m], lame = model.prisms.modulus[m] - shear;
    const double young = model::young_modulus({shear, model.prisms.modulus[m]});
    for (const auto& [a, b] : model::prism_pairs) {
      const int64_t p = model.prisms.points[m][a], q = model.prisms.points[m][b];
      share[base::sorted_pair(p, q)] += young * model.prisms.rest_volume[m] / pairs;
    }
    model.prisms.modulus[m] = lame + 2 * shear / 3;
  }
  model.prisms.target_volume = model.prisms.rest_volume;
  model.prisms.nodal_modulus.clear();
  model.prisms.shear_modulus.assign(model.prisms.points.size(), 0.0);
  springs.points = std::move(model.edges.points);
  model.edges = {};
  const size_t count = springs.points.size();
  springs.exponent.assign(count, 0);
  springs.reference.assign(count, 1);
  for (size_t j = 0; j < count; ++j) {
    const auto [p, q] = springs.points[j];
    const auto energy = share.find(base::sorted_pair(p, q));
    springs.rest_length.push_back(length(model, j));
    springs.stiffness.push_back(
        energy == share.end() ? 0 : energy->second / std::pow(springs.rest_length[j], 2));
  }
  part.owned_springs = part.owned_edges;
  return part;
}

/// A K Aᵀ and its solver. One object so that they live and end together.
class Stiffness {
 public:
  Stiffness(MPI_Comm comm, discrete::Part part)
      : part_(std::move(part)),
        positions_(comm, part_),
        objective_(positions_, part_.solid ? mechanics::solid_weights : mechanics::Weights{}),
        tangent_(objective_),
        solver_(positions_, tangent_),
        multiplier_(part_.model.points.position.size(), Vec3::Zero()) {}

  /// Solves (A K Aᵀ) μ = −`force` to that part of the force which is left to balance.
  void solve(Vec force, const Prestress& so_far) {
    constexpr double minimum = 1e-10, below = 1e-2;
    const double left = below * balanced * so_far.largest_force / so_far.residual;
    base::VecHandle multiplier = positions_.make_vector();
    const base::VecHandle initial = positions_.make_vector();
    check(VecScale(force, -1));
    solver_.solve(initial, force, multiplier, std::max(minimum, left));
    positions_.scatter_to_local(multiplier, multiplier_);
  }
  /// Returns a spring's component of K Aᵀ μ, N.
  double tension(size_t spring) const {
    const Model& model = part_.model;
    const auto& [p, q] = model.springs.points[spring];
    const double r = length(model, spring);
    if (r == 0) return 0;
    const Vec3 u = (model.points.position[q] - model.points.position[p]) / r;
    return model.springs.stiffness[spring] * u.dot(multiplier_[p] - multiplier_[q]);
  }
  /// And the pressure of a prism, N/mm².
  double pressure(size_t prism) const {
    const Model& model = part_.model;
    const auto v = volume_slope(model, prism);
    double change = 0;
    for (int c = 0; c < 6; ++c)
      change += mechanics::vec3(v.gradient[c]).dot(multiplier_[model.prisms.points[prism][c]]);
    return model.prisms.modulus[prism] / model.prisms.rest_volume[prism] * change;
  }

 private:
  discrete::Part part_;
  discrete::Positions positions_;
  discrete::Objective objective_;
  discrete::Tangent tangent_;
  linear::TangentSolver solver_;
  std::vector<Vec3> multiplier_;  // [local points] μ, mm
};

/// The forces on the soft-tissue points at the initial position.
base::VecHandle initial_forces(MPI_Comm comm, const discrete::Part& part) {
  discrete::Positions positions(comm, part);
  discrete::Objective objective(positions,
                                part.solid ? mechanics::solid_weights : mechanics::Weights{});
  const base::VecHandle at_rest = positions.make_vector();
  base::VecHandle forces = positions.make_vector();
  positions.update(at_rest);
  positions.restrict_to_owned(objective.residual_force(), forces);
  return forces;
}

/// Units in the last place that sums and directions of forces are known to.
constexpr double rounded = 4 * std::numeric_limits<double>::epsilon();

/// Adds what rounding leaves of each spring: its tension is known to its tangent times half a unit
/// in the last place of its length, and itself to `rounded`.
void add_rounding_of_springs(const Model& model, std::vector<double>& force) {
  for (size_t j = 0; j < model.springs.points.size(); ++j) {
    const double r = length(model, j), s = r - model.springs.rest_length[j],
                 k = model.springs.stiffness[j], inverse = 1.0 / model.springs.reference[j];
    const double left = mechanics::with_exponent(model.springs.exponent[j], [&]<int p>() {
      return 0.5 * std::numeric_limits<double>::epsilon() * r *
                 mechanics::spring_tangent<p>(s, k, inverse) +
             rounded * std::abs(mechanics::spring_tension<p>(s, k, inverse));
    });
    for (const int64_t point : model.springs.points[j]) force[point] += left;
  }
}

/// Adds what rounding leaves of a solid's edges and of the pressure of its prisms, whose volume is
/// known to `rounded`.
void add_rounding_of_solid(const Model& model, std::vector<double>& force) {
  for (size_t j = 0; j < model.edges.points.size(); ++j) {
    const auto [p, q] = model.edges.points[j];
    const double left = rounded * std::abs(model.edges.weight[j]) *
                        (model.points.position[q] - model.points.position[p]).norm();
    force[p] += left;
    force[q] += left;
  }
  for (size_t m = 0; m < model.prisms.points.size(); ++m) {
    const auto slope = volume_slope(model, m);
    const double pressure =
        rounded * model.prisms.modulus[m] * std::abs(slope.volume) / model.prisms.rest_volume[m];
    for (int c = 0; c < 6; ++c)
      force[model.prisms.points[m][c]] += pressure * mechanics::vec3(slope.gradient[c]).norm();
  }
}

/// The largest force that rounding alone can leave on a soft-tissue point, N, where forces cancel
/// that are much larger than those to balance. Collective.
double rounding_force(MPI_Comm comm, const discrete::Part& part) {
  std::vector<double> force(part.model.points.position.size(), 0.0);
  add_rounding_of_springs(part.model, force);
  if (part.solid) add_rounding_of_solid(part.model, force);
  double largest = 0;
  for (int64_t i = 0; i < part.owned_points; ++i)
    if (part.unknown[i] >= 0) largest = std::max(largest, force[i]);
  return base::max_over_ranks(comm, largest);
}

/// Refuses on all ranks where an owned spring of a rank has no positive rest length. Collective.
void require_rest_lengths(MPI_Comm comm, const discrete::LocalModel& local_model,
                          const std::vector<double>& tension) {
  const discrete::Part& part = local_model.part;
  const model::Springs& springs = part.model.springs;
  double first_row = std::numeric_limits<double>::infinity();
  int64_t spring = -1, impossible = 0;
  for (int64_t j = 0; j < part.owned_springs; ++j) {
    if (springs.rest_length[j] > 0) continue;
    ++impossible;
    const auto row = static_cast<double>(part.spring_row[j]);
    if (row < first_row) first_row = row, spring = j;
  }
  impossible = base::sum_over_ranks(comm, impossible);
  if (impossible == 0) return;
  const int first_rank = base::extreme_over_ranks(comm, first_row, MPI_MINLOC).rank;
  int32_t set = spring < 0 ? 0 : springs.set[spring];
  base::Message(comm, first_rank)(set);
  std::string name = base::rank(comm) == 0 ? local_model.global_metadata.spring_sets[set] : "";
  base::broadcast(comm, name);
  base::collective_try(comm, [&] {
    if (base::rank(comm) != first_rank) return;
    const auto& [p, q] = springs.points[spring];
    const Vec3& at = part.model.points.position[p];
    base::refuse(
        "the initial equilibrium requires negative rest lengths of {} springs; the first is spring "
        "{} ({}, points {} and {} near {:.2f} mm): it would have to carry {:.3g} N over {:.3g} mm; "
        "lower tissue.turgor or the mass, or raise the stiffness of that set",
        impossible, part.spring_row[spring], name, part.point_row[p], part.point_row[q], at,
        tension[spring], length(part.model, spring));
  });
}

/// l_j = r_j − T⁻¹(T_j) for all local springs but the skin's.
void set_rest_lengths(const std::vector<char>& skin, const std::vector<double>& tension,
                      Model& model) {
  for (size_t j = 0; j < skin.size(); ++j)
    if (!skin[j])
      model.springs.rest_length[j] = length(model, j) - elongation_at(model.springs, j, tension[j]);
}

/// Refuses on all ranks, naming the point with the largest force. Collective.
void refuse_unbalanced(MPI_Comm comm, const discrete::Part& part, Vec force,
                       const Prestress& so_far) {
  const PetscScalar* values = nullptr;
  check(VecGetArrayRead(force, &values));
  int64_t worst = -1;
  Vec3 at = Vec3::Zero();
  for (int64_t i = 0; i < part.owned_points; ++i) {
    if (part.unknown[i] < 0) continue;
    const auto* f = values + 3 * (part.unknown[i] - part.unknowns.first);
    if (Eigen::Map<const Vec3>(f).norm() < so_far.residual || part.point_row[i] < worst) continue;
    worst = part.point_row[i];
    at = part.model.points.position[i];
  }
  check(VecRestoreArrayRead(force, &values));
  base::max_over_ranks_with(comm, static_cast<double>(worst), worst, at);
  base::refuse(
      "the initial equilibrium leaves {:.3g} N (of {:.3g} N) on point {} at {:.2f} mm: the tissue "
      "there cannot hold it; {}",
      so_far.residual, so_far.largest_force, worst, at,
      part.solid ? "change tissue.turgor or tissue.density"
                 : "give tissue.springs a stiffness there");
}

double min_rest_ratio(const Model& model) {
  double minimum = 1;
  for (size_t j = 0; j < model.springs.points.size(); ++j)
    if (length(model, j) > 0)
      minimum = std::min(minimum, model.springs.rest_length[j] / length(model, j));
  return minimum;
}

/// Adds what balances the force to the solid's edges and prisms; returns the largest pressure
/// added.
double add_balance(const Stiffness& stiffness, Model& model) {
  double largest = 0;
  for (size_t j = 0; j < model.edges.points.size(); ++j) {
    const auto [p, q] = model.edges.points[j];
    model.edges.weight[j] +=
        stiffness.tension(j) / (model.points.position[q] - model.points.position[p]).norm();
  }
  model::Prisms& prisms = model.prisms;
  for (size_t m = 0; m < prisms.points.size(); ++m) {
    const double pressure = stiffness.pressure(m);
    prisms.target_volume[m] += pressure * prisms.rest_volume[m] / prisms.modulus[m];
    largest = std::max(largest, std::abs(pressure));
  }
  return largest;
}

/// Solves for what balances the initial forces until they are rounding; `take_up` puts each
/// solution into the part's model. `part` is without its external forces, under the gravity of the
/// recording.
void balance(MPI_Comm comm, const discrete::Part& part, Stiffness&& stiffness, Prestress& result,
             const std::function<void(const Stiffness&)>& take_up) {
  constexpr int max_refinements = 6;
  for (int pass = 0; pass <= max_refinements; ++pass) {
    const base::VecHandle force = initial_forces(comm, part);
    result.residual = discrete::largest_block(force);
    if (pass == 0) result.largest_force = result.residual;
    if (result.residual <= balanced * result.largest_force) break;
    if (pass == max_refinements) {
      if (result.residual <= rounding_force(comm, part)) break;
      refuse_unbalanced(comm, part, force, result);
    }
    stiffness.solve(force, result);
    take_up(stiffness);
  }
}

Prestress balance_solid(MPI_Comm comm, discrete::Part& part) {
  Prestress result;
  result.solid = true;
  balance(comm, part, Stiffness(comm, solid_stiffness_part(part)), result,
          [&](const Stiffness& stiffness) {
            result.largest_pressure += add_balance(stiffness, part.model);
          });
  result.largest_pressure = base::max_over_ranks(comm, result.largest_pressure);
  return result;
}

Prestress balance_springs(MPI_Comm comm, discrete::LocalModel& local_model, double turgor) {
  Model& model = local_model.part.model;
  const std::vector<char> skin = skin_springs(comm, local_model);
  for (size_t j = 0; j < skin.size(); ++j)
    model.springs.rest_length[j] = length(model, j) / (skin[j] ? 1 + turgor : 1.0);
  std::vector<double> tension(skin.size(), 0.0);
  Prestress result;
  balance(comm, local_model.part, Stiffness(comm, stiffness_part(local_model.part, skin)), result,
          [&](const Stiffness& stiffness) {
            for (size_t j = 0; j < skin.size(); ++j)
              if (!skin[j]) tension[j] += stiffness.tension(j);
            set_rest_lengths(skin, tension, model);
            require_rest_lengths(comm, local_model, tension);
          });
  result.min_rest_ratio = -base::max_over_ranks(comm, -min_rest_ratio(model));
  return result;
}

}  // namespace

Prestress prestress(MPI_Comm comm, discrete::LocalModel& local_model, ReferenceState as) {
  static const PetscLogEvent event = base::log_event("RpPrestress");
  const base::Logged logged(event);
  base::broadcast(comm, as);
  discrete::Part& part = local_model.part;
  const Vec3 gravity = std::exchange(part.model.gravity, as.gravity);
  std::vector<Vec3>& forces = part.model.points.external_force;
  const std::vector<Vec3> acting =
      std::exchange(forces, std::vector(forces.size(), Vec3(Vec3::Zero())));
  const Prestress result =
      part.solid ? balance_solid(comm, part) : balance_springs(comm, local_model, as.turgor);
  part.model.gravity = gravity;
  forces = acting;
  return result;
}

Prestress prestress(MPI_Comm comm, Model& model, ReferenceState as) {
  discrete::LocalModel local_model = discrete::build_local_from_root(comm, model);
  const Prestress result = prestress(comm, local_model, as);
  Model balanced = discrete::gather_model(comm, local_model);
  if (base::rank(comm) == 0) model = std::move(balanced);
  return result;
}

}  // namespace repose::solve
