#pragma once
#include "repose/model/model.h"
#include "repose/surface/surface.h"
#include "repose/tradeoff/study.h"

namespace repose::tradeoff {

/// The model of the scene that a way asks for: its layers, its skin's resolution.
model::Model build(const scene::Scene& scene, const Way& way);

/// The skin of the reference, and how far from it another model of the same face leaves it.
class Skin {
 public:
  /// `rest` [N] mm: the reference's positions at rest.
  Skin(const model::Model& reference, const std::vector<Vec3>& rest);

  const std::vector<Vec3>& rest() const { return rest_; }
  const std::vector<Triangle>& triangles() const { return triangles_; }

  /// [V] mm: at each skin vertex of the reference, the distance between its place at rest and
  /// where the displacement of `model` at `position`, taken at the nearest point of that model's
  /// skin, takes it.
  std::vector<double> distances(const model::Model& model, const std::vector<Vec3>& position) const;

 private:
  std::vector<Vec3> initial_, rest_;
  std::vector<Triangle> triangles_;
};

}  // namespace repose::tradeoff
