#include "recompute.h"

#include <algorithm>
#include <cmath>

#include "check_terms.h"
#include "repose/mechanics/spring_law.h"
#include "repose/mechanics/stress.h"
#include "repose/mechanics/term.h"
#include "repose/model/prism_geometry.h"

namespace repose::tools::check {

using model::VolumeTerm;

namespace {

constexpr double rounding = 1e-14;  // of a sum's terms: 45 units in the last place
constexpr double tolerance = 1e-9;  // what scales are made for

double scale_of(double value, double uncertainty) {
  return std::abs(value) + uncertainty / tolerance;
}

struct SpringState {
  Vec3 direction;  // u
  double length, elongation, tension, tangent, energy;
  /// Size of the terms that cancel in a force, N: its rounding error is `rounding` times this.
  double noise() const { return std::abs(tension) + tangent * length; }
};

double extent_of(const std::array<Vec3, 6>& corners) {
  double extent = 0;
  for (const Vec3& corner : corners) extent = std::max(extent, (corner - corners[0]).norm());
  return extent;
}

// v is affine in each corner, so its difference quotients are its derivatives, whatever the step.
// They are taken near the origin: far from it, the step would be rounded like the coordinates.
std::array<Vec3, 6> volume_gradient(std::array<Vec3, 6> corners, double step) {
  const Vec3 origin = corners[0];
  for (Vec3& corner : corners) corner -= origin;
  std::array<Vec3, 6> gradient;
  for (int c = 0; c < 6; ++c)
    for (int axis = 0; axis < 3; ++axis) {
      const double at = corners[c][axis];
      corners[c][axis] = at + step;
      const double above = model::prism_volume(corners.data());
      corners[c][axis] = at - step;
      const double below = model::prism_volume(corners.data());
      corners[c][axis] = at;
      gradient[c][axis] = step > 0 ? (above - below) / (2 * step) : 0;
    }
  return gradient;
}

class Recomputation {
 public:
  Recomputation(const model::Model& model, const model::PrescribedMotion& motion,
                const model::StepNumbers& claimed, const model::StepRows& rows,
                const std::vector<Film>& films)
      : model_(model),
        motion_(motion),
        claimed_(claimed),
        x_(rows.position),
        fields_(rows.point_fields),
        films_(films) {}

  RecomputedStep run() {
    points();
    springs();
    edges();
    terms();
    // All films are closed at the initial state.
    add_forces(evaluate(model_, films_, motion_, claimed_.load, x_));
    add_forces(evaluate_supports(model_, motion_, claimed_.load, x_));
    contact();
    forces();
    gradient_.assign(x_.size(), Vec3::Zero());
    noise_.assign(x_.size(), 0.0);
    prisms();
    objective();
    gradient();
    return std::move(step_);
  }

 private:
  double elastic() const { return claimed_.volume == VolumeTerm::paper ? claimed_.lambda : 1.0; }
  bool soft(int64_t i) const { return model_.points.set[i] == model::PointSet::soft_tissue; }
  template <size_t K>
  bool any_soft(const std::array<int64_t, K>& points) const {
    return std::any_of(points.begin(), points.end(), [this](int64_t i) { return soft(i); });
  }
  SpringState spring(int64_t j) const;
  void points();
  void springs();
  void edges();
  void terms();
  void add_forces(const std::vector<PointForce>& forces);
  void contact();
  void forces();
  void nodal_volumes();
  double volume_slope(int64_t j, double volume) const;
  void solid_prism(int64_t j);
  void stress(int64_t j, const std::array<Vec3, 6>& corners);
  void prisms();
  void prism(int64_t j);
  void objective();
  void gradient();
  void force_functional_gradient();

  const model::Model& model_;
  const model::PrescribedMotion& motion_;
  const model::StepNumbers& claimed_;
  const std::vector<Vec3>& x_;
  const std::vector<model::PointField>& fields_;
  const std::vector<Film>& films_;
  double smooth_force_ = 0;             // Σ (√(|F|² + ε²) − ε)
  std::vector<double> at_point_;        // [N] Σ noise of the forces there, N
  std::vector<double> nodal_pressure_;  // [N] e/C of averaged volumes, N/mm², or empty
  std::vector<Vec3> gradient_;          // [N] of the objective
  std::vector<double> noise_;           // [N] of the gradient
  RecomputedStep step_;
};

SpringState Recomputation::spring(int64_t j) const {
  const model::Springs& s = model_.springs;
  const Vec3 d = x_[s.points[j][1]] - x_[s.points[j][0]];
  SpringState state;
  state.length = d.norm();
  state.direction = state.length > 0 ? Vec3(d / state.length) : Vec3::Zero();
  state.elongation = state.length - s.rest_length[j];
  mechanics::with_exponent(s.exponent[j], [&]<int p>() {
    const double e = state.elongation, k = s.stiffness[j], inverse = 1.0 / s.reference[j];
    state.tension = mechanics::spring_tension<p>(e, k, inverse);
    state.tangent = mechanics::spring_tangent<p>(e, k, inverse);
    state.energy = mechanics::spring_energy<p>(e, k, inverse);
  });
  return state;
}

void Recomputation::points() {
  double coordinate = 0, moved = 0;
  for (size_t i = 0; i < x_.size(); ++i) {
    step_.displacement.push_back(x_[i] - model_.points.position[i]);
    coordinate = std::max(coordinate, x_[i].lpNorm<Eigen::Infinity>());
    coordinate = std::max(coordinate, model_.points.position[i].lpNorm<Eigen::Infinity>());
    moved = std::max(moved, step_.displacement[i].norm());
  }
  step_.scale.position = coordinate;
  step_.scale.displacement = scale_of(moved, rounding * coordinate);
}

void Recomputation::springs() {
  at_point_.assign(x_.size(), 0.0);
  step_.rows.residual_force.assign(x_.size(), Vec3::Zero());
  double uncertain = 0, elongation = 0, length = 0, tension = 0, noise = 0;
  for (size_t j = 0; j < model_.springs.points.size(); ++j) {
    const SpringState s = spring(j);
    const auto [p, q] = model_.springs.points[j];
    step_.rows.elongation.push_back(s.elongation);
    step_.rows.tension.push_back(s.tension);
    elongation = std::max(elongation, std::abs(s.elongation));
    length = std::max(length, s.length);
    tension = std::max(tension, std::abs(s.tension));
    noise = std::max(noise, s.noise());
    for (const int64_t end : {p, q}) at_point_[end] += s.noise();
    if (!any_soft(model_.springs.points[j])) continue;
    step_.f_e.value += s.energy;
    const double slack = rounding * s.length;  // of the elongation
    uncertain += rounding * s.energy + (std::abs(s.tension) + s.tangent * slack) * slack;
    if (soft(p)) step_.rows.residual_force[p] += s.tension * s.direction;
    if (soft(q)) step_.rows.residual_force[q] -= s.tension * s.direction;
  }
  step_.f_e.scale = scale_of(step_.f_e.value, uncertain);
  step_.scale.elongation = scale_of(elongation, rounding * length);
  step_.scale.tension = scale_of(tension, rounding * noise);
}

double edge_energy(const model::Edges& edges, size_t j, const std::vector<Vec3>& x) {
  const auto [p, q] = edges.points[j];
  return 0.5 * edges.weight[j] * (x[q] - x[p]).squaredNorm();
}

// The energies are from the initial state on.
void Recomputation::edges() {
  const model::Edges& edges = model_.edges;
  double uncertain = 0;
  for (size_t j = 0; j < edges.points.size(); ++j) {
    const auto [p, q] = edges.points[j];
    const Vec3 force = edges.weight[j] * (x_[q] - x_[p]);
    const double now = edge_energy(edges, j, x_);
    const double before = edge_energy(edges, j, model_.points.position);
    step_.f_e.value += now - before;
    uncertain += rounding * (std::abs(now) + std::abs(before));
    if (soft(p)) step_.rows.residual_force[p] += force;
    if (soft(q)) step_.rows.residual_force[q] -= force;
    for (const int64_t end : {p, q}) at_point_[end] += force.norm();
  }
  step_.f_e.scale += uncertain / tolerance;
  if (!model_.prisms.nodal_modulus.empty()) nodal_volumes();
  for (size_t j = 0; j < model_.prisms.modulus.size(); ++j) solid_prism(static_cast<int64_t>(j));
  step_.f_e.scale += std::abs(step_.f_e.value);
}

// φ′, N/mm².
double Recomputation::volume_slope(int64_t j, double volume) const {
  const model::Prisms& prisms = model_.prisms;
  const double v0 = prisms.rest_volume[j], change = volume / v0 - 1;
  const double at_rest = prisms.modulus[j] * (1 - prisms.target_volume[j] / v0);
  if (nodal_pressure_.empty()) return at_rest + prisms.modulus[j] * change;
  double averaged = 0;
  for (const int64_t point : prisms.points[j]) averaged += nodal_pressure_[point] / 6;
  return at_rest + (prisms.modulus[j] - prisms.nodal_modulus[j]) * change + averaged;
}

// A sixth of each prism's change of volume to each of its points, over as much of its compliance.
void Recomputation::nodal_volumes() {
  const model::Prisms& prisms = model_.prisms;
  std::vector<double> change(x_.size(), 0.0), compliance(x_.size(), 0.0);
  for (size_t j = 0; j < prisms.points.size(); ++j) {
    const std::array<Vec3, 6> corners = base::pick(x_, prisms.points[j]);
    const double v0 = prisms.rest_volume[j];
    for (const int64_t point : prisms.points[j]) {
      change[point] += (model::prism_volume(corners.data()) - v0) / 6;
      compliance[point] += v0 / prisms.nodal_modulus[j] / 6;
    }
  }
  for (size_t i = 0; i < x_.size(); ++i) {
    nodal_pressure_.push_back(compliance[i] > 0 ? change[i] / compliance[i] : 0);
    step_.f_e.value += 0.5 * nodal_pressure_[i] * change[i];
  }
}

void Recomputation::solid_prism(int64_t j) {
  const model::Prisms& prisms = model_.prisms;
  const std::array<Vec3, 6> corners = base::pick(x_, prisms.points[j]);
  const double extent = extent_of(corners);
  stress(j, corners);
  const double stiffness = prisms.modulus[j] / prisms.rest_volume[j];
  const double own = nodal_pressure_.empty() ? 1 : 1 - prisms.nodal_modulus[j] / prisms.modulus[j];
  const double before = prisms.rest_volume[j] - prisms.target_volume[j];
  const double volume = model::prism_volume(corners.data());
  const double now = volume - prisms.target_volume[j], change = volume - prisms.rest_volume[j];
  const double uncertain = extent * extent * extent + prisms.rest_volume[j];
  const double slope = volume_slope(j, volume);
  step_.f_e.value += stiffness * change * (0.5 * own * change + before);
  step_.f_e.scale +=
      rounding / tolerance * stiffness * (now * now + before * before + std::abs(now) * uncertain);
  const std::array<Vec3, 6> toward = volume_gradient(corners, extent);
  for (int c = 0; c < 6; ++c) {
    const int64_t point = prisms.points[j][c];
    if (soft(point)) step_.rows.residual_force[point] -= slope * toward[c];
    at_point_[point] += extent * extent * stiffness * (std::abs(now) + uncertain);
  }
}

void Recomputation::stress(int64_t j, const std::array<Vec3, 6>& corners) {
  const model::Prisms& prisms = model_.prisms;
  const std::array<Vec3, 6> before = base::pick(model_.points.position, prisms.points[j]);
  const mechanics::PrismState state =
      mechanics::prism_state(prisms.shear_modulus[j],
                             volume_slope(j, model::prism_volume(corners.data())), before, corners);
  step_.rows.pressure.push_back(state.pressure);
  step_.rows.von_mises.push_back(state.von_mises);
  step_.rows.stretch.push_back(state.stretch);
  const double stress = prisms.modulus[j] * (1 + std::abs(state.stretch.prod())) +
                        prisms.shear_modulus[j] * state.stretch.squaredNorm();
  step_.scale.stress =
      std::max(step_.scale.stress, std::abs(state.pressure) + state.von_mises + 1e-4 * stress);
  step_.scale.stretch = std::max(step_.scale.stretch, state.stretch[0]);
}

// Their energies are from the initial state on.
void Recomputation::terms() {
  for (const model::TermElements& elements : model_.elements) {
    if (elements.term == "adhesion" || elements.term == "elastic_support") continue;
    const mechanics::Term& term = mechanics::term_of(elements);
    double uncertain = 0;
    for (size_t e = 0; e < elements.size(); ++e) {
      const auto points = elements.points_of(e);
      if (std::none_of(points.begin(), points.end(), [&](int64_t p) { return soft(p); })) continue;
      Eigen::VectorXd slope;
      const auto numbers = elements.numbers_of(e);
      const double before =
          term.gradient(base::pick(model_.points.position, points), numbers, slope);
      const int32_t bone = elements.bone_of(e);
      const Mat4 pose =
          bone < 0 ? Mat4(Mat4::Identity()) : motion_.bone_matrix(bone, claimed_.load);
      const Mat3 turn = pose.topLeftCorner<3, 3>();
      std::vector<Vec3> places;
      for (const int64_t p : points)
        places.push_back(turn.transpose() * (x_[p] - pose.topRightCorner<3, 1>()));
      const double now = term.gradient(places, numbers, slope);
      step_.f_e.value += now - before;
      uncertain += std::abs(now) + std::abs(before);
      for (size_t i = 0; i < points.size(); ++i) {
        const Vec3 part = turn * slope.segment<3>(static_cast<Eigen::Index>(3 * i));
        if (soft(points[i])) step_.rows.residual_force[points[i]] -= part;
        at_point_[points[i]] += part.norm();
      }
    }
    step_.f_e.scale += rounding * uncertain / tolerance + std::abs(step_.f_e.value);
  }
}

void Recomputation::add_forces(const std::vector<PointForce>& forces) {
  double uncertain = 0;
  for (const PointForce& state : forces) {
    step_.f_e.value += state.energy;
    uncertain += state.energy + step_.scale.position * state.force.norm();
    if (soft(state.point)) step_.rows.residual_force[state.point] += state.force;
    at_point_[state.point] += state.force.norm() + state.noise;
  }
  step_.f_e.scale += rounding * uncertain / tolerance + std::abs(step_.f_e.value);
}

// The forces are checked by themselves (check_contact.h).
void Recomputation::contact() {
  for (const model::PointField& field : fields_) {
    if (field.name != "contact_force") continue;
    for (size_t i = 0; i < x_.size(); ++i) {
      const Vec3 force = Vec3::Map(field.values.data() + 3 * i);
      if (soft(i)) step_.rows.residual_force[i] += force;
      at_point_[i] += force.norm();
    }
  }
}

void Recomputation::forces() {
  double uncertain_force = 0, uncertain_work = 0, largest = 0;
  for (size_t i = 0; i < x_.size(); ++i) {
    if (!soft(i)) continue;
    Vec3& force = step_.rows.residual_force[i];
    const Vec3 load = model_.points.mass[i] * model_.gravity + model_.points.external_force[i];
    force += load;
    at_point_[i] += load.norm();
    const double e = claimed_.epsilon;
    step_.f_f.value += force.norm();
    smooth_force_ += std::hypot(force.norm(), e) - e;
    uncertain_force += rounding * at_point_[i];
    largest = std::max(largest, at_point_[i]);
    const double work = load.dot(step_.displacement[i]);
    step_.potential.value -= work;
    uncertain_work +=
        rounding * load.norm() * (step_.displacement[i].norm() + step_.scale.position);
  }
  step_.f_f.scale = scale_of(step_.f_f.value, uncertain_force);
  step_.potential.scale = scale_of(step_.potential.value, uncertain_work);
  step_.scale.force = scale_of(step_.scale.tension, rounding * largest);
}

void Recomputation::prism(int64_t j) {
  const model::Prisms& prisms = model_.prisms;
  const std::array<Vec3, 6> corners = base::pick(x_, prisms.points[j]);
  const double extent = extent_of(corners);
  const double v = model::prism_volume(corners.data()), v0 = prisms.rest_volume[j];
  const double change = v - v0, uncertain = rounding * (extent * extent * extent + v0);
  step_.rows.volume_ratio.push_back(v / v0);
  step_.scale.ratio = std::max(step_.scale.ratio, 1 + scale_of(v / v0, rounding + uncertain / v0));
  if (!any_soft(prisms.points[j])) return;
  const double kappa = claimed_.bulk_modulus;
  const double square_error = uncertain * (2 * std::abs(change) + uncertain);
  step_.f_v.value += change * change;
  step_.f_v.scale += scale_of(change * change, square_error);
  step_.penalty.value += 0.5 * kappa * change * change / v0;
  step_.penalty.scale += scale_of(change * change, square_error) * 0.5 * kappa / v0;
  step_.volume_error_max.value = std::max(step_.volume_error_max.value, std::abs(v / v0 - 1));
  step_.inverted_prisms += v <= 0;
  if (model::is_solid(model_)) return;
  double slope = 0, curvature = 0;
  if (claimed_.volume == VolumeTerm::paper) {
    slope = 2 * (1 - claimed_.lambda) * change;
    curvature = 2 * (1 - claimed_.lambda);
  } else if (claimed_.volume == VolumeTerm::penalty) {
    slope = kappa * change / v0;
    curvature = kappa / v0;
  }
  const std::array<Vec3, 6> toward = volume_gradient(corners, extent);
  for (int c = 0; c < 6; ++c) {
    const int64_t point = prisms.points[j][c];
    gradient_[point] += slope * toward[c];
    noise_[point] += extent * extent * (std::abs(slope) + curvature * uncertain / rounding);
  }
}

void Recomputation::prisms() {
  for (size_t j = 0; j < model_.prisms.points.size(); ++j) prism(static_cast<int64_t>(j));
  step_.volume_error_max.scale = step_.scale.ratio;
}

void Recomputation::objective() {
  Recomputed f{smooth_force_, scale_of(smooth_force_, tolerance * step_.f_f.scale)};
  if (claimed_.functional == model::Functional::energy)
    f = {step_.f_e.value + step_.potential.value, step_.f_e.scale + step_.potential.scale};
  step_.objective = {elastic() * f.value, elastic() * f.scale};
  const double volume_weight = claimed_.volume == VolumeTerm::paper ? 1 - elastic() : 0;
  step_.objective.value += volume_weight * step_.f_v.value;
  step_.objective.scale += volume_weight * step_.f_v.scale;
  if (std::isfinite(claimed_.contact_energy)) {
    step_.objective.value += elastic() * claimed_.contact_energy;
    step_.objective.scale += std::abs(claimed_.contact_energy);
  }
  if (claimed_.volume != VolumeTerm::penalty) return;
  step_.objective.value += step_.penalty.value;
  step_.objective.scale += step_.penalty.scale;
}

// ∇f_f = Σ_i w_i · ∂F_i/∂x with w = F/√(|F|²+ε²); a spring's ∂(T u)/∂d = T' u uᵀ + (T/r)(1 − u uᵀ).
void Recomputation::force_functional_gradient() {
  std::vector<Vec3> w(x_.size(), Vec3::Zero());
  std::vector<double> uncertain(x_.size(), 0.0);
  for (size_t i = 0; i < x_.size(); ++i) {
    const Vec3& force = step_.rows.residual_force[i];
    const double length = std::hypot(force.norm(), claimed_.epsilon);
    if (!soft(i) || length == 0) continue;
    w[i] = force / length;
    uncertain[i] = std::min(2.0, rounding * at_point_[i] / length);
  }
  for (size_t j = 0; j < model_.springs.points.size(); ++j) {
    const auto [p, q] = model_.springs.points[j];
    const SpringState s = spring(j);
    if (s.length == 0) continue;
    const Vec3 apart = w[p] - w[q], &u = s.direction;
    const double across = s.tension / s.length, along = apart.dot(u);
    const Vec3 force = across * apart + (s.tangent - across) * along * u;
    const double stiffness = s.tangent + std::abs(across);
    const double noise = stiffness * (2 + (uncertain[p] + uncertain[q]) / rounding);
    gradient_[q] += elastic() * force;
    gradient_[p] -= elastic() * force;
    for (const int64_t end : {p, q}) noise_[end] += elastic() * noise;
  }
}

void Recomputation::gradient() {
  if (claimed_.functional == model::Functional::energy)
    for (size_t i = 0; i < x_.size(); ++i) {
      gradient_[i] -= elastic() * step_.rows.residual_force[i];
      noise_[i] += elastic() * at_point_[i];
    }
  else
    force_functional_gradient();
  double noise = 0;
  for (size_t i = 0; i < x_.size(); ++i) {
    if (!soft(i)) continue;
    step_.gradient_max.value = std::max(step_.gradient_max.value, gradient_[i].norm());
    noise = std::max(noise, noise_[i]);
  }
  step_.gradient_max.scale = scale_of(step_.gradient_max.value, rounding * noise);
}

}  // namespace

RecomputedStep recompute(const model::Model& model, const model::PrescribedMotion& motion,
                         const model::StepNumbers& claimed, const model::StepRows& rows,
                         const std::vector<Film>& films) {
  RecomputedStep step = Recomputation(model, motion, claimed, rows, films).run();
  step.rows.position = rows.position;
  return step;
}

}  // namespace repose::tools::check
