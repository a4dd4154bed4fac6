#pragma once
#include "other_rest_search.h"

namespace repose::solve {

/// Finds the rest position of tissue that touches bodies and itself (docs/theory/contact.md): the
/// step to a load is predicted with its contact by a quadratic program; a quasi-Newton search on
/// the augmented Lagrangian with a soft penalty comes near to the rest position among bodies with
/// rounded edges; sequential quadratic programs (Nocedal & Wright 2006, chapter 18) lead there, and
/// on to the bodies themselves, multipliers included. Where these fail, they are repeated after
/// finer soft searches, with a stiffer penalty; points between bodies that overlap are led out
/// round an edge, or released from one of them. The multipliers of a load are where the next
/// begins. At load 1, where points press near an edge of a body, other rest positions are searched
/// for (OtherRestSearch): that of least energy is taken, and the outcome states the distance of
/// another. The accuracy does not choose between them: that is done at an accuracy of its own.
class ContactSearch : public RestSearch {
 public:
  /// `tangent` is the objective's Hessian, `solver` solves with it, `minimizer` minimizes
  /// it.
  ContactSearch(discrete::Objective& objective, discrete::Tangent& tangent,
                linear::TangentSolver& solver, Minimizer& minimizer, Minimizer::Watch watch);
  /// Sets if find_other() searches (the default).
  void enable_other_rest(bool enabled) { finds_other_ = enabled; }
  int64_t evaluations_for_other() const { return other_.evaluations(); }
  std::optional<bool> predict(Vec displacement, double load, Vec increment) override;
  Outcome run(Vec displacement, double accuracy) override;
  /// By quadratic programs alone, as long as they serve.
  Outcome run_near(Vec displacement, double accuracy) override;
  void find_other(Vec displacement, double accuracy, Outcome& outcome) override;
  discrete::ContactPressures pressures() const override {
    return objective_.contact().multipliers();
  }
  void set_pressures(const discrete::ContactPressures& to) override {
    tangent_.change_contact().set_multipliers(to);
  }

 private:
  using End = ContactPrograms::End;
  Outcome end(Vec displacement, double accuracy, Outcome outcome);

  discrete::Objective& objective_;
  discrete::Tangent& tangent_;
  ContactPrograms programs_;
  ContactDescent descent_;
  OtherRestSearch other_;
  bool finds_other_ = true;
  bool predicted_ = false;  // the next search begins with a prediction
};

}  // namespace repose::solve
