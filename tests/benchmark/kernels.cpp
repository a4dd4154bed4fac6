/// Time of each kernel per spring and per prism, in the cache and out of it, beside STREAM's triad
/// and copy in the same run; writes the table. One core, best on an idle machine; a minute or two:
///     benchmark_kernels [docs/measurements/kernels.md] [--benchmark_repetitions=5]
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <functional>
#include <map>
#include <random>
#include <string_view>
#include <thread>

#include "../layered_patch.h"
#include "repose/mechanics/energy.h"
#include "repose/mechanics/hessian.h"
#include "repose/model/material.h"

namespace {

using namespace repose;
using mechanics::Curvature;
using mechanics::VolumeTerm;
using mechanics::Weights;

constexpr Weights springs_only{1.0, VolumeTerm::none, 0.0};
constexpr Weights with_penalty{1.0, VolumeTerm::penalty, 0.4};
constexpr Weights of_solid{1.0, VolumeTerm::penalty, 1.0};
constexpr int64_t layers = 4;
constexpr int64_t sizes[] = {35, 354};       // columns along a side: 5e3 and 5e5 points
constexpr double out_of_all_caches = 1.5e9;  // bytes of STREAM's three arrays

/// The patch as a solid of ν = 0.45 in place of springs, its volumes averaged around points or not.
mechanics::Loops solid_loops(model::Model model, bool averaged) {
  model.springs = {};
  model::Prisms& prisms = model.prisms;
  const model::Moduli of = model::moduli({0.015, 0.45});
  prisms.shear_modulus.assign(prisms.points.size(), of.shear);
  prisms.modulus.assign(prisms.points.size(), of.volume);
  for (const double volume : prisms.rest_volume)
    prisms.target_volume.push_back(volume * (1 + of.shear / of.volume));
  if (averaged) prisms.nodal_modulus.assign(prisms.points.size(), of.volume - of.shear);
  model::assemble_edges("patch", model);
  return mechanics::make_loops(model, 0, static_cast<int64_t>(prisms.points.size()),
                               static_cast<int64_t>(model.edges.points.size()),
                               static_cast<int64_t>(model.points.position.size()));
}

struct Workload {
  mechanics::Loops springs, prisms;  // for products of one kind
  mechanics::Loops solid, averaged;
  std::vector<Vec3> position, direction, result;
  std::vector<double> slopes;  // of the averaged volumes

  explicit Workload(int64_t columns) {
    const model::Model model = test::layered_patch({columns, columns, layers, 1.0, 0.8});
    springs = mechanics::make_loops(model, static_cast<int64_t>(model.springs.points.size()),
                                    static_cast<int64_t>(model.prisms.points.size()));
    std::swap(prisms.prisms, springs.prisms);
    solid = solid_loops(model, false);
    averaged = solid_loops(model, true);
    std::mt19937 engine(1);
    std::uniform_real_distribution<double> noise(-0.1, 0.1);
    for (const Vec3& x : model.points.position) {
      direction.emplace_back(noise(engine), noise(engine), noise(engine));
      position.push_back(x + direction.back());
    }
    result.assign(position.size(), Vec3::Zero());
    slopes = mechanics::nodal_slopes(averaged.nodal, position);
  }
  const mechanics::SpringLoop& spring_loop() const { return springs.springs[0]; }
  const mechanics::PrismLoop& prism_loop() const { return prisms.prisms; }
};

/// One workload a size, made when first asked for.
Workload& workload(int64_t columns) {
  static std::map<int64_t, Workload> made;
  return made.try_emplace(columns, columns).first->second;
}

/// A kernel to measure: its elements, what they read and write, and the work.
struct Kernel {
  const char* name;
  int64_t (*elements)(const Workload&);
  double vectors;  ///< read or written once a point
  std::function<void(Workload&)> work;
};

int64_t springs(const Workload& w) { return w.spring_loop().size(); }
int64_t prisms(const Workload& w) { return w.prism_loop().size(); }
int64_t edges(const Workload& w) { return w.solid.edges.size(); }

const Kernel kernels[] = {
    {"spring energy and gradient", springs, 3,
     [](Workload& w) {
       benchmark::DoNotOptimize(
           mechanics::add_spring_gradient(w.spring_loop(), w.position, 1.0, w.result));
     }},
    {"spring Hessian action", springs, 4,
     [](Workload& w) {
       mechanics::add_hessian_action(w.springs, w.position, springs_only, w.direction, w.result,
                                     {});
     }},
    {"prism energy and gradient", prisms, 3,
     [](Workload& w) {
       benchmark::DoNotOptimize(
           mechanics::add_prism_gradient(w.prism_loop(), w.position, with_penalty, w.result));
     }},
    {"prism Hessian action", prisms, 4,
     [](Workload& w) {
       mechanics::add_hessian_action(w.prisms, w.position, with_penalty, w.direction, w.result, {});
     }},
    {"solid edge energy and gradient", edges, 3,
     [](Workload& w) {
       benchmark::DoNotOptimize(
           mechanics::add_edge_gradient(w.solid.edges, w.position, 1.0, w.result));
     }},
    {"solid prism with its edges, energy and gradient", prisms, 3,
     [](Workload& w) {
       benchmark::DoNotOptimize(
           mechanics::add_edge_gradient(w.solid.edges, w.position, 1.0, w.result) +
           mechanics::add_prism_gradient(w.solid.prisms, w.position, of_solid, w.result));
     }},
    {"solid prism with its edges, Hessian action", prisms, 4,
     [](Workload& w) {
       mechanics::add_hessian_action(w.solid, w.position, of_solid, w.direction, w.result, {});
     }},
    {"solid prism of averaged volume with its edges, energy and gradient", prisms, 3,
     [](Workload& w) {
       benchmark::DoNotOptimize(
           mechanics::add_edge_gradient(w.averaged.edges, w.position, 1.0, w.result) +
           mechanics::add_volume_gradient(w.averaged, w.position, of_solid, w.result));
     }},
    {"solid prism of averaged volume with its edges, Hessian action", prisms, 4,
     [](Workload& w) {
       mechanics::add_hessian_action(w.averaged, w.position, of_solid, w.direction, w.result,
                                     w.slopes);
     }},
};

/// Bytes of a loop's elements: their points, and some numbers for each.
template <class Loop>
double bytes_of_elements(const Loop& loop, int numbers) {
  return static_cast<double>((sizeof loop.points[0] + numbers * sizeof(double)) * loop.size());
}

/// Bytes that go over a kernel's arrays once, for all elements.
double bytes(const Kernel& kernel, const Workload& w) {
  double elements = 0;
  const bool solid = std::string_view(kernel.name).starts_with("solid");
  if (kernel.elements == springs) elements = bytes_of_elements(w.spring_loop(), 3);
  if (kernel.elements == prisms) elements = bytes_of_elements(w.prism_loop(), 2);
  if (solid) elements += bytes_of_elements(w.solid.edges, 1);
  return elements + kernel.vectors * sizeof(Vec3) * static_cast<double>(w.position.size());
}

/// Bytes of the springs' arrays, a size that STREAM is measured at, too.
double stream_bytes(int64_t columns) { return bytes(kernels[0], workload(columns)); }

void triad(benchmark::State& state, double bytes) {
  const auto n = static_cast<size_t>(bytes / 24);
  std::vector<double> a(n, 1.0), b(n, 2.0), c(n, 3.0);
  for (auto _ : state) {
    for (size_t i = 0; i < n; ++i) a[i] = b[i] + 3.0 * c[i];
    benchmark::ClobberMemory();
  }
  state.SetBytesProcessed(static_cast<int64_t>(24 * n) * state.iterations());
}

void copy(benchmark::State& state, double bytes) {
  const auto n = static_cast<size_t>(bytes / 16);
  std::vector<double> a(n, 1.0), b(n, 2.0);
  for (auto _ : state) {
    std::memcpy(a.data(), b.data(), n * sizeof(double));
    benchmark::ClobberMemory();
  }
  state.SetBytesProcessed(static_cast<int64_t>(16 * n) * state.iterations());
}

void spring_blocks(benchmark::State& state, int64_t columns) {
  Workload& work = workload(columns);
  for (auto _ : state)
    mechanics::for_each_spring_block(work.spring_loop(), work.position, 1.0,
                                     Curvature::semidefinite, [](int64_t, const Mat3& block) {
                                       benchmark::DoNotOptimize(block.data());
                                       benchmark::ClobberMemory();
                                     });
}

void prism_blocks(benchmark::State& state, int64_t columns) {
  Workload& work = workload(columns);
  for (auto _ : state)
    mechanics::for_each_prism_block(work.prisms, work.position, with_penalty, {},
                                    [](int64_t, const mechanics::PrismBlocks& blocks) {
                                      benchmark::DoNotOptimize(&blocks);
                                      benchmark::ClobberMemory();
                                    });
}

std::string name_of(const Kernel& kernel, int64_t columns) {
  return fmt::format("{}/{}", kernel.name, columns);
}

std::string name_of_stream(const char* which, double bytes) {
  return fmt::format("STREAM {}/{:.1f} MB", which, bytes / 1e6);
}

void register_stream(double bytes) {
  benchmark::RegisterBenchmark(name_of_stream("triad", bytes).c_str(), triad, bytes);
  benchmark::RegisterBenchmark(name_of_stream("copy", bytes).c_str(), copy, bytes);
}

void register_size(int64_t columns) {
  register_stream(stream_bytes(columns));
  for (const Kernel& kernel : kernels)
    benchmark::RegisterBenchmark(name_of(kernel, columns).c_str(),
                                 [&kernel, columns](benchmark::State& state) {
                                   Workload& work = workload(columns);
                                   for (auto _ : state) {
                                     kernel.work(work);
                                     benchmark::ClobberMemory();
                                   }
                                 });
  benchmark::RegisterBenchmark(fmt::format("spring blocks/{}", columns).c_str(), spring_blocks,
                               columns);
  benchmark::RegisterBenchmark(fmt::format("prism blocks/{}", columns).c_str(), prism_blocks,
                               columns);
}

/// Prints as usual and keeps the least CPU seconds of each benchmark's repetitions.
class Times : public benchmark::ConsoleReporter {
 public:
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration || run.iterations == 0) continue;
      const double seconds = run.cpu_accumulated_time / static_cast<double>(run.iterations);
      const auto [place, first] = least_.try_emplace(run.run_name.function_name, seconds);
      place->second = std::min(place->second, seconds);
    }
    ConsoleReporter::ReportRuns(runs);
  }
  double of(const std::string& name) const { return least_.at(name); }

 private:
  std::map<std::string, double> least_;
};

/// Bytes a second of STREAM over arrays of so many bytes together.
double bandwidth(const Times& times, const char* which, double bytes) {
  return bytes / times.of(name_of_stream(which, bytes));
}

std::string rows(const Times& times, int64_t columns) {
  const Workload& w = workload(columns);
  const double triad = bandwidth(times, "triad", stream_bytes(columns));
  const double memory = bandwidth(times, "triad", out_of_all_caches);
  std::string text;
  for (const Kernel& kernel : kernels) {
    const double seconds = times.of(name_of(kernel, columns));
    const double all = bytes(kernel, w), n = static_cast<double>(kernel.elements(w));
    text += fmt::format("| {} | {} | {:.2f} | {:.0f} | {:.1f} | {:.1f} |\n", kernel.name,
                        w.position.size(), 1e9 * seconds / n, all / n, seconds * triad / all,
                        seconds * memory / all);
  }
  return text;
}

std::string stream_rows(const Times& times) {
  std::string text = "| arrays, MB | triad, GB/s | copy, GB/s |\n|--:|--:|--:|\n";
  for (const double bytes : {stream_bytes(sizes[0]), stream_bytes(sizes[1]), out_of_all_caches})
    text +=
        fmt::format("| {:.1f} | {:.1f} | {:.1f} |\n", bytes / 1e6,
                    bandwidth(times, "triad", bytes) / 1e9, bandwidth(times, "copy", bytes) / 1e9);
  return text;
}

/// Writes the tables below the page's mark.
void write_page(const std::string& path, const Times& times) {
  const std::string mark = "<!-- measured -->\n";
  std::ifstream file(path);
  std::string text(std::istreambuf_iterator<char>(file), {});
  text.resize(std::min(text.find(mark), text.size()));
  const double memory = static_cast<double>(sysconf(_SC_PHYS_PAGES)) *
                        static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 30);
  text += mark + fmt::format("\nOne core of a machine with {} cores, {:.0f} GiB of memory.\n\n",
                             std::thread::hardware_concurrency(), memory);
  text += stream_rows(times) +
          "\n| kernel | points | ns/element | bytes/element | × triad |"
          " × triad of memory |\n|---|--:|--:|--:|--:|--:|\n";
  for (const int64_t columns : sizes) text += rows(times, columns);
  std::ofstream(path) << text;
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  for (const int64_t columns : sizes) register_size(columns);
  register_stream(out_of_all_caches);
  Times times;
  benchmark::RunSpecifiedBenchmarks(&times);
  if (argc == 2) write_page(argv[1], times);
  return 0;
}
