#pragma once
#include "repose/model/model.h"
#include "repose/scene/scene.h"

namespace repose::paper {

/// Size of a head: elements, bytes held on the heap, CPU seconds. Serial.
struct Size {
  int layers = 0;
  model::Counts counts;
  double model_bytes = 0;    ///< of the model
  double descent_bytes = 0;  ///< besides, to evaluate energy and gradient
  double newton_bytes = 0;   ///< besides, for Newton's method with its preconditioner
  double build = 0;          ///< s, surfaces to model
  double ready = 0;          ///< s, model to the first evaluation
  double evaluation = 0;     ///< s, of energy and gradient
};

/// Builds the scene's model and measures it.
Size measure_size(const scene::Scene& scene);

/// The scene with another number of even point layers.
scene::Scene with_layers(scene::Scene scene, int layers);

}  // namespace repose::paper
