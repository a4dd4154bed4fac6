#include "strategy.h"

#include <fmt/format.h>

#include "plan_pieces.h"
#include "report.h"
#include "repose/adapt/discretization.h"
#include "repose/app/options.h"
#include "repose/app/settings.h"
#include "repose/base/agreement.h"
#include "repose/base/error.h"
#include "repose/model/material.h"

namespace repose::app {

namespace {

using Coarse = Strategy::Coarse;

bool is_force(const Strategy& s) { return s.settings.functional == scene::Functional::force; }

/// Why a part of a strategy cannot go with what a job or its options hold.
struct Conflict {
  bool given;
  const char* what;
  bool to_coarse = true;  ///< solving coarser models
  bool to_path = false;   ///< verifying the path
};

std::vector<Conflict> conflicts(const base::Options& options, const Job& job, const Strategy& s) {
  return {
      {.given = is_force(s), .what = "the functional is force"},
      {.given = options.has("restart"),
       .what = "the run resumes from another result",
       .to_path = true},
      {.given = !job.anatomy, .what = "the input is a model, which does not state its scene"},
      {.given = s.settings.path.load_steps > 0, .what = "load_steps are requested"},
      {.given = !job.cuts.empty(), .what = "the scene has incisions or parted lips"},
      {.given = s.tears, .what = "the tissue may tear", .to_path = true},
      {.given = s.verifies_path, .what = "the path is to be verified"},
  };
}

/// The first obstacle, or nothing.
std::string first_conflict(const std::vector<Conflict>& conflicts, bool Conflict::*to) {
  for (const Conflict& o : conflicts)
    if (o.given && o.*to) return o.what;
  return "";
}

/// Request for coarser models by options; a scene alone requests none.
struct CoarseRequest {
  Coarse coarse = Coarse::none;
  const char* option = "";
  bool required = false;  // not to be passed over where it cannot be
};

CoarseRequest coarse_request(const base::Options& options) {
  const bool adapt = options.flag("adapt"), compare = options.flag("discretisation");
  const std::string profile = options.text("profile");
  if (adapt && compare)
    base::refuse(
        "-adapt and -discretisation solve coarser models for different ends; leave one out");
  for (const char* name : {"adapt", "discretisation"})
    if (options.flag(name) && profile == "exact")
      base::refuse("-{} solves coarser models; leave -profile exact out", name);
  if (compare) return {.coarse = Coarse::compare, .option = "-discretisation", .required = true};
  if (adapt) return {.coarse = Coarse::instead, .option = "-adapt", .required = true};
  if (profile == "preview") return {.coarse = Coarse::instead, .option = "-profile preview"};
  return {};
}

std::vector<adapt::Resolution> resolutions_for(const CoarseRequest& request,
                                               const model::Anatomy& anatomy) {
  constexpr int64_t preview_columns = 4000;
  if (request.coarse == Coarse::compare) return adapt::halved_resolutions(anatomy);
  const auto columns = static_cast<int64_t>(anatomy.skin.points.size());
  if (!request.required && columns < preview_columns) return {};  // is as soon solved itself
  return adapt::compared_resolutions(anatomy, request.required ? columns : preview_columns);
}

/// On rank 0.
void choose_coarse(const CoarseRequest& request, const std::string& conflict, const Job& job,
                   Strategy& s) {
  if (request.coarse == Coarse::none) return;
  if (conflict.empty()) {
    s.preview = request.coarse == Coarse::instead && !request.required;
    if (request.coarse == Coarse::instead && request.required && job.local_model.part.solid) {
      adapt::Convergence convergence = adapt::convergence_of(*job.anatomy, job.local_model.counts);
      s.resolutions = std::move(convergence.resolutions);
      s.limit = std::move(convergence.limit);
    } else {
      s.resolutions = resolutions_for(request, *job.anatomy);
    }
  } else if (request.required) {
    base::refuse("{}: {}; leave the option out", request.option, conflict);
  }
  if (!s.resolutions.empty()) s.coarse = request.coarse;
}

/// Refuses what minimizes without regard to contact.
void require_contact_kept(const Strategy& s, const Job& job) {
  if (job.local_model.part.contact && is_force(s))
    base::refuse(
        "functional force does not keep tissue out of what it touches; choose functional energy, "
        "or leave contact and sliding instruments out of the scene");
}

/// Refuses to verify a path that is not a matter of load steps.
void require_path(const std::string& conflict, const Strategy& s) {
  if (s.verifies_path && !conflict.empty())
    base::refuse("-verify_path: {}; leave the option out", conflict);
}

std::string describe_minimum(const Strategy& s, const Job& job) {
  const std::string minimized =
      job.local_model.part.solid
          ? "the energy of a solid"
          : fmt::format("the {} of springs, volume term {}", is_force(s) ? "forces" : "energy",
                        word(s.settings.weights.volume));
  return fmt::format("{}, to {:g} mm", minimized, s.settings.path.accuracy);
}

std::string describe_steps(const Strategy& s) {
  const int steps = s.settings.path.load_steps;
  return steps > 0 ? fmt::format("{} equal ones, as requested; halved where one fails", steps)
                   : "as long as the prediction holds; halved where one fails";
}

std::string describe_coarse(const CoarseRequest& request, const std::string& conflict,
                            const Strategy& s) {
  if (request.coarse == Coarse::none) return "none: no option requests any";
  if (!conflict.empty()) return fmt::format("none: {}", conflict);
  if (s.resolutions.empty()) return "none: the skin has too few vertices";
  return fmt::format("{}, {}, because of {}", s.resolutions.size(),
                     s.coarse == Coarse::compare ? "to compare the scene's own with"
                                                 : "the first that is near enough in its place",
                     request.option);
}

/// A row for each choice.
std::string explain(const CoarseRequest& request, const std::vector<Conflict>& all, const Job& job,
                    const Strategy& s) {
  std::string text =
      report_row("minimizes", describe_minimum(s, job)) +
      report_row("load steps", describe_steps(s)) +
      report_row("coarser models",
                 describe_coarse(request, first_conflict(all, &Conflict::to_coarse), s));
  if (s.verifies_path) text += report_row("verified", "by a second run in twice the load steps");
  if (s.tears) text += report_row("tearing", "in rounds: at rest, then springs above the limit go");
  return text;
}

/// On rank 0.
void choose_sensitivity(const base::Options& options, const Job& job, Strategy& s) {
  if (!options.flag("sensitivity")) return;
  const auto cannot = [](const char* why) {
    base::refuse("-sensitivity: {}; leave the option out", why);
  };
  if (!job.local_model.part.solid) cannot("it is of a material, and the tissue is springs");
  if (!job.anatomy) cannot("the input is a model, which does not state its scene");
  if (s.coarse == Coarse::instead) cannot("a coarser model takes the place of the scene's own");
  s.sensitivity = true;
}

/// Collective.
void choose_tangents(MPI_Comm comm, const base::Options& options, const Job& job, Strategy& s) {
  if (!options.flag("tangents")) return;
  const auto refuse_unless = [](bool possible, const char* why) {
    if (!possible) base::refuse("-tangents: {}; leave the option out", why);
  };
  refuse_unless(!is_force(s), "the functional is force");
  refuse_unless(!s.tears, "the tissue may tear");
  refuse_unless(s.coarse != Coarse::instead, "a coarser model takes the place of the scene's own");
  s.tangents = plan_derivatives(comm, job);
  refuse_unless(!s.tangents.pieces.empty(), "no bone moves, and the scene has no plan.pieces");
}

/// Refuses options of a volume term of springs that the tissue does not have: they would be
/// ignored.
void require_volume_term(const base::Options& options, bool solid, model::VolumeTerm volume) {
  using model::VolumeTerm;
  for (const auto& [name, term] :
       {std::pair("bulk_modulus", VolumeTerm::penalty), std::pair("lambda", VolumeTerm::paper)}) {
    if (!options.has(name)) continue;
    if (solid)
      base::refuse(
          "-{} is of springs, and the tissue is a solid, which keeps its volume by "
          "tissue.material.poisson; leave the option out",
          name);
    if (volume != term)
      base::refuse(
          "-{} is of volume form {}, and the form is {}; give -volume {}, or leave -{} out", name,
          word(term), word(volume), word(term), name);
  }
}

}  // namespace

Strategy make_strategy(MPI_Comm comm, const base::Options& options, const Job& job) {
  scene::Solve requested = job.requested;
  override_by(options, requested);
  Strategy s;
  s.settings = settings_of(requested, job.local_model.part.solid);
  require_volume_term(options, job.local_model.part.solid, s.settings.weights.volume);
  s.settings.stability = options.flag("stability");
  s.settings.finds_other_rest = !options.flag("skip_other_rest");
  s.settings.monitor = options.flag("monitor_mm");
  s.settings.initial_equilibrium = job.initial_equilibrium;
  s.tears = job.tearing.has_value();
  s.verifies_path = options.flag("verify_path");
  require_contact_kept(s, job);
  const CoarseRequest request = coarse_request(options);
  std::vector<Conflict> all;  // on rank 0, which alone has all of the job
  base::on_root(comm, [&] {
    all = conflicts(options, job, s);
    require_path(first_conflict(all, &Conflict::to_path), s);
    choose_coarse(request, first_conflict(all, &Conflict::to_coarse), job, s);
    choose_sensitivity(options, job, s);
  });
  base::broadcast(comm, s.coarse, s.resolutions, s.preview, s.sensitivity, s.tears);
  choose_tangents(comm, options, job, s);
  if (base::rank(comm) == 0 && options.flag("dry_run"))
    s.explanation = explain(request, all, job, s);
  return s;
}

}  // namespace repose::app
