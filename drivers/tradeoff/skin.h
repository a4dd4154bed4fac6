#pragma once
#include "repose/model/model.h"

namespace repose::tradeoff {

/// The skin of the reference, and how far from it another model of the same face leaves it.
class Skin {
 public:
  /// `rest` [N] mm: the reference's positions at rest. `reference` must outlive this.
  Skin(const model::Model& reference, const std::vector<Vec3>& rest);

  const std::vector<Vec3>& rest() const { return rest_; }                ///< [V] mm
  const std::vector<Triangle>& triangles() const { return triangles_; }  ///< of rows of rest()

  /// [V] mm: at each skin vertex of the reference, the distance between its place at rest and
  /// where the displacement of `model` at `position`, carried over (adapt/transfer.h), takes it.
  std::vector<double> distances(const model::Model& model, const std::vector<Vec3>& position) const;

 private:
  const model::Model& reference_;
  std::vector<int64_t> row_;  // [V] of the reference
  std::vector<Vec3> rest_;
  std::vector<Triangle> triangles_;
};

}  // namespace repose::tradeoff
