#include "repose/tools/check/check_file.h"

#include "check_step.h"
#include "repose/base/error.h"
#include "repose/results/merged_bones.h"
#include "repose/results/model_file.h"

namespace repose::tools::check {

namespace {

constexpr double agreement = 1e-9;

void check_bones(const results::MergedBones& bones, const model::PrescribedMotion& motion,
                 const results::StoredStep& step, Comparison& comparison) {
  const std::vector<Vec3> moved = results::moved_points(bones, motion, step.numbers.load);
  double scale = 0;
  for (const Vec3& point : moved) scale = std::max(scale, point.lpNorm<Eigen::Infinity>());
  const auto check = [&](const char* name, const std::vector<Vec3>& stored,
                         const std::vector<Vec3>& again) {
    if (stored.empty()) return;
    comparison.array(name, {stored.data()->data(), 3 * stored.size()},
                     {again.data()->data(), 3 * again.size()}, scale);
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
