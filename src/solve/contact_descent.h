#pragma once
#include "contact_programs.h"

namespace repose::solve {

/// mm, to which a rest position is chosen whatever the accuracy: on which side of an edge a point
/// rests depends on this.
inline constexpr double chosen_to = 0.02;
inline constexpr int most_rounds = 8;  ///< of programs

/// Returns the `next` outcome of a search as that of all, with the `before` that it continues from.
Outcome continued(Outcome before, Outcome next);

/// Stages of a search with contact: soft quasi-Newton searches, programs among rounded bodies,
/// rounds of programs, and the estimate that ends it. All members collective.
class ContactDescent {
 public:
  using End = ContactPrograms::End;
  /// `minimizer` minimizes `objective`.
  ContactDescent(discrete::Objective& objective, discrete::Tangent& tangent, Minimizer& minimizer,
                 ContactPrograms& programs);

  /// Takes so many times the model's stiffness as that of the penalty.
  void stiffen(int times);
  int times() const { return times_; }  ///< the stiffness, of the model's
  /// Comes near the rest position among bodies that hardly resist, which leaves no multipliers.
  void slacken(Vec displacement);
  /// Finds the rest position among bodies with rounded edges, which catch fewer points on either
  /// side. It is found so finely that the sides do not depend on the way to it.
  End approach(Vec displacement, int64_t& iterations);
  /// Ends the search where a strict estimate says that it is over.
  Outcome finish(Vec displacement, double accuracy);
  /// finish() at a position that programs have reached. They go on where it misses the accuracy: an
  /// end before the next step relies on what that step is expected to be.
  Outcome finish_reached(Vec displacement, double accuracy, int64_t& iterations);
  /// Ends at rest by rounds of programs from a position near it: after a soft search where they do
  /// not reach it, with a stiffer penalty in each round.
  Outcome settle(Vec displacement, double accuracy, int max_rounds, bool needs_presolve);
  /// Leads a rest position that was found to chosen_to on to a finer accuracy; explains an outcome
  /// that is none.
  Outcome refine(Vec displacement, double accuracy, Outcome outcome);
  /// Returns the outcome of a search that is stopped at `displacement`.
  Outcome stopped(Vec displacement, Outcome outcome = {});

 private:
  bool release_overlapped();
  bool lead_out(Vec displacement);
  void soften();
  void harden(Vec displacement);

  discrete::Objective& objective_;
  discrete::Tangent& tangent_;
  Minimizer& minimizer_;
  ContactPrograms& programs_;
  int times_ = 1;
  double stiffness_;  // N/mm³
};

}  // namespace repose::solve
