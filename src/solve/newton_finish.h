#pragma once
#include "rest_distance.h"

namespace repose::solve {

/// Ends a search by Newton steps, of the linear system that the estimate of the distance to rest
/// has solved anyway. Collective.
class NewtonFinish {
 public:
  NewtonFinish(discrete::Function& function, RestDistance& distance)
      : function_(function),
        distance_(distance),
        gradient_(function.positions().make_vector()),
        saved_(function.positions().make_vector()) {}

  /// End of a search.
  struct End {
    double objective = 0;
    double largest_force = 0;  ///< N
    double error = 0;          ///< mm, estimated distance to rest
    int corrections = 0;       ///< Newton steps
  };
  /// Takes Newton steps from `displacement` as long as they halve the distance to rest, to
  /// `accuracy`. `taken`: mm, the full Newton step that led here, or 0; `sure`: the estimate there
  /// is reported if no step follows.
  End run(Vec displacement, double accuracy, double taken, bool sure);
  Vec gradient() const { return gradient_; }  ///< at the end

 private:
  discrete::Function& function_;
  RestDistance& distance_;
  base::VecHandle gradient_, saved_;
};

}  // namespace repose::solve
