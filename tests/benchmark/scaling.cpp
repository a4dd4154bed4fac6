/// Measures the cost of a model as its points grow: builds synthetic heads in four layers from 2e3
/// to 1e6 points, in one run, and writes the table of costs per point. One core; a few minutes;
/// wants 6 GB of memory:
///     benchmark_scaling docs/measurements/scaling.md
#include <algorithm>
#include <cstdio>
#include <functional>

#include "repose/base/petsc.h"
#include "repose/base/program.h"
#include "repose/base/whole_file.h"
#include "repose/discrete/tangent.h"
#include "repose/linear/tangent_solver.h"
#include "repose/model/build.h"
#include "repose/tools/phantom/phantom.h"

namespace {

using namespace repose;
using base::check, base::cpu_seconds, base::heap_bytes;

constexpr int layers = 4;
constexpr double bone_edge = 2;  // mm, of all heads: only the skin gets finer
const std::vector<int64_t> skin_sizes = {477, 2500, 25000, 250000};

/// Cost of one head: CPU seconds on one core, bytes on the heap.
struct Cost {
  int64_t points, springs, prisms;
  double build, evaluation, preconditioner, action;
  double model_bytes, solver_bytes;
};

/// Seconds of `work`, the least of several goes that together take about half a second.
double seconds_of(const std::function<void()>& work) {
  double minimum = 1e300, total = 0;
  for (int go = 0; go < 3 || total < 0.5; ++go) {
    const double begin = cpu_seconds();
    work();
    const double took = cpu_seconds() - begin;
    minimum = std::min(minimum, took);
    total += took;
  }
  return minimum;
}

/// The jaw opens by 8°, as in the shipped scenes.
scene::Scene jaw_opening() {
  scene::Scene scene;
  scene.bones = {{"skull", {}}, {"mandible", {}}};
  scene.tissue.layers = layers;
  scene.moves = {scene::RigidMotion(),
                 scene::RigidMotion::rotation(Vec3::UnitX(), Vec3::Zero(), 8)};
  return scene;
}

/// Adds the costs of the objective and of a preconditioner for its Hessian.
void measure_solver(const model::Model& model, Cost& cost) {
  const double before = heap_bytes();
  const discrete::Part part = discrete::build_local_from_root(MPI_COMM_SELF, model).part;
  discrete::Positions positions(MPI_COMM_SELF, part);
  const mechanics::Weights weights{1, mechanics::VolumeTerm::penalty,
                                   10 * model::effective_modulus(model)};
  discrete::Objective objective(positions, weights);
  const base::VecHandle at = positions.make_vector(), gradient = positions.make_vector();
  positions.set_load(0.1);
  cost.evaluation = seconds_of([&] { objective.evaluate(at, gradient); });
  discrete::Tangent tangent(objective);
  linear::TangentSolver solver(positions, tangent);
  solver.prepare(at);
  cost.preconditioner = seconds_of([&] { solver.preconditioner().rebuild(); });
  cost.action = seconds_of([&] {
    check(MatMult(tangent.action(), gradient, at));
    check(PCApply(solver.preconditioner(), at, gradient));
  });
  cost.solver_bytes = heap_bytes() - before;
}

Cost measure(int64_t skin_vertices, const std::vector<surface::Surface>& bones) {
  const surface::Surface skin = tools::phantom::make_phantom_skin(skin_vertices);
  const scene::Scene scene = jaw_opening();
  const double before = heap_bytes(), begin = cpu_seconds();
  const model::BuiltModel built = model::build_model(scene, skin, bones);
  Cost cost{};
  cost.build = cpu_seconds() - begin;
  cost.model_bytes = heap_bytes() - before;
  const model::Counts counts = model::count(built.model);
  cost.points = counts.points;
  cost.springs = counts.springs;
  cost.prisms = counts.prisms;
  measure_solver(built.model, cost);
  return cost;
}

std::string row(const Cost& cost, const Cost& reference) {
  const auto per_point = [](double value, const Cost& c) {
    return value / static_cast<double>(c.points);
  };
  const auto cell = [&](double Cost::*what, double unit) {
    const double here = per_point(cost.*what, cost), there = per_point(reference.*what, reference);
    return fmt::format(" {:.3g} ({:.2f}) |", here / unit, here / there);
  };
  return fmt::format("| {} | {} | {} |", cost.points, cost.springs, cost.prisms) +
         cell(&Cost::build, 1e-6) + cell(&Cost::evaluation, 1e-6) +
         cell(&Cost::preconditioner, 1e-6) + cell(&Cost::action, 1e-6) +
         cell(&Cost::model_bytes, 1) + cell(&Cost::solver_bytes, 1) + "\n";
}

std::string page(const std::vector<Cost>& costs) {
  std::string text = fmt::format(
      "# Scaling: cost per point from 2e3 to 1e6 points\n\n"
      "Made by `benchmark_scaling docs/measurements/scaling.md` (`cmake --preset release "
      "-DREPOSE_BENCHMARKS=ON`)\n"
      "in one run, on one core of a machine with {}.\n\n"
      "Synthetic heads (`repose-phantom`), {} layers, quartic springs, penalty volume term, bone\n"
      "edges of {} mm. Times are CPU time: to build the model from surfaces in memory, for one\n"
      "evaluation of energy and gradient, for a new preconditioner, and for one iteration of a\n"
      "linear system (a product with the Hessian and an application of the preconditioner).\n"
      "Memory is heap memory: of the model, and of the distributed model, the objective and the\n"
      "preconditioner. In brackets: the ratio to the row of about 1e5 points; exactly linear\n"
      "growth would give 1 throughout.\n\n"
      "| points | springs | prisms | build, µs/point | evaluation, µs/point |"
      " preconditioner, µs/point | iteration, µs/point | model, B/point | solver, B/point |\n"
      "|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n",
      base::machine(), layers, bone_edge);
  for (const Cost& cost : costs) text += row(cost, costs[costs.size() - 2]);
  return text;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: benchmark_scaling PAGE.md\n");
    return 1;
  }
  const base::Session session(1, argv);
  const std::vector<surface::Surface> bones = {tools::phantom::make_phantom_skull(bone_edge),
                                               tools::phantom::make_phantom_mandible(bone_edge)};
  std::vector<Cost> costs;
  for (const int64_t vertices : skin_sizes) {
    costs.push_back(measure(vertices, bones));
    std::fprintf(stderr, "%ld points: build %.2f s\n", static_cast<long>(costs.back().points),
                 costs.back().build);
  }
  base::write_whole_file(argv[1], page(costs));
  return 0;
}
