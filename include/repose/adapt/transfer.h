#pragma once
#include <array>
#include <vector>

#include "repose/model/model.h"

namespace repose::adapt {

/// Carries displacements from one model of an anatomy to another: each column of `to` finds its
/// place on the initial skin of `from`, and each of its points that depth below it; displacements
/// are interpolated linearly over the skin's triangles and down the columns. A column whose deepest
/// point is fixed in `to` is drawn to where that point goes, in proportion to depth; fixed points
/// go where they are taken. Both models are those of scenes without incisions (points in columns,
/// layer by layer). Serial.
class Transfer {
 public:
  Transfer(const model::Model& from, const model::Model& to);

  /// Displacements [N of `to`] at full load from `displacement` [N of `from`], mm.
  std::vector<Vec3> carry(const std::vector<Vec3>& displacement) const;

 private:
  struct Place {
    std::array<int64_t, 3> column;  // of `from`
    Vec3 weight;                    // of each, sum 1
  };
  struct Stencil {
    std::array<int64_t, 6> point;  // of `from`
    std::array<double, 6> weight;
  };
  Stencil stencil(const Place& place, double depth) const;
  bool fixed(size_t point) const;  // of `to`

  const model::Model& to_;
  std::vector<double> from_depths_, to_depths_;  // of the layers, fractions of the thickness
  std::vector<Place> places_;                    // [columns of `to`]
};

}  // namespace repose::adapt
