#include "page.h"

#include "repose/base/program.h"

namespace repose::paper {

namespace {

/// The paper's Table 1.
struct Printed {
  int layers, points, springs, prisms;
};
constexpr Printed printed_sizes[] = {
    {2, 954, 5881, 1748}, {4, 1908, 14941, 2622}, {6, 2862, 24001, 4370}};

std::string beside_printed(int64_t ours, int layers, int Printed::*what) {
  for (const Printed& p : printed_sizes)
    if (p.layers == layers) return fmt::format("{} ({})", ours, p.*what);
  return fmt::format("{} (–)", ours);
}

std::string size_table(const Findings& findings) {
  std::string text =
      "## Table 1: sizes\n\nIn brackets what the paper prints. Its 1748 prisms for two layers "
      "are\n2 · 874 and do not fit its other rows, which have 874 for each gap between\nlayers. "
      "Memory is heap memory: of the model, additionally to evaluate energy and gradient,\nand "
      "additionally for Newton's method with its preconditioner.\n\n"
      "| layers | points | springs | prisms | model, MB | + descent, MB | + Newton, MB |\n"
      "|--:|--:|--:|--:|--:|--:|--:|\n";
  for (const Size& s : findings.sizes)
    text += fmt::format("| {} | {} | {} | {} | {:.2f} | {:.2f} | {:.2f} |\n", s.layers,
                        beside_printed(s.counts.points, s.layers, &Printed::points),
                        beside_printed(s.counts.springs, s.layers, &Printed::springs),
                        beside_printed(s.counts.prisms, s.layers, &Printed::prisms),
                        1e-6 * s.model_bytes, 1e-6 * s.descent_bytes, 1e-6 * s.newton_bytes);
  return text + "\n";
}

/// "88 · 0.12×": evaluations and time over that of the default, or how it ended otherwise.
std::string cell(const Entry& entry, double unit_seconds) {
  switch (entry.end) {
    case Entry::End::reached:
      return fmt::format("{} · {:.2g}×", entry.evaluations, entry.seconds / unit_seconds);
    case Entry::End::own_minimum:
      return fmt::format("{} · {:.2g}×, other minimum ({:.1f} mm, {:+.2g} %)", entry.evaluations,
                         entry.seconds / unit_seconds, entry.distance, 100 * entry.excess);
    case Entry::End::limit:
      return fmt::format("> {} ({:.2g} mm)", entry.evaluations, entry.distance);
    default:
      return fmt::format("stops at {} ({:.2g} mm)", entry.evaluations, entry.distance);
  }
}

std::string own_cell(const Comparison& comparison) {
  const double milliseconds = 1e3 * comparison.own.seconds;
  if (!comparison.own.arrived())
    return fmt::format("> {} ({:.0f} ms)", comparison.own.evaluations, milliseconds);
  return fmt::format("{} · {:.0f} ms ({:.2g} mm)", comparison.own.evaluations, milliseconds,
                     comparison.own.distance);
}

std::string run_table(const Findings& findings, bool force) {
  std::string text = "| functional | layers | Polak–Ribière, Brent |";
  for (const std::string& type : tao_methods) text += fmt::format(" TAO {} |", type);
  text += " our default |\n|---|--:|--:|--:|";
  for (size_t k = 0; k < tao_methods.size(); ++k) text += "--:|";
  text += "\n";
  for (const Comparison& comparison : findings.comparisons) {
    if (comparison.functional.force != force) continue;
    text += fmt::format("| {}{} | {} |", comparison.functional.name,
                        comparison.reference_known ? "" : " *", comparison.layers);
    for (const Entry& entry : comparison.entries)
      text += fmt::format(" {} |", cell(entry, comparison.own.seconds));
    for (size_t k = comparison.entries.size(); k <= tao_methods.size(); ++k) text += " – |";
    text += fmt::format(" {} |\n", own_cell(comparison));
  }
  return text + "\n";
}

std::string how_compared(const Rules& rules) {
  return fmt::format(
      R"(Evaluations (with or without gradient) until the largest distance of a point from the rest
position of the same functional is {0} mm, and CPU time relative to our default in the same row.
That rest position is the end of our default, refined to 1e-6 mm (f_f + f_v: {1:.3g} mm);
where it does not converge for forces, the energy's rest position is refined. λ = 0.5 with f_v. The
jaw moves to its place in one step, from the initial state; only our default takes load steps, each
with a linear prediction and trust-region Newton, until its own estimate is below {0} mm; in
brackets its true distance. Forces are smoothed by ε = {2} N (our default lowers ε as it goes).

- `> n (d)`: n evaluations, at most {6}, or {3} s of CPU were not enough; it ended d away. Our
  default has {4} s.
- `stops at n (d)`: it stopped by itself after n, not at a minimum, d away.
- `other minimum (d, p)`: it reached another minimum, d away, whose Φ is higher by p; evaluations and
  time are to {5} mm of that one.
- `–`: no rest position is known.
- `*`: the minimum is not known to that accuracy; distances are from the state that refining the
  energy's rest position reached.

)",
      rules.accuracy, 0.1 * rules.accuracy, Contest::epsilon, rules.seconds, rules.path_seconds,
      rules.accuracy, rules.limit);
}

std::string run_tables(const Findings& findings) {
  const Rules& rules = findings.plan.rules;
  return fmt::format("## Tables 2 and 3: evaluations and time to {} mm\n\n", rules.accuracy) +
         how_compared(rules) + "Table 2, energy:\n\n" + run_table(findings, false) +
         "Table 3, force:\n\n" + run_table(findings, true);
}

std::string motion_table(const Findings& findings) {
  std::string text =
      "## Integrating the equations of motion\n\n"
      "m x'' = F − c x' (the paper's Eqs. 2–5) with unit masses and the springs alone, from the "
      "initial\nstate with the jaw in its place, to the same accuracy. Each row is the best of a "
      "scan over\ndampings c (1, 2, 4 times the critical damping of the softest mode at rest) and, "
      "for Euler, time\nsteps h; a user would have to find both first. One evaluation of the "
      "forces counts as one.\n\n"
      "| layers | method | evaluations · time |\n|--:|---|--:|\n";
  for (const MotionRun& motion : findings.motions)
    for (const Comparison& comparison : findings.comparisons) {
      if (comparison.layers != motion.layers || comparison.functional.force ||
          comparison.functional.volume)
        continue;
      for (const Entry& entry : motion.entries)
        text += fmt::format("| {} | {} | {} |\n", motion.layers, entry.method,
                            cell(entry, comparison.own.seconds));
    }
  return text + "\n";
}

std::string figures(const std::string& images) {
  const auto picture = [&](const char* title, const char* name, const char* caption) {
    return fmt::format("![{}]({}{}.png)\n\n{}\n\n", title, images, name, caption);
  };
  return "## Figures\n\n" +
         picture("The three spring laws", "laws",
                 "Fig. 3: tension over elongation of the linear, quadratic and quartic law.") +
         picture("Forces before and after the initial equilibrium", "equilibrium",
                 "Fig. 2: forces on the points of the skin under 10 % turgor and weight (0.1 kg a "
                 "layer), before and\nafter the initial equilibrium; from the side.") +
         picture("The jaw opens", "opening", "Fig. 5: the jaw is opened by 8°.") +
         picture("Two surgical options", "options",
                 "Fig. 7: two options: the jaw 6 mm forward, or 6 mm forward and turned by 4°.");
}

}  // namespace

std::string page(const Findings& findings, const std::string& command, const std::string& images) {
  return fmt::format(
             "# The paper's experiments, rerun\n\n"
             "Teschner, Girod and Girod, \"Direct Computation of Nonlinear Soft-Tissue "
             "Deformation\", VMV 2000,\non the shipped head of the paper's size (`{}`: quartic "
             "springs of 1 N/mm,\ns_ref = 1 mm, the lower jaw 6 mm forward).\n\n"
             "Made by `{}` in one run, on one core of a machine with {};\n"
             "pictures by `drivers/plot_paper.py`. Times vary by machine and by run.\n\n",
             findings.plan.scene.file.filename().string(), command, base::machine()) +
         size_table(findings) + run_tables(findings) + motion_table(findings) + claims(findings) +
         figures(images);
}

}  // namespace repose::paper
