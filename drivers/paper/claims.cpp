#include <algorithm>
#include <optional>
#include <utility>

#include "page.h"

namespace repose::paper {

namespace {

using Filter = std::function<bool(const Functional&)>;

/// Number of of the one-step methods arrived at a minimum.
struct Score {
  int64_t arrived = 0, other = 0, run = 0;
  double share() const { return run ? static_cast<double>(arrived) / static_cast<double>(run) : 0; }
};

/// A functional without known rest position counts as not arrived at.
Score score(const Findings& findings, const Filter& chosen) {
  Score s;
  for (const Comparison& comparison : findings.comparisons) {
    if (!chosen(comparison.functional)) continue;
    s.run += static_cast<int64_t>(tao_methods.size()) + 1;
    for (const Entry& e : comparison.entries) {
      s.arrived += e.arrived();
      s.other += e.end == Entry::End::own_minimum;
    }
  }
  return s;
}

const Comparison* find(const Findings& findings, int layers, bool force, bool volume) {
  for (const Comparison& comparison : findings.comparisons)
    if (comparison.layers == layers && comparison.functional.force == force &&
        comparison.functional.volume == volume)
      return &comparison;
  return nullptr;
}

/// Without a verdict where the runs give none.
std::string claim(const std::string& title, std::optional<bool> holds, const std::string& why) {
  const std::string verdict = !holds   ? "Cannot be judged, as too few runs converged."
                              : *holds ? "Holds."
                                       : "Does not hold.";
  return fmt::format("**{}** {} {}\n\n", title, verdict, why);
}

/// A verdict on a comparison of two sets of runs, of which there must be some that converged.
std::optional<bool> verdict(bool known, bool holds) {
  return known ? std::optional(holds) : std::nullopt;
}

std::string default_times(const Findings& findings, bool force) {
  std::string text;
  for (const Comparison& comparison : findings.comparisons) {
    if (comparison.functional.force != force || comparison.functional.volume) continue;
    text += fmt::format("{}{} ms{}", text.empty() ? "" : ", ",
                        static_cast<int64_t>(1e3 * comparison.own.seconds),
                        comparison.own.arrived() ? "" : " without convergence");
  }
  return text;
}

std::string energy_or_force(const Findings& findings) {
  const Score energy = score(findings, [](const Functional& f) { return !f.force; });
  const Score force = score(findings, [](const Functional& f) { return f.force; });
  return claim(
      "Energy is faster and more robust than force.",
      verdict(energy.arrived + force.arrived > 0, energy.share() > force.share()),
      fmt::format("Of the one-step searches {} of {} reach a minimum of the energy, {} "
                  "of {} a minimum of the force\nfunctional. Our default, which follows the "
                  "bones, needs {}\nfor the energy and {} for forces without f_v. f_f is "
                  "stationary\nwherever its gradient −H F/|F| vanishes, which it does at "
                  "places with F ≠ 0.",
                  energy.arrived, energy.run, force.arrived, force.run,
                  default_times(findings, false), default_times(findings, true)));
}

/// Evaluations with f_v over those without, for every method that came to the same reference.
std::string volume_ratios(const Findings& findings) {
  double minimum = 1e300, maximum = 0;
  for (const Comparison& comparison : findings.comparisons) {
    const Comparison* with = find(findings, comparison.layers, false, true);
    if (comparison.functional.force || comparison.functional.volume || !with) continue;
    for (size_t k = 0; k < std::min(comparison.entries.size(), with->entries.size()); ++k) {
      if (!comparison.entries[k].arrived() || !with->entries[k].arrived()) continue;
      const double ratio = static_cast<double>(with->entries[k].evaluations) /
                           static_cast<double>(comparison.entries[k].evaluations);
      minimum = std::min(minimum, ratio);
      maximum = std::max(maximum, ratio);
    }
  }
  return maximum > 0 ? fmt::format("{:.2g} to {:.2g} times", minimum, maximum)
                     : "an unknown number of times";
}

/// Closest distances to rest that the paper's method reached by forces, for each number of layers.
std::string closest(const Findings& findings, bool volume) {
  std::string text;
  for (const Comparison& comparison : findings.comparisons)
    if (comparison.functional.force && comparison.functional.volume == volume)
      text += (text.empty() ? "" : ", ") +
              (comparison.entries.empty()
                   ? "an unknown distance"
                   : fmt::format("{:.2g} mm", comparison.entries.front().distance));
  return text;
}

std::string volume_and_force(const Findings& findings) {
  const auto of = [](bool force, bool volume) {
    return [=](const Functional& f) { return f.force == force && f.volume == volume; };
  };
  const Score without = score(findings, of(true, false)), with = score(findings, of(true, true));
  const Score energy = score(findings, of(false, false)), both = score(findings, of(false, true));
  return claim("f_v helps force minimization.",
               verdict(with.arrived + without.arrived > 0, with.arrived > without.arrived),
               fmt::format("One-step searches that converge: {} of {} with f_v, {} of {} without "
                           "it. The paper's method\ncame within {} with f_v and {} without it.",
                           with.arrived, with.run, without.arrived, without.run,
                           closest(findings, true), closest(findings, false))) +
         claim(
             "f_v does not help energy minimization.",
             verdict(both.arrived > 0 && energy.arrived > 0, both.other >= energy.other),
             fmt::format("With f_v a one-step search that converges takes {} the evaluations of "
                         "that without.\nThose that reach another minimum: {} of {} with f_v, {} "
                         "of {} without.",
                         volume_ratios(findings), both.other, both.run, energy.other, energy.run));
}

std::string memory(const Findings& findings) {
  double minimum = 1e300, maximum = 0;
  std::string text;
  for (const Size& s : findings.sizes) {
    const double bytes = s.model_bytes + s.descent_bytes + s.newton_bytes;
    const double each = bytes / static_cast<double>(s.counts.springs);
    text += fmt::format("{}{:.0f}", text.empty() ? "" : ", ", each);
    minimum = std::min(minimum, each);
    maximum = std::max(maximum, each);
  }
  if (findings.sizes.size() < 2)
    return fmt::format(
        "**Memory grows linearly.** Cannot be judged from one size. Bytes per "
        "spring: {}.\n\n",
        text);
  return claim("Memory grows linearly.", maximum <= 1.5 * minimum,
               fmt::format("Bytes per spring, Newton's method included: {}. From 2 thousand to a "
                           "million points:\n[scaling](scaling.md).",
                           text));
}

std::string preprocessing(const Findings& findings) {
  std::string text;
  double maximum = 0;
  for (const Size& s : findings.sizes) {
    const double evaluations = s.ready / s.evaluation;
    maximum = std::max(maximum, evaluations);
    text += fmt::format("{}{:.1f} ms", text.empty() ? "" : ", ", 1e3 * s.ready);
  }
  constexpr double little = 500;  // evaluations
  return claim(
      "No preprocessing.", maximum <= little,
      fmt::format("From the model in memory to the first evaluation: {}, the time of at "
                  "most {:.0f} evaluations\n(distribution over ranks and layout of the loops). "
                  "Newton's factorizations are made on the way\nand are included in its "
                  "times; nothing is condensed or factorized in advance.",
                  text, maximum));
}

std::string evaluations_text(const Entry& e) {
  return fmt::format("{}{}", e.arrived() ? "" : "> ", e.evaluations);
}

/// The run that arrived with the fewest evaluations, or else may have come nearest to that.
const Entry& best(const std::vector<Entry>& entries) {
  const auto order = [](const Entry& e) {
    return std::pair(e.arrived() ? 0 : e.end == Entry::End::limit ? 1 : 2, e.evaluations);
  };
  return *std::ranges::min_element(entries, {}, order);
}

/// Returns true if one run needs fewer evaluations than another; nothing if the runs do not show
/// it.
std::optional<bool> needs_fewer(const Entry& one, const Entry& other) {
  const auto exceeds = [](const Entry& ended, const Entry& arrived) {
    return ended.end == Entry::End::elsewhere || ended.evaluations >= arrived.evaluations;
  };
  if (one.arrived() && other.arrived()) return one.evaluations < other.evaluations;
  if (one.arrived() && exceeds(other, one)) return true;
  if (other.arrived() && exceeds(one, other)) return false;
  return {};
}

/// The verdict on all numbers of layers.
std::optional<bool> all_of(const std::vector<std::optional<bool>>& verdicts) {
  const auto no = [](const std::optional<bool>& v) { return v == false; };
  const auto known = [](const std::optional<bool>& v) { return v.has_value(); };
  if (std::ranges::any_of(verdicts, no)) return false;
  return verdict(!verdicts.empty() && std::ranges::all_of(verdicts, known), true);
}

std::string motion(const Findings& findings) {
  std::string text;
  std::vector<std::optional<bool>> paper_wins, ours_win;
  for (const MotionRun& m : findings.motions) {
    const Comparison* comparison = find(findings, m.layers, false, false);
    const Entry &paper = comparison->entries.front(), &direct = best(comparison->entries);
    paper_wins.push_back(needs_fewer(paper, best(m.entries)));
    ours_win.push_back(needs_fewer(direct, best(m.entries)));
    text += fmt::format(
        "{} layers: {} forces (Euler), {} (Runge–Kutta), against {} values "
        "(Polak–Ribière) and\n{} (best direct method). ",
        m.layers, evaluations_text(m.entries.front()), evaluations_text(m.entries.back()),
        evaluations_text(paper), evaluations_text(direct));
  }
  const std::optional<bool> ours = all_of(ours_win);
  return claim(
             "By the paper's method, direct minimization is faster than integrating the "
             "equations of motion.",
             all_of(paper_wins),
             text +
                 "\nEuler's figure is for the best damping and step, which follow from the "
                 "modes of the\nrest position. Its one evaluation per step needs no line "
                 "search, on which Brent's method spends most\nof its values.") +
         claim("The same, by today's direct methods.", ours,
               ours == true ? "Quasi-Newton and Newton methods need the fewest evaluations of all."
                            : "Evaluations are those above.");
}

}  // namespace

std::string claims(const Findings& findings) {
  return "## The claims\n\n" + energy_or_force(findings) + volume_and_force(findings) +
         memory(findings) + preprocessing(findings) + motion(findings);
}

}  // namespace repose::paper
