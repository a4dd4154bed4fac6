#include "findings.h"

#include "motion_race.h"
#include "repose/model/build.h"

namespace repose::paper {

namespace {

constexpr double reference_accuracy = 1e-6;  // mm

/// The four functionals of one model.
class Series {
 public:
  Series(const model::Model& model, int layers, const Rules& rules, Findings& findings)
      : model_(model), layers_(layers), rules_(rules), findings_(findings) {}

  void race(const Functional& functional) {
    Race race;
    race.layers = layers_;
    race.functional = functional;
    Contest contest(model_, functional, rules_);
    race.own = contest.follow_path();
    find_reference(contest, race);
    if (race.own.arrived() || race.from_energy) run_methods(contest, race);
    findings_.races.push_back(race);
  }

 private:
  /// From where the path ended, or, for forces, from the energy's rest position.
  void find_reference(Contest& contest, Race& race) {
    const base::VecHandle& energy = energy_rest_[race.functional.volume];
    race.from_energy = race.functional.force && !race.own.arrived();
    race.from_energy = race.from_energy && energy;
    if (!race.own.arrived() && !race.from_energy) return;
    // Forces with f_v come to rest too slowly for more.
    const bool hard = race.functional.force && race.functional.volume;
    const double accuracy = hard ? 0.1 * rules_.accuracy : reference_accuracy;
    const base::VecHandle end = contest.copy_of_reference();
    race.reference_known =
        contest.refine(accuracy, race.from_energy ? static_cast<Vec>(energy) : nullptr);
    race.own.distance = contest.distance(end);
    if (!race.functional.force) energy_rest_[race.functional.volume] = contest.copy_of_reference();
  }

  void run_methods(Contest& contest, Race& race) {
    race.entries.push_back(contest.race_polak_ribiere());
    for (const std::string& type : tao_methods) race.entries.push_back(contest.race_tao(type));
    if (!race.functional.force && !race.functional.volume)
      findings_.motions.push_back({layers_, race_motion(contest, rules_.accuracy)});
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
      series.race(functional);
    }
  }
  return findings;
}

}  // namespace repose::paper
