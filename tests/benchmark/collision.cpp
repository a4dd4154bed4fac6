/// Time of one question about two bones of 100 000 triangles each, the trees being built.
///
///     cmake --preset ci -DREPOSE_BENCHMARKS=ON && cmake --build --preset ci
///     build-ci/tests/benchmark/benchmark_collision
#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>

#include "repose/surface/collision.h"

namespace {

using namespace repose;

/// A ball of radius 50 mm with knobs as high as teeth, n longitudes by n latitudes.
surface::Surface knobby(int n) {
  surface::Surface s{"knobby", {Vec3(0, 0, 50), Vec3(0, 0, -50)}, {}};
  for (int j = 1; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const double a = 2 * std::numbers::pi * i / n, b = std::numbers::pi * j / n;
      const double r = 50 + 4 * std::sin(11 * a) * std::sin(b) * std::sin(12 * b);
      s.points.push_back(r *
                         Vec3(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b)));
    }
  const auto at = [n](int i, int j) -> int64_t { return 2 + (j - 1) * n + i % n; };
  for (int i = 0; i < n; ++i) {
    s.triangles.push_back({0, at(i, 1), at(i + 1, 1)});
    s.triangles.push_back({1, at(i + 1, n - 1), at(i, n - 1)});
    for (int j = 1; j + 1 < n; ++j) {
      s.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
      s.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
    }
  }
  return s;
}

const surface::CollisionTree& bone() {
  static const surface::CollisionTree tree(knobby(224));
  return tree;
}

/// Apart by `gap` mm, found by steps along x.
Mat4 pose_at(double gap) {
  Mat4 pose = Mat4::Identity();
  pose(0, 3) = 150;
  pose(1, 3) = 7;
  for (double now = 1; now > 1e-4;) {
    now = surface::nearest(bone(), bone(), pose)->distance;
    pose(0, 3) -= 0.5 * now;
  }
  pose(0, 3) += gap;
  return pose;
}

void touch(benchmark::State& state) {
  const Mat4 pose = pose_at(1e-2 * static_cast<double>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(surface::touch(bone(), bone(), pose));
  state.counters["triangles"] = static_cast<double>(bone().triangles());
}
BENCHMARK(touch)->Arg(-300)->Arg(-5)->Arg(1)->Arg(50)->Arg(500)->Unit(benchmark::kMillisecond);

void nearest(benchmark::State& state) {
  const Mat4 pose = pose_at(1e-2 * static_cast<double>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(surface::nearest(bone(), bone(), pose));
}
BENCHMARK(nearest)->Arg(-300)->Arg(1)->Arg(50)->Arg(500)->Unit(benchmark::kMillisecond);

void build(benchmark::State& state) {
  const surface::Surface surface = knobby(224);
  for (auto _ : state) benchmark::DoNotOptimize(surface::CollisionTree(surface));
}
BENCHMARK(build)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
