#include "repose/solve/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace repose::solve {

namespace {

std::string row(const std::string& name, const std::string& value) {
  return fmt::format("  {:<22} {}\n", name, value);
}

/// How rounds that must settle ended.
std::string ending(bool settled, bool stopped, const std::string& unsettled) {
  if (settled) return "settled";
  return unsettled + (stopped ? ", STOPPED BY A SIGNAL OR THE TIME LIMIT" : "");
}

std::string work_rows(const Summary& s) {
  const std::string softer =
      s.path.softer > 0
          ? row("softer volume terms", fmt::format("first: {} evaluations", s.path.softer))
          : "";
  return softer + row("load steps", fmt::format("{} ({} halved)", s.path.steps, s.path.halvings)) +
         row("iterations", fmt::format("{}", s.path.iterations)) +
         row("evaluations", fmt::format("{} of value and gradient, {} of the Hessian",
                                        s.evaluations, s.assemblies));
}

std::string stability(const Spectrum& s) {
  if (std::isnan(s.smallest)) return "stability not known: the eigenvalue solver did not converge";
  std::string text = fmt::format("{}: smallest eigenvalue {:.4g} N/mm",
                                 s.smallest > 0 ? "stable" : "NOT STABLE", s.smallest);
  if (s.smallest > 0 && s.largest > 0)
    text += fmt::format(", condition number {:.2g}", s.largest / s.smallest);
  return text;
}

std::string region_row(const RegionSummary& r) {
  return row("active region",
             fmt::format("{} of {} columns in {} rounds; up to {:.3g} N hold its border, which is "
                         "{:.3g} mm of the accuracy",
                         r.active, r.columns, r.rounds, r.force, r.error));
}

std::string verdict(const Summary& s) {
  if (s.path.complete()) return "";
  return fmt::format(
      "NOT CONVERGED: the run ended at load {:.4g} with an estimated {:.3g} mm to go ({}).{}\n",
      s.path.load, s.last.displacement_error, s.last.reason,
      s.path.last.stable || s.path.last.stopped
          ? ""
          : " The tissue buckles there, or is between several rest positions: move "
            "the bones less, or give the tissue tension.");
}

}  // namespace

std::string describe_model(const model::Model& model) {
  const model::Counts c = model::count(model);
  return row("points", fmt::format("{} ({} soft tissue, {} boundary, {} bone, {} held)", c.points,
                                   c.soft, c.boundary, c.bone, c.held)) +
         (c.edges > 0 ? row("edges", fmt::format("{}", c.edges))
                      : row("springs", fmt::format("{}", c.springs))) +
         row("prisms", fmt::format("{}", c.prisms));
}

std::string describe_build(const model::BuildReport& r) {
  std::string text =
      row("skin", fmt::format("{} vertices, {} edges, {} triangles", r.skin_vertices, r.skin_edges,
                              r.skin_triangles)) +
      row("columns", fmt::format("{} end in bone, {} end free ({} released), {} shortened",
                                 r.attached, r.free_deep, r.released, r.shortened)) +
      row("thickness", fmt::format("{:.3g} … {:.3g} mm, median {:.3g} mm", r.thickness_min,
                                   r.thickness_max, r.thickness_median)) +
      row("effective modulus", fmt::format("{:.4g} N/mm²", r.effective_modulus));
  for (const std::string& remark : r.remarks) text += row("remark", remark);
  return text;
}

std::string describe_cut(const model::Cut& cut, int64_t doubled) {
  return row("incision", fmt::format("along {} edges of the skin, {} points doubled in {} layers",
                                     cut.columns.size() - 1, doubled, cut.layers));
}

std::string describe_prestress(const Prestress& p) {
  if (p.solid)
    return row("initial equilibrium",
               fmt::format("{:.3g} N left of {:.3g} N; pressures up to {:.3g} N/mm²", p.residual,
                           p.largest_force, p.largest_pressure));
  return row("initial equilibrium",
             fmt::format("{:.3g} N left of {:.3g} N; rest lengths from {:.3g} of the initial ones",
                         p.residual, p.largest_force, p.least_rest_ratio));
}

std::string describe_reactions(const std::vector<std::vector<int64_t>>& held,
                               const std::vector<Vec3>& forces) {
  std::string text;
  for (size_t k = 0; k < held.size(); ++k)
    text += row(
        fmt::format("instrument {}", k),
        fmt::format("holds {} points; the tissue pushes on it with ({:.4g}, {:.4g}, {:.4g}) "
                    "N, {:.4g} N",
                    held[k].size(), forces[k].x(), forces[k].y(), forces[k].z(), forces[k].norm()));
  return text;
}

std::string describe_sliding(const Sliding& sliding) {
  if (sliding.rounds == 0) return "";
  return row("sliding", fmt::format("{} in {} rounds, {:.2g} mm to go",
                                    ending(sliding.settled, sliding.stopped, "NOT SETTLED"),
                                    sliding.rounds, sliding.to_go));
}

std::string describe_tearing(const Tearing& t) {
  if (!t.limit) return "";
  std::string text =
      row("tearing",
          fmt::format("{}, rounds: {}, limit {:g} N, largest tension at loaded points and tears "
                      "{:.4g} N",
                      ending(t.settled, t.stopped, "NOT SETTLED, MORE MAY TEAR"), t.rounds,
                      *t.limit, t.largest));
  if (t.springs == 0) return text + row("torn", "nothing");
  return text + row("torn", fmt::format("springs {}, with them prisms {} and triangles of the "
                                        "skin {}; {:.4g} mm long about ({:.4g}, {:.4g}, {:.4g}) mm",
                                        t.springs, t.prisms, t.triangles, t.length, t.middle.x(),
                                        t.middle.y(), t.middle.z()));
}

std::string describe_folds(const model::Model& model, const std::vector<double>& volume_ratio) {
  const auto worst = std::min_element(volume_ratio.begin(), volume_ratio.end());
  if (worst == volume_ratio.end() || *worst > 0) return "";
  const auto count = std::count_if(volume_ratio.begin(), volume_ratio.end(),
                                   [](double ratio) { return ratio <= 0; });
  const auto& points = model.prisms.points[worst - volume_ratio.begin()];
  const Vec3& at = model.points.position[points[0]];
  return fmt::format(
      "FOLDED: {} prisms of tissue are inside out, the worst one about ({:.1f}, {:.1f}, {:.1f}) "
      "mm: "
      "release more of it there (tissue.release, tissue.unattached), let the rim be auto, or move "
      "less; -allow_folded takes it as it is.\n",
      count, at.x(), at.y(), at.z());
}

std::string describe_stages(const base::Stages& stages) {
  std::string text;
  for (const auto& stage : stages.list())
    text += row("time, memory", fmt::format("{:<12} {:>9.3f} s {:>9.0f} MiB so far", stage.name,
                                            stage.seconds, stage.mebibytes));
  return text;
}

std::string describe_run(const Summary& s, const Settings& settings, int ranks,
                         const base::Stages& stages) {
  std::string text = verdict(s);
  text += row("ended", fmt::format("load {:.4g}: {}", s.path.load, s.last.reason));
  text += row("accuracy", fmt::format("{:.3g} mm reached, {:.3g} mm asked for",
                                      s.last.displacement_error, settings.path.accuracy));
  text += row("rest position", s.path.last.stable ? "a minimum (no negative curvature met)"
                                                  : "NOT A MINIMUM: negative curvature");
  if (s.initial_spectrum) text += row("at the start", stability(*s.initial_spectrum));
  if (s.final_spectrum) text += row("where it ended", stability(*s.final_spectrum));
  text +=
      row("objective", fmt::format("{:.12g} {}", s.last.objective, settings.force ? "N" : "N mm"));
  text += row("inverted prisms", fmt::format("{}{}", s.last.inverted_prisms,
                                             s.last.inverted_prisms ? ": TISSUE IS FOLDED" : ""));
  text += row("volume error", fmt::format("{:.3g} at most", s.last.volume_error_max));
  text += row("unknowns", fmt::format("{} on {} rank{}", s.unknowns, ranks, ranks == 1 ? "" : "s"));
  if (s.region) text += region_row(*s.region);
  text += work_rows(s);
  return text + describe_stages(stages);
}

}  // namespace repose::solve
