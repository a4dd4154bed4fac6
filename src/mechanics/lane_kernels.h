#pragma once
#include "lanes.h"
#include "repose/mechanics/prism_volume.h"
#include "repose/mechanics/spring_law.h"
#include "run_kernels.h"

/// The kernels of runs on Lanes; included by one file a set of instructions. Internal linkage, as
/// in lanes.h, and for the same reason nothing here calls a function that other files instantiate.
namespace repose::mechanics {
namespace {

/// Four consecutive vectors as they lie in memory: x0 y0 z0 x1 | y1 z1 x2 y2 | z2 x3 y3 z3.
template <int runs>
struct Rows {
  Lanes<runs> a, b, c;
  friend Rows operator-(const Rows& s, const Rows& t) { return {s.a - t.a, s.b - t.b, s.c - t.c}; }
  friend Rows operator+(const Rows& s, const Rows& t) { return {s.a + t.a, s.b + t.b, s.c + t.c}; }
  friend Rows operator*(const Rows& s, const Rows& t) { return {s.a * t.a, s.b * t.b, s.c * t.c}; }
};

/// Lanes 0 and 3 of s, 1 of t and 2 of u.
template <int runs>
Lanes<runs> blend(Lanes<runs> s, Lanes<runs> t, Lanes<runs> u) {
  return pick<0, 1, 6, 3>(pick<0, 5, 2, 3>(s, t), u);
}

/// The coordinates of the vectors, one vector a lane. Of shuffles of lanes, which a processor does
/// one at a time, three are enough; what comes before are blends.
template <int runs>
Triple<Lanes<runs>> coordinates(const Rows<runs>& r) {
  return {pick<0, 3, 2, 1>(blend(r.a, r.c, r.b)), pick<1, 0, 3, 2>(blend(r.b, r.a, r.c)),
          pick<2, 1, 0, 3>(blend(r.c, r.b, r.a))};
}

/// The inverse of coordinates().
template <int runs>
Rows<runs> rows(const Triple<Lanes<runs>>& t) {
  const auto x = pick<0, 3, 2, 1>(t.x), y = pick<1, 0, 3, 2>(t.y), z = pick<2, 1, 0, 3>(t.z);
  return {blend(x, y, z), blend(y, z, x), blend(z, x, y)};
}

/// A number for each coordinate of its vector.
template <int runs>
Rows<runs> spread(Lanes<runs> s) {
  return {pick<0, 0, 0, 1>(s), pick<1, 1, 2, 2>(s), pick<2, 3, 3, 3>(s)};
}

template <int runs>
Lanes<runs> dot(const Rows<runs>& s, const Rows<runs>& t) {
  const Triple<Lanes<runs>> products = coordinates(s * t);
  return products.x + products.y + products.z;
}

/// A first point of each run.
template <int runs>
using Firsts = int32_t[runs];

/// The numbers from `offset` on of each run's four vectors in `values` [3 P].
template <int runs>
Lanes<runs> four_of(const double* values, const Firsts<runs>& first, int offset) {
  const double* from[runs];
  for (int k = 0; k < runs; ++k) from[k] = values + 3 * int64_t{first[k]} + offset;
  return load(from);
}

template <int runs>
Rows<runs> gather(const double* values, const Firsts<runs>& first) {
  return {four_of<runs>(values, first, 0), four_of<runs>(values, first, 4),
          four_of<runs>(values, first, 8)};
}

/// Adds to `sums` [3 P], one run after the other: their points may be the same.
template <int runs>
void scatter(const Rows<runs>& rows, const Firsts<runs>& first, double* sums) {
  for (int k = 0; k < runs; ++k) {
    double* sum = sums + 3 * int64_t{first[k]};
    store(load(sum) + part(rows.a, k), sum);
    store(load(sum + 4) + part(rows.b, k), sum + 4);
    store(load(sum + 8) + part(rows.c, k), sum + 8);
  }
}

/// The runs from `run` on as lanes, whose first element is number `element` of the loop's.
template <int runs, class Run>
struct Step {
  const Run* run;
  int64_t element;

  int64_t elements() const {
    int64_t count = 0;
    for (int k = 0; k < runs; ++k) count += run[k].count;
    return count;
  }
  Lanes<runs> numbers(const double* of_elements) const {
    const double* from[runs];
    int64_t begin = element;
    for (int k = 0; k < runs; begin += run[k++].count) from[k] = of_elements + begin;
    return load(from);
  }
  Active<runs> active() const {
    int counts[runs];
    for (int k = 0; k < runs; ++k) counts[k] = run[k].count;
    return Active<runs>(counts);
  }
};

/// Calls visit(step) for all runs, `widest` at a time while there are as many.
template <int widest, class Run, class Visit>
void for_each_step(const Run* run, int64_t runs, Visit&& visit) {
  int64_t element = 0, k = 0;
  for (; k + widest <= runs; k += widest) {
    const Step<widest, Run> step{run + k, element};
    visit(step);
    element += step.elements();
  }
  for (; k < runs; ++k) {
    const Step<1, Run> step{run + k, element};
    visit(step);
    element += step.elements();
  }
}

/// Some runs of springs, each part of the work for all of them before the next: a spring's own
/// chain of operations is long, and a processor that sees the short chains of many has more to do
/// at once. Between the parts numbers are in arrays that stay in the cache: those of vectors by
/// pairs of runs, those of springs one after the other, whatever the counts of the runs.
template <int widest>
class SpringBatch {
 public:
  static constexpr int most_runs = 16;
  using Vectors [[gnu::aligned(64)]] = double[most_runs / 2][3][8];
  using Numbers [[gnu::aligned(64)]] = double[4 * most_runs + 8];

  SpringBatch(const SpringRun* run, int64_t runs) : run_(run), runs_(runs) {
    for (int64_t k = 0; k < runs_; ++k) springs_ += run_[k].count;
  }
  int64_t springs() const { return springs_; }

  /// Differences d along the springs, and d · d of each.
  void differences(const double* values, Vectors& d, Numbers& squares) const {
    difference(values, d, squares, [](const auto& here, int64_t) { return here; });
  }
  /// Differences d along the springs, and d · other of each.
  void differences(const double* values, Vectors& d, const Vectors& other,
                   Numbers& products) const {
    difference(values, d, products,
               [&]<int n>(const Rows<n>&, int64_t row) { return take<n>(row, other); });
  }
  /// Adds `force(step)` at the second points, and takes it from the first.
  template <class Force>
  void add_forces(Force&& force, double* sums) const {
    for_each_step<widest>(run_, runs_, [&]<int n>(const Step<n, SpringRun>& step) {
      const Rows<n> here = force(step);
      const Ends<n> ends(step);
      scatter<n>({-here.a, -here.b, -here.c}, ends.first, sums);
      scatter<n>(here, ends.second, sums);
    });
  }
  /// s d with a number s of each spring, 0 where a run has no spring.
  template <int n>
  Rows<n> scaled(const Step<n, SpringRun>& step, const Numbers& s, const Vectors& d) const {
    return spread(step.active().only(step.numbers(s))) * take<n>(row(step), d);
  }

 private:
  template <int n>
  struct Ends {
    Firsts<n> first, second;
    explicit Ends(const Step<n, SpringRun>& step) {
      for (int k = 0; k < n; ++k) first[k] = step.run[k].first, second[k] = step.run[k].second;
    }
  };
  template <class Other>
  void difference(const double* values, Vectors& d, Numbers& products, Other&& other) const {
    for_each_step<widest>(run_, runs_, [&]<int n>(const Step<n, SpringRun>& step) {
      const Ends<n> ends(step);
      const Rows<n> here = gather<n>(values, ends.second) - gather<n>(values, ends.first);
      put(here, row(step), d);
      const Lanes<n> product = dot(here, other(here, row(step)));
      int64_t element = step.element;
      for (int k = 0; k < n; element += step.run[k++].count)
        store(part(product, k), products + element);
    });
  }
  template <int n>
  int64_t row(const Step<n, SpringRun>& step) const {
    return step.run - run_;
  }
  template <int n>
  static Rows<n> take(int64_t run, const Vectors& from) {
    const auto& rows = from[run / 2];
    const int64_t half = run % 2 * 4;
    return {load_row<n>(rows[0] + half), load_row<n>(rows[1] + half), load_row<n>(rows[2] + half)};
  }
  template <int n>
  static void put(const Rows<n>& vectors, int64_t run, Vectors& to) {
    auto& rows = to[run / 2];
    const int64_t half = run % 2 * 4;
    store_row(vectors.a, rows[0] + half);
    store_row(vectors.b, rows[1] + half);
    store_row(vectors.c, rows[2] + half);
  }

  const SpringRun* run_;
  int64_t runs_, springs_ = 0;
};

/// Corners of prisms stacked in runs: the lanes are the points of a column, from which those one
/// further down are taken by turning the lanes. The last lane, and any beyond the run, holds what
/// is no prism.
template <int runs>
struct PrismLanes {
  Firsts<runs> top[3];
  Lanes<runs> compliance, target_volume;
  Active<runs> active;

  PrismLanes(const PrismsInRuns& prisms, const Step<runs, PrismRun>& step)
      : compliance(step.numbers(prisms.compliance)),
        target_volume(step.numbers(prisms.target_volume)),
        active(step.active()) {
    for (int c = 0; c < 3; ++c)
      for (int k = 0; k < runs; ++k) top[c][k] = step.run[k].top[c];
  }
  PrismTriples<Lanes<runs>> corners(const double* values) const {
    PrismTriples<Lanes<runs>> x;
    for (int c = 0; c < 3; ++c) {
      x[c] = coordinates(gather<runs>(values, top[c]));
      x[c + 3] = {pick<1, 2, 3, 0>(x[c].x), pick<1, 2, 3, 0>(x[c].y), pick<1, 2, 3, 0>(x[c].z)};
    }
    return x;
  }
  /// Forces are 0 in lanes that are no prism.
  void add(const PrismTriples<Lanes<runs>>& force, double* sums) const {
    for (int c = 0; c < 3; ++c) {
      const Triple<Lanes<runs>>& below = force[c + 3];
      const Triple<Lanes<runs>> turned = {pick<3, 0, 1, 2>(below.x), pick<3, 0, 1, 2>(below.y),
                                          pick<3, 0, 1, 2>(below.z)};
      scatter<runs>(rows(force[c] + turned), top[c], sums);
    }
  }
  /// k of the volume term ½ k (v − t)².
  Lanes<runs> stiffness(const Weights& weights) const {
    if (weights.volume == VolumeTerm::paper) return 2 * weights.volume_weight;
    return weights.volume_weight / compliance;
  }
};

/// ½ Σ w |d|² of the runs' edges, lane by lane; their forces go to `gradient`.
template <int runs>
Lanes<runs> add_edge_force(const Step<runs, SpringRun>& step, const double* weight,
                           const double* position, double scale, double* gradient) {
  Firsts<runs> first, second;
  for (int k = 0; k < runs; ++k) first[k] = step.run[k].first, second[k] = step.run[k].second;
  const Rows<runs> d = gather<runs>(position, second) - gather<runs>(position, first);
  const Rows<runs> force = spread(step.active().only(scale * step.numbers(weight))) * d;
  scatter<runs>({-force.a, -force.b, -force.c}, first, gradient);
  scatter<runs>(force, second, gradient);
  const Rows<runs> energy = force * d;
  return 0.5 * (energy.a + energy.b + energy.c);
}

template <int runs>
Lanes<runs> add_prism_force(const PrismLanes<runs>& prism, const double* position,
                            const Weights& weights, double* gradient) {
  const PrismSlope<Lanes<runs>> v(PrismEdges<Lanes<runs>>(prism.corners(position)));
  const Lanes<runs> change = v.volume - prism.target_volume;
  const Lanes<runs> slope = prism.active.only(prism.stiffness(weights) * change);
  PrismTriples<Lanes<runs>> force;
  for (int c = 0; c < 6; ++c) force[c] = slope * v.gradient[c];
  prism.add(force, gradient);
  return prism.active.only(0.5 * slope * change);
}

template <int runs>
void add_prism_action(const PrismLanes<runs>& prism, const double* position, const Weights& weights,
                      const double* direction, double* product) {
  const PrismEdges<Lanes<runs>> edges(prism.corners(position));
  const PrismTriples<Lanes<runs>> moves = prism.corners(direction);
  const PrismSlope<Lanes<runs>> v(edges);
  const PrismTriples<Lanes<runs>> turned =
      prism_slope_change(edges, PrismEdges<Lanes<runs>>(moves));
  const Lanes<runs> stiffness = prism.active.only(prism.stiffness(weights));
  const Lanes<runs> slope = prism.active.only(stiffness * (v.volume - prism.target_volume));
  Lanes<runs> change = 0;
  for (int c = 0; c < 6; ++c) change = change + v.gradient[c].dot(moves[c]);
  const Lanes<runs> bend = stiffness * change;
  PrismTriples<Lanes<runs>> force;
  for (int c = 0; c < 6; ++c) force[c] = bend * v.gradient[c] + slope * turned[c];
  prism.add(force, product);
}

/// What 4 · runs consecutive springs are, or as many of them as there are.
template <int runs>
struct LawLanes {
  Lanes<runs> stiffness, rest_length, inverse_reference;
  LawLanes(const SpringsInRuns& springs, int64_t first, int64_t there)
      : stiffness(load_row<runs>(springs.stiffness + first, there)),
        rest_length(load_row<runs>(springs.rest_length + first, there)),
        inverse_reference(load_row<runs>(springs.inverse_reference + first, there)) {}
};

/// Calls visit(batch, its first spring).
template <int widest, class Visit>
void for_each_batch(const SpringsInRuns& springs, Visit&& visit) {
  constexpr int64_t most = SpringBatch<widest>::most_runs;
  int64_t first = 0;
  for (int64_t k = 0; k < springs.runs; k += most) {
    const int64_t left = springs.runs - k;
    const SpringBatch<widest> batch(springs.run + k, left < most ? left : most);
    visit(batch, first);
    first += batch.springs();
  }
}

/// The kernels, `widest` runs at once.
template <int widest>
struct LaneKernels {
  using Vectors = typename SpringBatch<widest>::Vectors;
  using Numbers = typename SpringBatch<widest>::Numbers;

  [[gnu::flatten]] static double spring_gradient(const SpringsInRuns& springs,
                                                 const double* position, double scale,
                                                 double* gradient) {
    return with_exponent(springs.exponent, [&]<int p>() {
      Lanes<widest> energy = 0;
      Vectors d;
      Numbers squares, force;
      for_each_batch<widest>(springs, [&](const auto& batch, int64_t first) {
        batch.differences(position, d, squares);
        for (int64_t e = 0; e < batch.springs(); e += 4 * widest) {
          const LawLanes<widest> law(springs, first + e, batch.springs() - e);
          const Root<widest> r(load_row<widest>(squares + e, batch.springs() - e));
          const Lanes<widest> s = r.root - law.rest_length;
          const Lanes<widest> tension =
              scale * spring_tension<p>(s, law.stiffness, law.inverse_reference);
          store_row(tension * r.inverse, force + e);
          energy = energy + spring_energy<p>(s, law.stiffness, law.inverse_reference);
        }
        batch.add_forces([&](const auto& step) { return batch.scaled(step, force, d); }, gradient);
      });
      return energy.sum();
    });
  }
  [[gnu::flatten]] static void spring_action(const SpringsInRuns& springs, const double* position,
                                             double scale, const double* direction,
                                             double* product) {
    with_exponent(springs.exponent, [&]<int p>() {
      Vectors d, w;
      Numbers squares, slants, stretch, across;
      for_each_batch<widest>(springs, [&](const auto& batch, int64_t first) {
        batch.differences(position, d, squares);
        batch.differences(direction, w, d, slants);
        for (int64_t e = 0; e < batch.springs(); e += 4 * widest) {
          const LawLanes<widest> law(springs, first + e, batch.springs() - e);
          const Lanes<widest> square = load_row<widest>(squares + e, batch.springs() - e);
          const Lanes<widest> slant = load_row<widest>(slants + e, batch.springs() - e);
          const Root<widest> r(square);
          const Lanes<widest> s = r.root - law.rest_length;
          const Lanes<widest> along =
              scale * spring_tangent<p>(s, law.stiffness, law.inverse_reference);
          const Lanes<widest> tension =
              scale * spring_tension<p>(s, law.stiffness, law.inverse_reference);
          const Lanes<widest> turn = square.v > 0 ? (tension * r.inverse).v : along.v;
          store_row(turn, across + e);
          store_row((along - turn) * (slant * r.inverse) * r.inverse, stretch + e);
        }
        batch.add_forces(
            [&](const auto& step) {
              return batch.scaled(step, stretch, d) + batch.scaled(step, across, w);
            },
            product);
      });
    });
  }
  [[gnu::flatten]] static double edge_gradient(const EdgesInRuns& edges, const double* position,
                                               double scale, double* gradient) {
    Lanes<widest> energy = 0;
    double rest = 0;
    for_each_step<widest>(edges.run, edges.runs, [&]<int n>(const Step<n, SpringRun>& step) {
      const auto here = add_edge_force<n>(step, edges.weight, position, scale, gradient);
      if constexpr (n == widest)
        energy = energy + here;
      else
        rest += here.sum();
    });
    return energy.sum() + rest;
  }
  [[gnu::flatten]] static double prism_gradient(const PrismsInRuns& prisms, const double* position,
                                                const Weights& weights, double* gradient) {
    Lanes<widest> value = 0;
    double rest = 0;
    for_each_step<widest>(prisms.run, prisms.runs, [&]<int n>(const Step<n, PrismRun>& step) {
      const auto here = add_prism_force(PrismLanes<n>(prisms, step), position, weights, gradient);
      if constexpr (n == widest)
        value = value + here;
      else
        rest += here.sum();
    });
    return value.sum() + rest;
  }
  [[gnu::flatten]] static void prism_action(const PrismsInRuns& prisms, const double* position,
                                            const Weights& weights, const double* direction,
                                            double* product) {
    for_each_step<widest>(prisms.run, prisms.runs, [&]<int n>(const Step<n, PrismRun>& step) {
      add_prism_action(PrismLanes<n>(prisms, step), position, weights, direction, product);
    });
  }
  static constexpr RunKernels table = {spring_gradient, spring_action, edge_gradient,
                                       prism_gradient, prism_action};
};

}  // namespace
}  // namespace repose::mechanics
