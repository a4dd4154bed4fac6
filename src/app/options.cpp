#include "repose/app/options.h"

#include <algorithm>
#include <optional>

#include "repose/scene/keys.h"

namespace repose::app {

namespace {

using base::OptionKind;

/// An option in the place of a key of the scene, which is where its range, unit, words and sentence
/// stand.
base::Option from_key(const char* name, const char* path) {
  const scene::Key& key = scene::find_key(path);
  const OptionKind kind = key.kind == scene::KeyKind::choice    ? OptionKind::choice
                          : key.kind == scene::KeyKind::integer ? OptionKind::integer
                                                                : OptionKind::number;
  return {.name = name,
          .kind = kind,
          .default_text = "",
          .help = key.sentence,
          .range = key.range,
          .unit = key.unit,
          .choices = key.choices,
          .removed = key.removed,
          .default_note = key.standard.empty() ? "" : "the scene's, or " + key.standard};
}

/// Options of the objective and the accuracy.
std::vector<base::Option> method_options() {
  return {{.name = "output",
           .kind = OptionKind::path,
           .default_text = "",
           .help = "Path of the result; .h5, where it ends so, is left out.",
           .default_note = "the input's name, here",
           .endings = {".h5"}},
          from_key("accuracy", "solve.accuracy"),
          from_key("functional", "solve.functional"),
          from_key("volume", "solve.volume.form"),
          from_key("lambda", "solve.lambda"),
          from_key("bulk_modulus", "solve.volume.bulk_modulus"),
          from_key("load_steps", "solve.load_steps")};
}

std::vector<base::Option> model_options() {
  return {
      {.name = "profile",
       .kind = OptionKind::choice,
       .default_text = "balanced",
       .help = "preview: a coarse model, 1 mm; balanced: as the scene says; exact: 1e-6 mm.",
       .choices = {"preview", "balanced", "exact"}},
      {"adapt", OptionKind::flag, "",
       "Solve the coarsest model whose skin is within the accuracy: of springs of the scene's own "
       "model, of a solid, which may be refined too, of the continuum; exit status 2 where its "
       "skin is not."},
      {"discretisation", OptionKind::flag, "",
       "Estimate how far mesh and layers leave the skin from the continuum, by coarser models."}};
}

/// Options of restarting, stopping and reporting.
std::vector<base::Option> run_options() {
  return {
      {"stability", OptionKind::flag, "",
       "Report the smallest eigenvalue of the energy's Hessian (SLEPc)."},
      {"verify_path", OptionKind::flag, "",
       "Solve again in twice the load steps; another rest position is exit status 2."},
      {"skip_other_rest", OptionKind::flag, "",
       "Do not search for another rest position where contact allows several."},
      {"sensitivity", OptionKind::flag, "",
       "Estimate how much the face depends on border, material and release, by a linear solve "
       "each."},
      {"tangents", OptionKind::flag, "",
       "Add the derivatives of the rest position by the motions of the plan's pieces, or of the "
       "bones that move, and by the stiffnesses of the material's strata (of a scene without "
       "turgor, gravity and nodal dilatation), to the result."},
      {"monitor_mm", OptionKind::flag, "",
       "Print time, evaluations and the estimated distance to go after each iteration."},
      {.name = "time_limit",
       .kind = OptionKind::number,
       .default_text = "",
       .help = "End all searches after this, keep the state and say how far it is.",
       .range = {0, 1e9},
       .unit = "s",
       .default_note = "none"},
      {"allow_folded", OptionKind::flag, "", "Accept inverted elements (else exit status 2)."},
      {"dry_run", OptionKind::flag, "",
       "Build and report the model and how it would be solved; solve nothing. With -output, write "
       "NAME_solved_skin.ply, and where it is cut NAME_incisions.mrk.json."},
      {"restart", OptionKind::path, "",
       "Resume from the last step of this result of the same model. Where other arrays than the "
       "points differ, a warning says which, and its state is where the search begins."},
      {.name = "checkpoint_interval",
       .kind = OptionKind::number,
       .default_text = "",
       .help = "Seconds between NAME_checkpoint.h5.",
       .range = {0, 1e9},
       .unit = "s",
       .default_note = "no checkpoints"},
  };
}

/// The place of an option's word among those of its key, whose order is the enumeration's.
template <class Choice, class Target>
void choose(const base::Options& options, const char* name, const char* path, Target& value) {
  if (!options.has(name)) return;
  const std::vector<std::string>& words = scene::find_key(path).choices;
  value = static_cast<Choice>(std::find(words.begin(), words.end(), options.text(name)) -
                              words.begin());
}

/// mm of a profile, if it has one.
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

void override_by(const base::Options& options, scene::Solve& requested) {
  choose<scene::Functional>(options, "functional", "solve.functional", requested.functional);
  choose<scene::VolumeTerm>(options, "volume", "solve.volume.form", requested.volume);
  requested.accuracy = accuracy_of(options.text("profile")).value_or(requested.accuracy);
  if (options.has("accuracy")) requested.accuracy = options.number("accuracy");
  if (options.has("lambda")) requested.lambda = options.number("lambda");
  if (options.has("bulk_modulus")) requested.bulk_modulus = options.number("bulk_modulus");
  if (options.has("load_steps"))
    requested.load_steps =
        options.text("load_steps") == "auto" ? 0 : static_cast<int>(options.integer("load_steps"));
}

}  // namespace repose::app
