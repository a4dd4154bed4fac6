#include "repose/tools/check/check_file.h"

#include <algorithm>
#include <limits>

#include "check_contact.h"
#include "recompute.h"
#include "repose/base/error.h"
#include "repose/model/motion.h"
#include "repose/model/prism_geometry.h"
#include "repose/results/merged_bones.h"
#include "repose/results/model_file.h"

namespace repose::tools::check {

namespace {

constexpr double agreement = 1e-9;
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

/// Compares every number of a stored step with what the model and the stored positions make of it:
/// positions of the points that are not unknown with `motion`, all else with recompute(), of which
/// `films` are those of the model. What only the run itself knows (iterations, evaluations,
/// seconds, displacement_error) is checked for its range.
void check_step(const model::Model& model, const model::PrescribedMotion& motion,
                const results::StoredStep& step, const std::vector<Film>& films,
                Comparison& comparison) {
  const model::StepNumbers& numbers = step.numbers;
  const model::StepRows& rows = step.rows;
  const RecomputedStep again = recompute(model, motion, numbers, rows, films);
  check_ranges(numbers, comparison);
  check_numbers(numbers, again, comparison);
  const std::vector<Vec3> fixed = prescribed(model, motion, numbers.load, rows.position);
  comparison.array("point/position, fixed", flat(rows.position), flat(fixed), again.scale.position);
  comparison.array("point/displacement", flat(step.displacement), flat(again.displacement),
                   again.scale.displacement);
  comparison.array("point/residual_force", flat(rows.residual_force),
                   flat(again.rows.residual_force), again.scale.force);
  comparison.array("prism/volume_ratio", rows.volume_ratio, again.rows.volume_ratio,
                   again.scale.ratio);
  if (model::is_solid(model)) {
    comparison.array("prism/pressure", rows.pressure, again.rows.pressure, again.scale.stress);
    comparison.array("prism/von_mises", rows.von_mises, again.rows.von_mises, again.scale.stress);
    comparison.array("prism/principal_stretch", flat(rows.stretch), flat(again.rows.stretch),
                     again.scale.stretch);
  }
  check_contact(model, motion, numbers, rows, comparison);
  if (model::is_solid(model)) return;
  comparison.array("spring/elongation", rows.elongation, again.rows.elongation,
                   again.scale.elongation);
  comparison.array("spring/tension", rows.tension, again.rows.tension, again.scale.tension);
}

/// Compares the stored rest volumes with the prisms' volumes at the initial positions.
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

void check_bones(const results::MergedBones& bones, const model::PrescribedMotion& motion,
                 const results::StoredStep& step, Comparison& comparison) {
  const std::vector<Vec3> moved = results::moved_points(bones, motion, step.numbers.load);
  double scale = 0;
  for (const Vec3& point : moved) scale = std::max(scale, point.lpNorm<Eigen::Infinity>());
  const auto check = [&](const char* name, const std::vector<Vec3>& stored,
                         const std::vector<Vec3>& again) {
    if (!stored.empty()) comparison.array(name, flat(stored), flat(again), scale);
  };
  check("bone_surface/points", step.bone_points, moved);
  check("bone_surface/displacement", step.bone_displacement, results::displacements(bones, moved));
}

void check_advance(const model::Model& model, const std::vector<Vec3>& normals,
                   const results::StoredStep& step, Comparison& comparison) {
  if (step.advance.empty()) return;
  double scale = 0;
  std::vector<double> again;
  for (size_t i = 0; i < normals.size(); ++i) {
    const Vec3 &now = step.rows.position[i], &before = model.points.position[i];
    again.push_back((now - before).dot(normals[i]));
    scale = std::max({scale, now.lpNorm<Eigen::Infinity>(), before.lpNorm<Eigen::Infinity>()});
  }
  comparison.array("point/advance", step.advance, again, scale);
}

/// Checks the sequence of steps: the path leads from smaller to larger loads, to the end or to
/// a step that did not converge. A checkpoint is no end.
void check_path(const std::vector<model::StepNumbers>& steps, bool is_checkpoint,
                Comparison& comparison) {
  comparison.begin("path");
  bool rising = true;
  for (size_t s = 1; s < steps.size(); ++s) rising = rising && steps[s - 1].load < steps[s].load;
  comparison.statement("loads increase from step to step", rising);
  comparison.statement("converged is 0 where the last load is below 1, but in a checkpoint",
                       is_checkpoint || steps.back().load == 1 || !steps.back().converged);
}

}  // namespace

Comparison check_file(const std::string& file) {
  const model::Model model = results::read_model(file);
  const int64_t count = results::step_count(file);
  if (count == 0) base::refuse("{}: /step holds no step; solve the model first", file);
  const model::PrescribedMotion motion(model);
  const results::MergedBones bones = results::merge_bones(model.bone_surfaces);
  const std::vector<Vec3> normals = model::outward_normals(model);
  Comparison comparison(agreement);
  comparison.begin("model");
  check_model(model, comparison);
  const std::vector<Film> films = find_films(model);
  check_adhesion(model, films, comparison);
  check_supports(model, comparison);
  std::vector<model::StepNumbers> steps;
  for (int64_t s = 0; s < count; ++s) {
    const results::StoredStep step = results::read_step(file, s, model);
    comparison.begin(fmt::format("step {:04}", s));
    check_step(model, motion, step, films, comparison);
    check_advance(model, normals, step, comparison);
    check_bones(bones, motion, step, comparison);
    steps.push_back(step.numbers);
  }
  check_path(steps, results::is_checkpoint(file), comparison);
  return comparison;
}

}  // namespace repose::tools::check
