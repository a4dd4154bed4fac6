#include "repose/app/options.h"

#include <algorithm>
#include <optional>

namespace repose::app {

namespace {

using base::OptionKind;

// In the order of scene::Functional.
const std::vector<std::string> functional_words = {"energy", "force"};

/// What is computed, and how near.
std::vector<base::Option> method_options() {
  return {
      {"output", OptionKind::path, "",
       "Path of the result without ending; default: the input's name here."},
      {"accuracy",
       OptionKind::number,
       "",
       "Stop when the rest position is this near (default 0.1).",
       {1e-12, 100},
       "mm"},
      {"functional", OptionKind::choice, "", "What is minimised.", {}, "", functional_words},
      {"volume",
       OptionKind::choice,
       "",
       "Volume term (force: none or paper).",
       {},
       "",
       volume_words},
      {"lambda",
       OptionKind::number,
       "",
       "Weight of the energy, with volume term paper.",
       {.min = 0, .max = 1, .min_excluded = true}},
      {"bulk_modulus", OptionKind::number, "", "Of the penalty volume term.", {0, 1e9}, "N/mm²"},
      {"load_steps",
       OptionKind::integer,
       "",
       "Equal steps of the bones' motion, or auto.",
       {1, 100000},
       "",
       {"auto"}},
  };
}

/// On which models.
std::vector<base::Option> model_options() {
  return {
      {"profile",
       OptionKind::choice,
       "balanced",
       "preview: a coarse model, 1 mm; balanced: as the scene says; exact: 1e-6 mm.",
       {},
       "",
       {"preview", "balanced", "exact"}},
      {"adapt", OptionKind::flag, "",
       "Solve the coarsest model whose skin is within the accuracy: of springs of the scene's own "
       "model, of a solid, which may be refined too, of the continuum."},
      {"discretisation", OptionKind::flag, "",
       "Estimate how far mesh and layers leave the skin from the continuum, by coarser models."},
      {"active_region",
       OptionKind::choice,
       "auto",
       "Search only the tissue that feels what moves; auto: where it pays.",
       {},
       "",
       {"off", "auto", "on"}}};
}

/// How the run goes on, ends and tells of itself.
std::vector<base::Option> run_options() {
  return {
      {"stability", OptionKind::flag, "",
       "Report the smallest eigenvalue of the energy's Hessian (SLEPc)."},
      {"monitor_mm", OptionKind::flag, "",
       "Print time, evaluations and the estimated distance to go after each iteration."},
      {"time_limit",
       OptionKind::number,
       "",
       "End all searches after this, keep the state and say how far it is.",
       {0, 1e9},
       "s"},
      {"allow_folded", OptionKind::flag, "",
       "Take a rest position with tissue inside out (else exit status 2)."},
      {"dry_run", OptionKind::flag, "",
       "Build and report the model and how it would be solved; solve nothing."},
      {"restart", OptionKind::path, "",
       "Go on from the last step of this result of the same model."},
      {"checkpoint_interval",
       OptionKind::number,
       "",
       "Seconds between NAME_checkpoint.h5.",
       {0, 1e9},
       "s"},
  };
}

template <class Choice, class Target>
void choose(const base::Options& options, const char* name, const std::vector<std::string>& words,
            Target& value) {
  if (!options.has(name)) return;
  const auto place = std::find(words.begin(), words.end(), options.text(name));
  value = static_cast<Choice>(place - words.begin());
}

/// mm that a profile asks for, if it does.
std::optional<double> accuracy_of(const std::string& profile) {
  if (profile == "preview") return 1.0;
  if (profile == "exact") return 1e-6;
  return {};
}

}  // namespace

std::vector<base::Option> solve_options() {
  std::vector<base::Option> table = method_options();
  for (const auto& more : {model_options(), run_options()})
    table.insert(table.end(), more.begin(), more.end());
  return table;
}

void override_by(const base::Options& options, scene::Solve& wanted) {
  choose<scene::Functional>(options, "functional", functional_words, wanted.functional);
  choose<scene::VolumeForm>(options, "volume", volume_words, wanted.volume);
  wanted.accuracy = accuracy_of(options.text("profile")).value_or(wanted.accuracy);
  if (options.has("accuracy")) wanted.accuracy = options.number("accuracy");
  if (options.has("lambda")) wanted.lambda = options.number("lambda");
  if (options.has("bulk_modulus")) wanted.bulk_modulus = options.number("bulk_modulus");
  if (options.has("load_steps"))
    wanted.load_steps =
        options.text("load_steps") == "auto" ? 0 : static_cast<int>(options.integer("load_steps"));
}

}  // namespace repose::app
