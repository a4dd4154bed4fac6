#include "report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace repose::app {

std::string report_row(const std::string& name, const std::string& value) {
  return fmt::format("  {:<22} {}\n", name, value);
}

namespace {

/// Why many load steps of a run that came to its end were halved, and what to change.
std::string describe_halvings(const solve::Halvings& h, bool springs) {
  constexpr int64_t usual = 4;
  if (h.count() <= usual) return "";
  const char* reason =
      h.folded >= h.failed + h.off_prediction
          ? "a hard way: tissue folds on it; move the bones less or release more tissue "
            "(tissue.release)"
          : "a hard way: tissue buckles on it, or has several rest positions, and -verify_path "
            "says whether they matter; move the bones less";
  return report_row("remark", "{}{}", reason,
                    springs ? "; raise the volume stiffness of the springs, or make the tissue a "
                              "solid"
                            : "");
}

std::string halved(const solve::Halvings& h) {
  if (h.count() == 0) return "none halved";
  return fmt::format("{} halved: {} folded tissue, {} led elsewhere than predicted, {} failed",
                     h.count(), h.folded, h.off_prediction, h.failed);
}

std::string work_rows(const solve::Summary& s, bool springs) {
  const std::string other = s.evaluations_for_other > 0
                                ? fmt::format("; of the {}, {} to find another rest position",
                                              s.evaluations, s.evaluations_for_other)
                                : "";
  return report_row("load steps", "{} ({})", s.path.steps, halved(s.path.halvings)) +
         describe_halvings(s.path.halvings, springs) +
         report_row("iterations", "{}", s.path.iterations) +
         report_row("evaluations", "{} of value and gradient, {} of the Hessian{}", s.evaluations,
                    s.assemblies, other);
}

std::string stability(const solve::Spectrum& s) {
  if (std::isnan(s.smallest)) return "stability not known: the eigenvalue solver did not converge";
  std::string text = fmt::format("{}: smallest eigenvalue {:.4g} N/mm",
                                 s.smallest > 0 ? "stable" : "NOT STABLE", s.smallest);
  if (s.smallest > 0 && s.largest > 0)
    text += fmt::format(", condition number {:.2g}", s.largest / s.smallest);
  return text;
}

/// Explains a failed run, as far as known, with a remedy.
std::string remedy(const solve::Summary& s, bool stretched) {
  if (!s.path.last.stable && stretched)
    return " The tissue buckles there, or is between several rest positions: move the bones less, "
           "or lower tissue.turgor: what the skin's tension presses together beneath it may have "
           "no balance, or none any more where it is cut.";
  if (s.path.last.stopped) return "";
  if (s.path.last.pierced > 0)
    return " The instrument is inside tissue or bone, because only points of the skin touch it: "
           "push it less far, use a finer skin (tissue.edge), keep instruments apart or, where the "
           "skin slides on it, let it stick (skin: stick).";
  if (s.path.last.overlapped > 0)
    return " Move these bones less, or trim them: repose-collide says where they meet. The tissue "
           "there rests on one of the two alone.";
  if (!s.path.last.stable)
    return std::string(
               " The tissue buckles there, or is between several rest positions: move the bones "
               "less, or give the tissue tension") +
           (std::isfinite(s.last.penetration)
                ? ", and leave contact.stiffness and contact.grid to the program."
                : ".");
  if (std::isfinite(s.last.penetration))
    return " Tissue meets bone, an instrument or itself there: leave contact.stiffness and "
           "contact.grid to the program, or move less.";
  if (!std::isfinite(s.last.displacement_error))
    return " Bring the stiffnesses of the tissue closer together.";
  if (s.path.last.too_fine)
    return fmt::format(
        " The accuracy is finer than the estimate of this functional reaches: try -accuracy "
        "{:.1g} or larger.",
        100 * s.last.displacement_error);
  return " Check the units and stiffnesses, move the bones less, or try more -load_steps.";
}

}  // namespace

std::string describe_model(const model::Counts& c) {
  return report_row("points", "{} ({} soft tissue, {} boundary, {} bone, {} held)", c.points,
                    c.soft, c.boundary, c.bone, c.held) +
         (c.edges > 0 ? report_row("edges", "{}", c.edges)
                      : report_row("springs", "{}", c.springs)) +
         report_row("prisms", "{}", c.prisms);
}

std::string describe_build(const model::SkinMesh& skin, const model::BuildReport& r) {
  std::string text =
      report_row("skin", "{} vertices, {} edges, {} triangles", skin.points.size(),
                 skin.edges.size(), skin.triangles.size()) +
      report_row("columns", "{} end in bone, {} end free ({} released), {} shortened", r.attached,
                 r.free_deep, r.released, r.shortened) +
      report_row("thickness", "{:.3g} … {:.3g} mm, median {:.3g} mm", r.thickness_min,
                 r.thickness_max, r.thickness_median) +
      report_row("effective modulus", "{:.4g} N/mm²", r.effective_modulus);
  for (const std::string& remark : r.remarks) text += report_row("remark", remark);
  return text;
}

std::string describe_warnings(const std::vector<std::string>& warnings) {
  std::string text;
  for (const std::string& warning : warnings) text += report_row("warning", warning);
  return text;
}

std::string describe_cut(const model::Cut& cut, int64_t doubled) {
  return report_row(cut.lips ? "parted lips" : "incision",
                    "along {} edges of the skin, {} points doubled in {} layers",
                    cut.columns.size() - 1, doubled, cut.layers);
}

std::string describe_prestress(const solve::Prestress& p) {
  if (p.solid)
    return report_row("initial equilibrium",
                      "{:.3g} N left of {:.3g} N; pressures up to {:.3g} N/mm²", p.residual,
                      p.largest_force, p.largest_pressure);
  return report_row("initial equilibrium",
                    "{:.3g} N left of {:.3g} N; rest lengths from {:.3g} of the initial ones",
                    p.residual, p.largest_force, p.min_rest_ratio);
}

std::string describe_reactions(const std::vector<std::vector<int64_t>>& held,
                               const std::vector<Vec3>& forces) {
  std::string text;
  for (size_t k = 0; k < held.size(); ++k)
    if (!held[k].empty())
      text += report_row(fmt::format("instrument {}", k),
                         "holds {} points; the tissue pushes on it with {:.4g} N, {:.4g} N",
                         held[k].size(), forces[k], forces[k].norm());
  return text;
}

std::string describe_pierced(const std::vector<std::string>& bodies, const solve::Summary& s) {
  std::string text;
  if (bodies.empty()) return text;  // rank 0 has their names
  const auto noun = [](int64_t columns) { return columns == 1 ? "column" : "columns"; };
  if (s.pierced.count() > 0)
    text += report_row(
        "pierced by bone",
        "{}, up to {:.1f} mm deep, the deepest by {} at {:.1f} mm; use a finer skin (tissue.edge) "
        "or move less",
        s.pierced.columns > 0
            ? fmt::format("{} {}, between the two deepest points of each", s.pierced.columns,
                          noun(s.pierced.columns))
            : fmt::format("{} prisms of tissue between columns", s.pierced.prisms),
        s.pierced.depth, bodies[s.pierced.body], s.pierced.where);
  const solve::PiercedColumns& by = s.pierced_by_instrument;
  if (by.count() > 0)
    text += report_row("pierced by instrument",
                       "{}, up to {:.2g} mm deep, the deepest by {} at {:.1f} mm; push it "
                       "less far, use a finer skin (tissue.edge) or, where it slides, skin: stick",
                       by.columns > 0 ? fmt::format("{} {}", by.columns, noun(by.columns))
                                      : fmt::format("{} prisms between columns", by.prisms),
                       by.depth, bodies[by.body], by.where);
  return text;
}

namespace {

/// Depths as the search sees them, then as they are.
std::string describe_penetration(const std::vector<std::string>& bodies, const solve::Summary& s) {
  if (!std::isfinite(s.last.penetration)) return "";
  std::string text =
      report_row("penetration", "{:.2g} mm at most, into smoothed surfaces", s.last.penetration);
  if (!std::isfinite(s.last.penetration_exact)) return text;
  text += report_row("exact penetration", "{:.2g} mm at most, into the bodies' own triangles",
                     s.last.penetration_exact);
  const char* advice = s.path.last.overlapped > 0
                           ? "bodies overlap there"
                           : "a finer contact.grid follows its surface more closely";
  for (size_t k = 0; k < bodies.size() && k < s.contacts.size(); ++k) {
    const solve::PenetrationDepth& depth = s.contacts[k].exact;
    if (depth.points == 0) continue;
    text += report_row("exact penetration",
                       "{} points are deeper than {:g} mm inside {}, {:.3g} mm at most at "
                       "{:.1f} mm; {}",
                       depth.points, solve::PenetrationDepth::reported, bodies[k], depth.deepest,
                       depth.where, advice);
  }
  return text;
}

std::string describe_other_rest(const std::vector<std::string>& bodies,
                                const solve::Outcome& last) {
  if (!last.other || bodies.empty()) return "";  // rank 0 has their names
  std::vector<std::string> names;
  for (const int32_t body : last.other->bodies) names.push_back(bodies[body]);
  return report_row("other rest position",
                    "the skin is up to {:.2g} mm away there, most at {:.1f} mm: tissue rests on "
                    "either side of an edge of {}, and this result has less energy",
                    last.other->distance, last.other->place, fmt::join(names, " or "));
}

}  // namespace

std::string describe_contact(const std::vector<std::string>& bodies, const solve::Summary& s) {
  std::string text;
  for (size_t k = 0; k < s.contacts.size(); ++k) {
    const solve::ContactSummary& on = s.contacts[k];
    const std::string name = k < bodies.size() ? bodies[k] : "the sides of cuts";
    if (on.inside > 0)
      text += report_row("inside at the start",
                         "{} points begin up to {:.2g} mm inside {}, the deepest at "
                         "{:.1f} mm; they go no deeper",
                         on.inside, on.deepest, name, on.where);
    if (on.points == 0) continue;
    text += report_row("contact", "{} {} on {} with {:.4g} N, {:.4g} N", on.points,
                       on.points == 1 ? "point presses" : "points press", name, on.force,
                       on.force.norm());
    if (on.skin.points > 0)
      text +=
          report_row("skin on bone",
                     "{} of them are of the skin, pressed most at {:.1f} mm: lips or cheeks that "
                     "bones catch may rest in several ways; move the bones less far together",
                     on.skin.points, on.skin.where);
  }
  return text + describe_penetration(bodies, s) + describe_other_rest(bodies, s.path.last);
}

std::string describe_tearing(const solve::Tearing& t) {
  if (!t.limit) return "";
  const char* const stopped = t.stopped ? ", STOPPED BY A SIGNAL OR THE TIME LIMIT" : "";
  std::string text = report_row(
      "tearing",
      "{}{}, rounds: {}, limit {:g} N, largest tension at loaded points and tears {:.4g} N",
      t.settled ? "settled" : "NOT SETTLED, MORE MAY TEAR", t.settled ? "" : stopped, t.rounds,
      *t.limit, t.largest);
  if (t.springs == 0) return text + report_row("torn", "nothing");
  return text + report_row("torn",
                           "springs {}, with them prisms {} and triangles of the skin "
                           "{}; {:.4g} mm long about {:.4g} mm",
                           t.springs, t.prisms, t.triangles, t.length, t.middle);
}

std::string describe_path(const PathCheck& c) {
  const auto row = [](const std::string& text) { return report_row("path", text); };
  if (c.steps == 0) return row("none: nothing moves");
  const std::string repetition =
      fmt::format("in {} load steps in place of {}", 2 * c.steps, c.steps);
  if (!c.again.path.complete())
    return row(fmt::format("NOT VERIFIED: {} the run ended at load {:.4g}: {}", repetition,
                           c.again.path.load, c.again.last.reason));
  const std::string apart =
      fmt::format("{:.2g} mm apart at most, 95 % within {:.2g} mm", c.largest, c.percentile_95);
  if (c.holds())
    return row(fmt::format("verified: {} the same rest position, {}", repetition, apart));
  return row(fmt::format(
      "THE REST POSITION DEPENDS ON IT: {} another one, {}, the farthest about {:.1f} "
      "mm; its objective is {:.6g}, that of the result {:.6g}: look there before you "
      "trust it; {}",
      repetition, apart, c.place, c.again.last.objective, c.objective,
      c.springs ? "springs buckle where they are pressed together (raise the volume "
                  "stiffness, or make the tissue a solid)"
                : "tissue folds or catches on an edge there (a finer mesh, or a smaller "
                  "move, may decide)"));
}

std::string describe_stages(const base::Stages& stages) {
  std::string text;
  for (const auto& stage : stages.list())
    text += report_row("time, memory", "{:<12} {:>9.3f} s {:>9.0f} MiB so far", stage.name,
                       stage.seconds, stage.mebibytes);
  return text;
}

std::string describe_saved(const std::string& name) {
  return report_row("told to end",
                    "{}.h5 holds the last state saved; -restart {}.h5 resumes from it", name, name);
}

std::string describe_finished(const std::string& file, const model::StepNumbers& end,
                              double accuracy, bool folded) {
  return report_row("finished",
                    "{}: at rest at load 1, {:.3g} mm reached, {:.3g} mm requested{}; nothing is "
                    "left to do",
                    file, end.displacement_error, accuracy,
                    folded ? fmt::format(", {} prisms inside out (-allow_folded accepts them)",
                                         end.inverted_prisms)
                           : "");
}

std::string describe_failure(const solve::Summary& s, bool stretched, bool adheres,
                             const std::string& options) {
  if (s.path.complete()) return "";
  const bool by_adhesion = adheres && (s.path.halvings.failed > 0 || !s.path.last.stopped);
  return fmt::format(
      "NOT CONVERGED: the run ended at load {:.4g} with {} to go ({}).{}\n", s.path.load,
      std::isfinite(s.last.displacement_error)
          ? fmt::format("an estimated {:.3g} mm", s.last.displacement_error)
          : "an unknown distance",
      s.last.reason,
      (options.empty() || s.path.last.stopped
           ? ""
           : fmt::format(" Leave out {} first, which may stop the search short.", options)) +
          remedy(s, stretched) +
          (by_adhesion ? " Lips adhere to teeth here, which keeps some searches from "
                         "ending: anatomy.adhesion: 0 leaves adhesion out."
                       : ""));
}

std::string describe_run(const solve::Summary& s, const solve::Settings& settings, int ranks,
                         const base::Stages& stages) {
  std::string text = report_row("ended", "load {:.4g}: {}", s.path.load, s.last.reason);
  const double error = s.last.displacement_error;
  text += report_row("accuracy", "{}, {:.3g} mm requested",
                     std::isfinite(error) ? fmt::format("{:.3g} mm reached", error) : "not known",
                     settings.path.accuracy);
  text += report_row("rest position", s.path.last.stable ? "a minimum (no negative curvature met)"
                                      : s.path.last.stopped ? "not known: the search was stopped"
                                                            : "NOT A MINIMUM: negative curvature");
  if (s.initial_spectrum) text += report_row("at the start", stability(*s.initial_spectrum));
  if (s.final_spectrum) text += report_row("where it ended", stability(*s.final_spectrum));
  text += report_row("objective", "{:.12g} {}", s.last.objective,
                     settings.functional == model::Functional::force ? "N" : "N mm");
  text += report_row("inverted prisms", "{}{}", s.last.inverted_prisms,
                     s.last.inverted_prisms ? ": TISSUE IS FOLDED" : "");
  text += report_row("volume error", "{:.3g} at most", s.last.volume_error_max);
  text += report_row("unknowns", "{} on {} rank{}", s.unknowns, ranks, ranks == 1 ? "" : "s");
  text += work_rows(s, settings.weights.volume != model::VolumeTerm::material);
  return text + describe_stages(stages);
}

std::string describe_choice(const adapt::GridSequence& sequence, double requested,
                            const std::string* limit) {
  const double error = sequence.levels.back().discretization_error;
  const bool near = limit ? sequence.near_enough : error <= requested;
  const std::string why =
      limit ? ": " + (sequence.refusal.empty() ? *limit : sequence.refusal) : "";
  return report_row(
      "solved model",
      "of these, the last; {} {:.2g} mm from {} at most, by its distance from the one before{}",
      limit ? "mesh and layers leave its skin" : "its skin is", error,
      limit ? "the continuum" : "the scene's own",
      near ? "" : fmt::format(": MORE THAN THE {:g} mm REQUESTED{}", requested, why));
}

std::string describe_sequence(const adapt::GridSequence& sequence) {
  std::string text;
  for (const adapt::Level& r : sequence.levels)
    text += report_row(
        "coarse model",
        "{} points, edges {:.3g} mm, {} layers: {} evaluations, {} of the Hessian, {:.2f} s{}",
        r.points, r.resolution.edge, r.resolution.layers, r.evaluations, r.assemblies, r.seconds,
        std::isfinite(r.skin_change)
            ? fmt::format("; skin {:.2g} mm from the one before", r.skin_change)
            : "");
  if (!sequence.refusal.empty()) text += report_row("no finer coarse model", sequence.refusal);
  return text;
}

}  // namespace repose::app
