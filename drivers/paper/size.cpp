#include "size.h"

#include "repose/base/program.h"
#include "repose/discrete/tangent.h"
#include "repose/linear/tangent_solver.h"
#include "repose/model/build.h"

namespace repose::paper {

using base::cpu_seconds, base::heap_bytes;

namespace {

void measure_solver(const model::Model& model, Size& size) {
  constexpr int evaluations = 100;
  double bytes = heap_bytes(), begin = cpu_seconds();
  const discrete::Part part = discrete::build_local_from_root(PETSC_COMM_SELF, model).part;
  discrete::Positions positions(PETSC_COMM_SELF, part);
  discrete::Objective objective(positions, {});
  const base::VecHandle at = positions.make_vector(), gradient = positions.make_vector();
  size.ready = cpu_seconds() - begin;
  size.descent_bytes = heap_bytes() - bytes;
  begin = cpu_seconds();
  for (int k = 0; k < evaluations; ++k) objective.evaluate(at, gradient);
  size.evaluation = (cpu_seconds() - begin) / evaluations;
  bytes = heap_bytes();
  discrete::Tangent tangent(objective);
  linear::TangentSolver solver(positions, tangent);
  solver.renew(at);
  size.newton_bytes = heap_bytes() - bytes;
}

}  // namespace

Size measure_size(const scene::Scene& scene) {
  Size size;
  size.layers = scene.tissue.layers;
  const double bytes = heap_bytes(), begin = cpu_seconds();
  const model::Model model = model::build_model(scene).model;
  size.build = cpu_seconds() - begin;
  size.model_bytes = heap_bytes() - bytes;
  size.counts = model::count(model);
  measure_solver(model, size);
  return size;
}

scene::Scene with_layers(scene::Scene scene, int layers) {
  scene.tissue.layers = layers;
  scene.tissue.depths.clear();
  return scene;
}

}  // namespace repose::paper
