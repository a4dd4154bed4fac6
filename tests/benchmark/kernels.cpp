/// Time per spring and per prism of each kernel, on regular patches of 1e4 to 1e6 points in four
/// layers. Best on an idle machine, one core:
///     benchmark_kernels --benchmark_repetitions=5 --benchmark_report_aggregates_only=true
#include <benchmark/benchmark.h>

#include <map>
#include <random>

#include "../layered_patch.h"
#include "repose/mechanics/energy.h"
#include "repose/mechanics/hessian.h"

namespace {

using namespace repose;
using mechanics::Curvature;
using mechanics::VolumeTerm;
using mechanics::Weights;

constexpr Weights springs_only{1.0, VolumeTerm::none, 0.0};
constexpr Weights with_penalty{1.0, VolumeTerm::penalty, 0.4};

struct Workload {
  mechanics::Loops loops;
  std::vector<Vec3> position, direction, result;

  explicit Workload(int64_t columns) {
    const model::Model model = test::layered_patch({columns, columns, 4, 1.0, 0.8});
    loops = mechanics::make_loops(model, static_cast<int64_t>(model.springs.points.size()),
                                  static_cast<int64_t>(model.prisms.points.size()));
    std::mt19937 engine(1);
    std::uniform_real_distribution<double> noise(-0.1, 0.1);
    for (const Vec3& x : model.points.position) {
      direction.emplace_back(noise(engine), noise(engine), noise(engine));
      position.push_back(x + direction.back());
    }
    result.assign(position.size(), Vec3::Zero());
  }
  int64_t springs() const { return loops.springs[0].size(); }
  int64_t prisms() const { return loops.prisms.size(); }
};

/// One workload a size, made when first asked for.
Workload& workload(const benchmark::State& state) {
  static std::map<int64_t, Workload> made;
  return made.try_emplace(state.range(0), state.range(0)).first->second;
}

void report(benchmark::State& state, const Workload& work, int64_t elements) {
  state.counters["points"] = static_cast<double>(work.position.size());
  state.counters["seconds_per_element"] = benchmark::Counter(
      static_cast<double>(elements),
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void spring_gradient(benchmark::State& state) {
  Workload& work = workload(state);
  for (auto _ : state)
    benchmark::DoNotOptimize(
        mechanics::add_spring_gradient(work.loops.springs[0], work.position, 1.0, work.result));
  report(state, work, work.springs());
}

void prism_gradient(benchmark::State& state) {
  Workload& work = workload(state);
  for (auto _ : state)
    benchmark::DoNotOptimize(
        mechanics::add_prism_gradient(work.loops.prisms, work.position, with_penalty, work.result));
  report(state, work, work.prisms());
}

/// The product with springs alone, or with prisms alone.
void hessian_action(benchmark::State& state, bool prisms) {
  Workload& work = workload(state);
  mechanics::Loops loops = work.loops;
  if (prisms) loops.springs.clear();
  for (auto _ : state) {
    mechanics::add_hessian_action(loops, work.position, prisms ? with_penalty : springs_only,
                                  work.direction, work.result);
    benchmark::ClobberMemory();
  }
  report(state, work, prisms ? work.prisms() : work.springs());
}

void spring_blocks(benchmark::State& state) {
  Workload& work = workload(state);
  for (auto _ : state)
    mechanics::for_each_spring_block(work.loops.springs[0], work.position, 1.0, Curvature::convex,
                                     [](int64_t, const Mat3& block) {
                                       benchmark::DoNotOptimize(block.data());
                                       benchmark::ClobberMemory();
                                     });
  report(state, work, work.springs());
}

void prism_blocks(benchmark::State& state, Curvature curvature) {
  Workload& work = workload(state);
  for (auto _ : state)
    mechanics::for_each_prism_block(work.loops.prisms, work.position, with_penalty, curvature,
                                    [](int64_t, const mechanics::PrismBlocks& blocks) {
                                      benchmark::DoNotOptimize(&blocks);
                                      benchmark::ClobberMemory();
                                    });
  report(state, work, work.prisms());
}

void totals(benchmark::State& state) {
  Workload& work = workload(state);
  for (auto _ : state) {
    mechanics::Totals sum = mechanics::totals(work.loops, work.position);
    benchmark::DoNotOptimize(sum);
  }
  report(state, work, work.springs() + work.prisms());
}

/// Columns along a side: 1e4, 1e5 and 1e6 points.
void sizes(benchmark::internal::Benchmark* b) {
  b->ArgName("columns")->Arg(50)->Arg(158)->Arg(500)->Unit(benchmark::kMillisecond);
}

BENCHMARK(spring_gradient)->Apply(sizes);
BENCHMARK(prism_gradient)->Apply(sizes);
BENCHMARK_CAPTURE(hessian_action, springs, false)->Apply(sizes);
BENCHMARK_CAPTURE(hessian_action, prisms, true)->Apply(sizes);
BENCHMARK(spring_blocks)->Apply(sizes);
BENCHMARK_CAPTURE(prism_blocks, exact, Curvature::exact)->Apply(sizes);
BENCHMARK_CAPTURE(prism_blocks, convex, Curvature::convex)->Apply(sizes);
BENCHMARK(totals)->Apply(sizes);

}  // namespace

BENCHMARK_MAIN();
