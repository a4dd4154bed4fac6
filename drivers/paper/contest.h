#pragma once
#include <functional>
#include <string>
#include <vector>

#include "functional.h"
#include "repose/solve/problem.h"
#include "stopping_test.h"

namespace repose::paper {

/// Outcome of one method.
struct Entry {
  enum class End {
    reached,      ///< within the accuracy of the reference
    own_minimum,  ///< within the accuracy of another minimum, to which it was going
    limit,        ///< evaluations or time used up
    elsewhere,    ///< the method stopped by itself at no minimum
  };
  std::string method;
  End end = End::limit;
  int64_t evaluations = 0;
  int64_t assemblies = 0;    ///< of the Hessian
  int64_t renewals = 0;      ///< of the preconditioner, if PETSc's log is on (PetscLogDefaultBegin)
  int64_t actions = 0;       ///< of the Hessian on a vector, likewise
  int64_t applications = 0;  ///< of preconditioners on a vector, likewise
  double seconds = 0;        ///< CPU
  double distance = 0;  ///< mm from the reference: closest state, own minimum or where it stopped
  double excess = 0;    ///< at its own minimum, (Φ − Φ_reference) / |Φ_reference|
  bool arrived() const { return end == End::reached || end == End::own_minimum; }
};

/// A functional of a model with the bones at their ends, minimized by one method after another from
/// the initial positions of the tissue. Serial.
class Contest {
 public:
  /// Smoothing of |F| in the force functional for methods that take one function, N.
  static constexpr double epsilon = 1e-3;

  Contest(const model::Model& model, const Functional& functional, const Rules& rules);
  /// Any objective: the energy (or, with `force`, the force functional) with a volume term.
  Contest(const model::Model& model, const mechanics::Weights& weights, bool force,
          const Rules& rules);

  /// As repose-solve does it: load steps, Newton, its own estimate of the distance. Where it
  /// arrives, its end becomes the reference.
  Entry follow_path();
  /// Refines the reference to `accuracy` mm, from `start` (where the path did not arrive) or from
  /// itself. Returns whether it is known that well.
  bool refine(double accuracy, Vec start = nullptr);
  void set_reference(Vec displacement);
  base::VecHandle copy_of_reference() const;
  /// The unknowns that take the tissue to `position` [N], mm.
  base::VecHandle displacement_to(const std::vector<Vec3>& position) const;
  double distance(Vec displacement) const;  ///< mm from the reference

  /// follow_path, run to the reference like the others; `load_steps` 0: as many as needed.
  Entry run_path(int load_steps = 0);

  // The others, in one load step.
  Entry run_polak_ribiere();
  Entry run_tao(const std::string& type);  ///< a TAO method: cg, lmvm, nls, ntr, …
  /// Any search: `search` minimizes the function it is given from the displacement it is given.
  /// One that does not come to the reference is followed to an energy minimum near where it ended
  /// and, if there is one, run again to that.
  using Search = std::function<void(discrete::Function&, Vec)>;
  Entry run(const std::string& method, const Search& search);

  /// Smallest and largest eigenvalue of the Hessian at the reference, N/mm.
  struct Curvature {
    double minimum, largest;
  };
  Curvature curvature();

 private:
  Search path_search(int load_steps, bool& complete);
  Entry run_to(Vec goal, const Rules& rules, const Search& search, Vec displacement);
  bool find_own_minimum(Vec displacement);

  discrete::Part part_;
  discrete::Positions positions_;
  solve::Problem problem_;
  base::VecHandle reference_;
  Rules rules_;
};

}  // namespace repose::paper
