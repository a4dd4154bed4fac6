#include "repose/mechanics/runs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "assembled.h"
#include "states.h"

/// Kernels of runs against the plain ones, on graphs that have runs, broken runs and none.
namespace repose::mechanics {
namespace {

using model::PointSet;
using test::Random;

/// How a patch is spoilt.
struct Graph {
  const char* name;
  int64_t layers;
  double left_out;     ///< part of the elements
  bool rows_shuffled;  ///< elements in any order
  bool points_shuffled;
  bool mixed_laws;
};
constexpr Graph all_graphs[] = {
    {"TwoLayers", 2, 0, false, false, false},   {"FourLayers", 4, 0, false, false, false},
    {"EightLayers", 8, 0, false, false, false}, {"MixedLaws", 6, 0, false, false, true},
    {"Broken", 7, 0.2, true, false, false},     {"BrokenAndMixed", 9, 0.1, true, false, true},
    {"NoRuns", 5, 0, false, true, true},
};

template <class T>
void reorder(std::vector<T>& values, const std::vector<int64_t>& rows) {
  std::vector<T> picked;
  for (const int64_t row : rows) picked.push_back(values[row]);
  values = std::move(picked);
}

std::vector<int64_t> kept_rows(size_t count, const Graph& graph, Random& random) {
  std::vector<int64_t> rows;
  for (size_t row = 0; row < count; ++row)
    if (random() >= 2 * graph.left_out - 1) rows.push_back(static_cast<int64_t>(row));
  if (graph.rows_shuffled) std::shuffle(rows.begin(), rows.end(), std::mt19937(4));
  return rows;
}

void shuffle_points(model::Model& model) {
  std::vector<int64_t> row(model.points.position.size()), place(row.size());
  std::iota(row.begin(), row.end(), 0);
  std::shuffle(row.begin(), row.end(), std::mt19937(5));
  for (size_t k = 0; k < row.size(); ++k) place[row[k]] = static_cast<int64_t>(k);
  reorder(model.points.position, row);
  for (auto& spring : model.springs.points)
    for (int64_t& point : spring) point = place[point];
  for (auto& prism : model.prisms.points)
    for (int64_t& point : prism) point = place[point];
}

/// A patch with springs and prisms that differ; a tenth of its points and the deepest are fixed.
model::Model make(const Graph& graph) {
  model::Model model = test::layered_patch({7, 5, graph.layers, 1.0, 0.8});
  Random random(11);
  model::Springs& springs = model.springs;
  for (size_t e = 0; e < springs.points.size(); ++e) {
    springs.exponent[e] = static_cast<int8_t>(graph.mixed_laws ? std::abs(2.9 * random()) : 2);
    springs.stiffness[e] = 1.0 + 0.8 * random();
    springs.rest_length[e] *= 1.0 + 0.2 * random();
    springs.reference[e] *= 1.0 + 0.3 * random();
  }
  std::vector<int64_t> rows = kept_rows(springs.points.size(), graph, random);
  reorder(springs.points, rows), reorder(springs.exponent, rows);
  reorder(springs.stiffness, rows), reorder(springs.rest_length, rows);
  reorder(springs.reference, rows);
  rows = kept_rows(model.prisms.points.size(), graph, random);
  reorder(model.prisms.points, rows), reorder(model.prisms.rest_volume, rows);
  for (double& volume : model.prisms.rest_volume) volume *= 1.0 + 0.2 * random();
  for (PointSet& set : model.points.set)
    if (random() < -0.8) set = PointSet::boundary;
  if (graph.points_shuffled) shuffle_points(model);
  return model;
}

/// Loops of which about a part counts here.
Loops loops_of(const model::Model& model, double part) {
  Loops loops = make_loops(model, std::lround(part * model.springs.points.size()),
                           std::lround(part * model.prisms.points.size()));
  Random random(12);
  for (double& target : loops.prisms.target_volume) target *= 1.0 + 0.1 * random();
  return loops;
}

/// Positions of the patch with noise; some points coincide, and springs between some of those have
/// no rest length.
std::vector<Vec3> positions(const model::Model& model, Loops& loops, double noise) {
  Random random(13);
  std::vector<Vec3> x = model.points.position;
  for (Vec3& p : x) p += noise * random.vector();
  for (SpringLoop& loop : loops.springs)
    for (int64_t e = 0; e < loop.size(); e += 17) {
      const auto [i, j] = loop.points[e];
      x[j] = x[i];
      if (e % 2) loop.rest_length[e] = 0;
    }
  return x;
}

double largest(const Eigen::VectorXd& v) { return v.cwiseAbs().maxCoeff(); }

class RunsOfAGraph : public testing::TestWithParam<Graph> {
 protected:
  /// Calls check(loops, positions) for several shares of counted elements.
  template <class Check>
  void in_states(Check&& check) {
    for (const double part : {1.0, 0.6, 0.0})
      for (const double noise : {0.01, 0.3}) {
        Loops loops = loops_of(model_, part);
        const std::vector<Vec3> x = positions(model_, loops, noise);
        check(loops, x);
      }
  }
  model::Model model_ = make(GetParam());
};

TEST_P(RunsOfAGraph, KernelsAgreeOnValueAndGradient) {
  in_states([](const Loops& loops, const std::vector<Vec3>& x) {
    for (const VolumeTerm volume : {VolumeTerm::none, VolumeTerm::paper, VolumeTerm::penalty}) {
      const Weights weights{0.7, volume, 1.3};
      const auto plain = test::evaluate(loops, weights, x, Kernels::plain);
      for (const Kernels kernels : available_kernels()) {
        const auto here = test::evaluate(loops, weights, x, kernels);
        EXPECT_NEAR(here.value, plain.value, 1e-13 * plain.value);
        EXPECT_LE(largest(here.gradient - plain.gradient), 1e-13 * largest(plain.gradient));
      }
    }
  });
}

TEST_P(RunsOfAGraph, KernelsAgreeOnTheHessianAction) {
  in_states([](const Loops& loops, const std::vector<Vec3>& x) {
    const auto direction = test::random_directions(x.size());
    for (const VolumeTerm volume : {VolumeTerm::none, VolumeTerm::paper, VolumeTerm::penalty}) {
      const Weights weights{0.7, volume, 1.3};
      const auto plain = test::hessian_action(loops, weights, x, direction, Kernels::plain);
      for (const Kernels kernels : available_kernels()) {
        const auto here = test::hessian_action(loops, weights, x, direction, kernels);
        EXPECT_LE(largest(here - plain), 1e-13 * largest(plain));
      }
    }
  });
}

/// Checks the runs of the elements that begin at `begin`; `expected(run, k)` are the points of its
/// element k. Returns how many elements they hold.
template <class Run, size_t n, class Expected>
int64_t check_runs(const Runs<Run>& runs, const std::vector<std::array<int32_t, n>>& points,
                   int64_t begin, int64_t all_points, Expected&& expected) {
  int64_t e = begin;
  for (const Run& run : runs.runs) {
    EXPECT_LE(e + 4, static_cast<int64_t>(points.size()));
    EXPECT_LE(*std::max_element(points[e].begin(), points[e].end()) + 4, all_points);
    EXPECT_TRUE(run.count >= 2 && run.count <= Run::most);
    for (int k = 0; k < run.count; ++k) EXPECT_EQ(points[e + k], expected(run, k));
    e += run.count;
  }
  EXPECT_EQ(e - begin, runs.elements);
  return runs.elements;
}

TEST_P(RunsOfAGraph, AreWhatTheySayAndCanBeReadInFours) {
  const auto spring = [](const SpringRun& run, int k) {
    return std::array<int32_t, 2>{run.first + k, run.second + k};
  };
  const auto prism = [](const PrismRun& run, int k) {
    const auto [a, b, c] = run.top;
    return std::array<int32_t, 6>{a + k, b + k, c + k, a + k + 1, b + k + 1, c + k + 1};
  };
  const auto points = static_cast<int64_t>(model_.points.position.size());
  for (const double part : {1.0, 0.6, 0.0}) {
    const Loops loops = loops_of(model_, part);
    int64_t springs = 0, in_runs = 0;
    for (const SpringLoop& loop : loops.springs) {
      springs += loop.size();
      in_runs += check_runs(loop.counted_runs, loop.points, 0, points, spring);
      in_runs += check_runs(loop.other_runs, loop.points, loop.counted, points, spring);
    }
    const PrismLoop& prisms = loops.prisms;
    const int64_t stacked =
        check_runs(prisms.counted_runs, prisms.points, 0, points, prism) +
        check_runs(prisms.other_runs, prisms.points, prisms.counted, points, prism);
    const std::string name = GetParam().name;
    if (name == "FourLayers" && part == 1) {
      EXPECT_GT(in_runs, 0.8 * springs);
      EXPECT_GT(stacked, 0.8 * prisms.size());
    }
    if (name == "NoRuns") {
      EXPECT_EQ(stacked, 0);
    }
  }
}

TEST_P(RunsOfAGraph, EveryElementIsEvaluatedOnce) {
  const Loops loops = loops_of(model_, 0.6);
  std::vector<int64_t> rows = loops.prisms.row;
  std::sort(rows.begin(), rows.end());
  EXPECT_EQ(std::adjacent_find(rows.begin(), rows.end()), rows.end());
  std::vector<double> here, there;
  for (const SpringLoop& loop : loops.springs)
    here.insert(here.end(), loop.stiffness.begin(), loop.stiffness.end());
  for (size_t e = 0; e < model_.springs.points.size(); ++e) {
    const auto [i, j] = model_.springs.points[e];
    if (model_.points.set[i] == PointSet::soft_tissue ||
        model_.points.set[j] == PointSet::soft_tissue)
      there.push_back(model_.springs.stiffness[e]);
  }
  std::sort(here.begin(), here.end());
  std::sort(there.begin(), there.end());
  EXPECT_EQ(here, there);
}

TEST(RunsOfASolid, KernelsAgree) {
  model::Model model = test::layered_patch({7, 5, 5, 1.0, 0.8});
  model.springs = {};
  Random random(14);
  for (const double volume : model.prisms.rest_volume) {
    model.prisms.shear_modulus.push_back(1.0 + 0.8 * random());
    model.prisms.modulus.push_back(5.0 + 4 * random());
    model.prisms.target_volume.push_back(volume * 1.2);
  }
  model::assemble_edges("patch", model);
  const auto count = static_cast<int64_t>(model.prisms.points.size());
  const auto edges = static_cast<int64_t>(model.edges.points.size());
  for (const int64_t owned : {edges, edges / 2, int64_t{0}}) {
    const Loops loops = make_loops(model, 0, count * owned / edges, owned);
    EXPECT_GT(loops.edges.counted_runs.elements + loops.edges.other_runs.elements, edges / 2);
    std::vector<Vec3> x = model.points.position;
    for (Vec3& p : x) p += 0.2 * random.vector();
    const Weights weights{1, VolumeTerm::penalty, 1};
    const auto plain = test::evaluate(loops, weights, x, Kernels::plain);
    const auto directions = test::random_directions(x.size());
    const auto product = test::hessian_action(loops, weights, x, directions, Kernels::plain);
    for (const Kernels kernels : available_kernels()) {
      const auto here = test::evaluate(loops, weights, x, kernels);
      EXPECT_NEAR(here.value, plain.value, 1e-13 * std::abs(plain.value));
      EXPECT_LE(largest(here.gradient - plain.gradient), 1e-13 * largest(plain.gradient));
      const auto acted = test::hessian_action(loops, weights, x, directions, kernels);
      EXPECT_LE(largest(acted - product), 1e-13 * largest(product));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Graphs, RunsOfAGraph, testing::ValuesIn(all_graphs),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace repose::mechanics
