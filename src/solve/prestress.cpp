#include "repose/solve/prestress.h"

#include <algorithm>
#include <cmath>

#include "repose/mechanics/spring_law.h"
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

std::vector<char> skin_springs(const Model& model) {
  const auto name = std::find(model.spring_sets.begin(), model.spring_sets.end(), "layer 0");
  const auto set = static_cast<int32_t>(name - model.spring_sets.begin());
  std::vector<char> skin;
  for (int32_t s : model.springs.set) skin.push_back(s == set);
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

/// The forces of the model on its soft-tissue points at the initial position, as a vector.
class InitialForces {
 public:
  explicit InitialForces(const Model& model)
      : part_(distribute(PETSC_COMM_SELF, model)),
        positions_(PETSC_COMM_SELF, part_),
        objective_(positions_, {}) {}
  base::VecHandle forces() {
    base::VecHandle at_rest = positions_.make_vector(), out = positions_.make_vector();
    positions_.update(at_rest);
    positions_.keep_owned(objective_.residual_force(), out);
    return out;
  }
  Positions& positions() { return positions_; }
  Objective& objective() { return objective_; }
  const Part& part() const { return part_; }

 private:
  Part part_;
  Positions positions_;
  Objective objective_;
};

/// The model whose Hessian at the initial position is A K Aᵀ: linear springs at rest, none in the
/// skin, whose tension is given.
Model stiffness_model(const Model& model, const std::vector<char>& skin) {
  Model linear = model;
  linear.prisms = {};
  for (size_t j = 0; j < skin.size(); ++j) {
    linear.springs.exponent[j] = 0;
    linear.springs.rest_length[j] = length(model, j);
    if (skin[j]) linear.springs.stiffness[j] = 0;
  }
  return linear;
}

/// Adds to `tension` the K Aᵀ μ with (A K Aᵀ) μ = −`force`.
void balance(InitialForces& system, TangentSolver& solver, const std::vector<char>& skin,
             const Model& model, Vec force, std::vector<double>& tension) {
  base::VecHandle multiplier = system.positions().make_vector();
  base::VecHandle initial = system.positions().make_vector();
  check(VecScale(force, -1));
  solver.solve(initial, force, multiplier, 1e-10);
  std::vector<Vec3> local(model.points.position.size(), Vec3::Zero());
  system.positions().spread(multiplier, local);
  std::vector<Vec3> mu(local.size());
  for (size_t i = 0; i < local.size(); ++i) mu[system.part().point_row[i]] = local[i];
  for (size_t j = 0; j < skin.size(); ++j) {
    const auto& [p, q] = model.springs.points[j];
    const double r = length(model, j);
    if (skin[j] || r == 0) continue;
    const Vec3 u = (model.points.position[q] - model.points.position[p]) / r;
    tension[j] += model.springs.stiffness[j] * u.dot(mu[p] - mu[q]);
  }
}

void set_rest_lengths(Model& model, const std::vector<char>& skin,
                      const std::vector<double>& tension) {
  int64_t impossible = 0, first = -1;
  for (size_t j = 0; j < skin.size(); ++j) {
    if (skin[j]) continue;
    const double l = length(model, j) - elongation_at(model.springs, j, tension[j]);
    if (!(l > 0) && first < 0) first = static_cast<int64_t>(j);
    impossible += !(l > 0);
    model.springs.rest_length[j] = l;
  }
  if (first < 0) return;
  const auto& [p, q] = model.springs.points[first];
  const Vec3& at = model.points.position[p];
  base::refuse(
      "the initial equilibrium asks {} springs to be shorter than nothing at rest; the first is "
      "spring {} ({}, points {} and {} near ({:.2f}, {:.2f}, {:.2f}) mm): it would have to carry "
      "{:.3g} N over {:.3g} mm; lower tissue.turgor or the mass, or raise the stiffness of that "
      "set",
      impossible, first, model.spring_sets[model.springs.set[first]], p, q, at.x(), at.y(), at.z(),
      tension[first], length(model, first));
}

[[noreturn]] void refuse_unbalanced(const InitialForces& now, Vec force, double before) {
  const PetscScalar* values = nullptr;
  check(VecGetArrayRead(force, &values));
  int64_t worst = 0;
  double largest = -1;
  for (int64_t i = 0; i < now.part().owned_points; ++i) {
    if (now.part().unknown[i] < 0) continue;
    const double f = Eigen::Map<const Vec3>(values + 3 * now.part().unknown[i]).norm();
    if (f > largest) largest = f, worst = i;
  }
  check(VecRestoreArrayRead(force, &values));
  const Vec3& at = now.part().model.points.position[worst];
  base::refuse(
      "the initial equilibrium leaves {:.3g} N (of {:.3g} N) on point {} at ({:.2f}, {:.2f}, "
      "{:.2f}) "
      "mm: its springs cannot hold it; give tissue.springs a stiffness there",
      largest, before, now.part().point_row[worst], at.x(), at.y(), at.z());
}

}  // namespace

Prestress prestress(Model& model, double turgor) {
  const std::vector<char> skin = skin_springs(model);
  for (size_t j = 0; j < skin.size(); ++j)
    model.springs.rest_length[j] = length(model, j) / (skin[j] ? 1 + turgor : 1.0);
  const std::vector<Vec3> external = std::exchange(
      model.points.external_force, std::vector<Vec3>(model.points.position.size(), Vec3::Zero()));

  Prestress result;
  InitialForces system(stiffness_model(model, skin));
  Tangent tangent(system.objective());
  TangentSolver solver(system.positions(), tangent);
  std::vector<double> tension(skin.size(), 0.0);
  constexpr int most_refinements = 6;
  for (int pass = 0; pass <= most_refinements; ++pass) {
    InitialForces now(model);
    base::VecHandle force = now.forces();
    result.residual = largest_block(force);
    if (pass == 0) result.largest_force = result.residual;
    if (result.residual <= balanced * result.largest_force) break;
    if (pass == most_refinements) refuse_unbalanced(now, force, result.largest_force);
    balance(system, solver, skin, model, force, tension);
    set_rest_lengths(model, skin, tension);
  }
  model.points.external_force = external;
  for (size_t j = 0; j < skin.size(); ++j)
    if (length(model, j) > 0)
      result.least_rest_ratio =
          std::min(result.least_rest_ratio, model.springs.rest_length[j] / length(model, j));
  return result;
}

}  // namespace repose::solve
