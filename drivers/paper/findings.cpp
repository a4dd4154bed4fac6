#include "findings.h"

#include "motion_methods.h"
#include "repose/model/build.h"

namespace repose::paper {

namespace {

constexpr double reference_accuracy = 1e-6;  // mm

/// The four functionals of one model.
class Series {
 public:
  Series(const model::Model& model, int layers, const Rules& rules, Findings& findings)
      : model_(model), layers_(layers), rules_(rules), findings_(findings) {}

  void compare(const Functional& functional) {
    Comparison comparison;
    comparison.layers = layers_;
    comparison.functional = functional;
    Contest contest(model_, functional, rules_);
    comparison.own = contest.follow_path();
    find_reference(contest, comparison);
    if (comparison.own.arrived() || comparison.from_energy) run_methods(contest, comparison);
    findings_.comparisons.push_back(comparison);
  }

 private:
  /// From where the path ended, or, for forces, from the energy's rest position.
  void find_reference(Contest& contest, Comparison& comparison) {
    const base::VecHandle& energy = energy_rest_[comparison.functional.volume];
    comparison.from_energy = comparison.functional.force && !comparison.own.arrived();
    comparison.from_energy = comparison.from_energy && energy;
    if (!comparison.own.arrived() && !comparison.from_energy) return;
    // Forces with f_v come to rest too slowly for more.
    const bool hard = comparison.functional.force && comparison.functional.volume;
    const double accuracy = hard ? 0.1 * rules_.accuracy : reference_accuracy;
    const base::VecHandle end = contest.copy_of_reference();
    comparison.reference_known =
        contest.refine(accuracy, comparison.from_energy ? static_cast<Vec>(energy) : nullptr);
    comparison.own.distance = contest.distance(end);
    if (!comparison.functional.force)
      energy_rest_[comparison.functional.volume] = contest.copy_of_reference();
  }

  void run_methods(Contest& contest, Comparison& comparison) {
    comparison.entries.push_back(contest.run_polak_ribiere());
    for (const std::string& type : tao_methods) comparison.entries.push_back(contest.run_tao(type));
    if (!comparison.functional.force && !comparison.functional.volume)
      findings_.motions.push_back({layers_, run_motion(contest, rules_.accuracy)});
  }

  const model::Model& model_;
  int layers_;
  Rules rules_;
  Findings& findings_;
  base::VecHandle energy_rest_[2];  // without and with volume term
};

}  // namespace

Findings measure(const Plan& plan, const std::function<void(const std::string&)>& tell) {
  Findings findings;
  findings.plan = plan;
  for (const int layers : plan.layers) {
    const scene::Scene scene = with_layers(plan.scene, layers);
    findings.sizes.push_back(measure_size(scene));
    const model::Model model = model::build_model(scene).model;
    Series series(model, layers, plan.rules, findings);
    for (const Functional& functional : functionals) {
      tell(fmt::format("{} layers, {}", layers, functional.name));
      series.compare(functional);
    }
  }
  return findings;
}

}  // namespace repose::paper
