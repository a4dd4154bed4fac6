/// repose-check RESULT.h5: recomputes every number of a result file from its model and its
/// positions, by plain serial loops, and prints for each kind of number the worst of all steps
/// beside what is stored; -verbose prints all.
///
///     repose-check opening.h5
///
/// Exit status: 0 all agree to 1e-9, 1 the file is bad or its numbers do not agree.
#include <cstdio>

#include "repose/base/agreement.h"
#include "repose/base/program.h"
#include "repose/check/check_step.h"
#include "repose/results/merged_bones.h"
#include "repose/results/model_file.h"

namespace {

using namespace repose;

constexpr double tolerance = 1e-9;

void check_bones(const results::MergedBones& bones, const model::PrescribedMotion& motion,
                 const results::StoredStep& step, base::Comparison& comparison) {
  if (step.bone_points.empty()) return;
  const std::vector<Vec3> moved = results::moved_points(bones, motion, step.numbers.load);
  double scale = 0;
  for (const Vec3& point : moved) scale = std::max(scale, point.lpNorm<Eigen::Infinity>());
  comparison.array("bone_surface/points",
                   {step.bone_points.data()->data(), 3 * step.bone_points.size()},
                   {moved.data()->data(), 3 * moved.size()}, scale);
}

/// What the steps say of each other: the path leads from smaller to larger loads, to the end or to
/// a step that did not converge. A checkpoint is no end.
void check_path(const std::vector<model::StepNumbers>& steps, bool is_checkpoint,
                base::Comparison& comparison) {
  comparison.begin("path");
  bool rising = true;
  for (size_t s = 1; s < steps.size(); ++s) rising = rising && steps[s - 1].load < steps[s].load;
  comparison.statement("loads increase from step to step", rising);
  comparison.statement("converged is 0 where the last load is below 1, but in a checkpoint",
                       is_checkpoint || steps.back().load == 1 || !steps.back().converged);
}

base::Comparison check_file(const std::string& file) {
  const model::Model model = results::read_model(file);
  const int64_t count = results::step_count(file);
  if (count == 0) base::refuse("{}: /step holds no step; solve the model first", file);
  const model::PrescribedMotion motion(model);
  const results::MergedBones bones = results::merge_bones(model.bone_surfaces);
  base::Comparison comparison(tolerance);
  comparison.begin("model");
  check::check_model(model, comparison);
  std::vector<model::StepNumbers> steps;
  for (int64_t s = 0; s < count; ++s) {
    const results::StoredStep step = results::read_step(file, s, model);
    comparison.begin(fmt::format("step {:04}", s));
    check::check_step(model, motion, step.numbers, step.rows, step.displacement, comparison);
    check_bones(bones, motion, step, comparison);
    steps.push_back(step.numbers);
  }
  check_path(steps, results::is_checkpoint(file), comparison);
  return comparison;
}

void run(const base::Options& options) {
  const std::string file = options.arguments()[0];
  const base::Comparison comparison = check_file(file);
  const std::string table = options.flag("verbose") ? comparison.table() : comparison.summary();
  std::fputs(table.c_str(), stdout);
  std::fflush(stdout);
  if (comparison.disagreeing() > 0)
    base::refuse("{}: {} of {} numbers disagree, the worst: {}", file, comparison.disagreeing(),
                 comparison.compared(), comparison.worst());
  std::printf("%s: all %lld numbers agree to %g\n", file.c_str(),
              static_cast<long long>(comparison.compared()), tolerance);
}

}  // namespace

int main(int argc, char** argv) {
  base::Options options(argc, argv,
                        "Recomputes every number of a result file from its model and positions.",
                        {{"RESULT.h5", "a result of repose-solve"}},
                        {{"verbose", base::OptionKind::flag, "",
                          "Print every number of every step, not one row for each kind."}});
  return base::run_program(options, [&] {
    base::on_first_rank(MPI_COMM_WORLD, [&] { run(options); });
    return base::Exit::done;
  });
}
