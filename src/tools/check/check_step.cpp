#include "check_step.h"

#include <algorithm>
#include <limits>

#include "check_contact.h"
#include "recompute.h"
#include "repose/model/prism_geometry.h"

namespace repose::tools::check {

namespace {

constexpr double unlimited = std::numeric_limits<double>::max();
constexpr double infinity = std::numeric_limits<double>::infinity();

std::span<const double> flat(const std::vector<Vec3>& vectors) {
  if (vectors.empty()) return {};
  return {vectors[0].data(), 3 * vectors.size()};
}

void check_ranges(const model::StepNumbers& n, Comparison& comparison) {
  comparison.range("load", n.load, 0, 1);
  comparison.range("lambda", n.lambda, 0, 1);
  comparison.range("bulk_modulus", n.bulk_modulus, 0, unlimited);
  comparison.range("epsilon", n.epsilon, 0, unlimited);
  comparison.range("displacement_error", n.displacement_error, 0, infinity);
  comparison.range("iterations", static_cast<double>(n.iterations), 0, unlimited);
  comparison.range("evaluations", static_cast<double>(n.evaluations), 0, unlimited);
  comparison.range("seconds", n.seconds, 0, unlimited);
}

void check_numbers(const model::StepNumbers& stored, const RecomputedStep& again,
                   Comparison& comparison) {
  const auto same = [&](const char* name, double value, const Recomputed& computed) {
    comparison.number(name, value, computed.value, computed.scale);
  };
  same("f_e", stored.f_e, again.f_e);
  same("potential", stored.potential, again.potential);
  same("f_f", stored.f_f, again.f_f);
  same("f_v", stored.f_v, again.f_v);
  same("penalty", stored.penalty, again.penalty);
  same("objective", stored.objective, again.objective);
  same("gradient_max", stored.gradient_max, again.gradient_max);
  same("volume_error_max", stored.volume_error_max, again.volume_error_max);
  comparison.number("inverted_prisms", static_cast<double>(stored.inverted_prisms),
                    static_cast<double>(again.inverted_prisms), 0);
}

/// Positions of the points that are not unknown; a soft-tissue point's are taken as they are.
std::vector<Vec3> prescribed(const model::Model& model, const model::PrescribedMotion& motion,
                             double load, std::vector<Vec3> position) {
  for (size_t i = 0; i < position.size(); ++i)
    if (model.points.set[i] != model::PointSet::soft_tissue)
      position[i] = motion.at(model, static_cast<int64_t>(i), load);
  return position;
}

}  // namespace

void check_step(const model::Model& model, const model::PrescribedMotion& motion,
                const results::StoredStep& step, const std::vector<Film>& films,
                Comparison& comparison) {
  const model::StepNumbers& numbers = step.numbers;
  const model::StepRows& rows = step.rows;
  const RecomputedStep again = recompute(
      model, numbers, rows, films, evaluate(model, films, motion, numbers.load, rows.position));
  check_ranges(numbers, comparison);
  check_numbers(numbers, again, comparison);
  const std::vector<Vec3> fixed = prescribed(model, motion, numbers.load, rows.position);
  comparison.array("point/position, fixed", flat(rows.position), flat(fixed), again.position_scale);
  comparison.array("point/displacement", flat(step.displacement), flat(again.displacement),
                   again.displacement_scale);
  comparison.array("point/residual_force", flat(rows.residual_force),
                   flat(again.rows.residual_force), again.force_scale);
  comparison.array("prism/volume_ratio", rows.volume_ratio, again.rows.volume_ratio,
                   again.ratio_scale);
  if (model::is_solid(model)) {
    comparison.array("prism/pressure", rows.pressure, again.rows.pressure, again.stress_scale);
    comparison.array("prism/von_mises", rows.von_mises, again.rows.von_mises, again.stress_scale);
    comparison.array("prism/principal_stretch", flat(rows.stretch), flat(again.rows.stretch),
                     again.stretch_scale);
  }
  check_contact(model, motion, numbers, rows, comparison);
  if (model::is_solid(model)) return;
  comparison.array("spring/elongation", rows.elongation, again.rows.elongation,
                   again.elongation_scale);
  comparison.array("spring/tension", rows.tension, again.rows.tension, again.tension_scale);
}

void check_model(const model::Model& model, Comparison& comparison) {
  const model::Prisms& prisms = model.prisms;
  std::vector<double> volume;
  double largest = 0;
  for (const auto& prism : prisms.points) {
    volume.push_back(model::prism_volume(base::pick(model.points.position, prism).data()));
    largest = std::max(largest, volume.back());
  }
  comparison.array("prism/rest_volume", prisms.rest_volume, volume, largest);
}

}  // namespace repose::tools::check
