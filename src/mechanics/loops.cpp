#include "repose/mechanics/loops.h"

#include <algorithm>

namespace repose::mechanics {

namespace {

/// Rows of elements of a part that a loop evaluates.
struct Chosen {
  std::vector<int64_t> counted, others;
};

/// Those that touch soft tissue, or those that do not, in the order of their points in memory.
template <size_t n, class Request>
Chosen choose(const model::Model& part, const std::vector<std::array<int64_t, n>>& elements,
              int64_t owned, Request&& requested, bool soft = true) {
  Chosen chosen;
  for (int64_t e = 0; e < std::ssize(elements); ++e)
    if (requested(e) && model::touches_soft_tissue(part.points, elements[e]) == soft)
      (e < owned ? chosen.counted : chosen.others).push_back(e);
  const auto first = [&](int64_t e) { return *std::ranges::min_element(elements[e]); };
  std::ranges::stable_sort(chosen.counted, {}, first);
  std::ranges::stable_sort(chosen.others, {}, first);
  return chosen;
}

/// Appends the rows to the loop's points; calls add(row).
template <class Loop, size_t n, class Add>
void append(const std::vector<std::array<int64_t, n>>& elements, const Chosen& chosen, Loop& loop,
            Add&& add) {
  loop.counted = std::ssize(chosen.counted);
  for (const auto* rows : {&chosen.counted, &chosen.others})
    for (const int64_t row : *rows) {
      std::copy_n(elements[row].begin(), n, loop.points.emplace_back().begin());
      add(row);
    }
}

SpringLoop make_spring_loop(const model::Model& part, int exponent, int64_t owned) {
  SpringLoop loop;
  loop.exponent = exponent;
  const model::Springs& springs = part.springs;
  const Chosen chosen = choose(part, springs.points, owned,
                               [&](int64_t e) { return springs.exponent[e] == exponent; });
  const size_t size = chosen.counted.size() + chosen.others.size();
  loop.points.reserve(size);
  for (auto* values : {&loop.stiffness, &loop.rest_length, &loop.inverse_reference})
    values->reserve(size);
  const auto add = [&](int64_t row) {
    loop.stiffness.push_back(springs.stiffness[row]);
    loop.rest_length.push_back(springs.rest_length[row]);
    loop.inverse_reference.push_back(1.0 / springs.reference[row]);
  };
  append(springs.points, chosen, loop, add);
  return loop;
}

EdgeLoop make_edge_loop(const model::Model& part, int64_t owned, bool soft) {
  EdgeLoop loop;
  const model::Edges& edges = part.edges;
  const Chosen chosen = choose(
      part, edges.points, owned, [](int64_t) { return true; }, soft);
  const size_t size = chosen.counted.size() + chosen.others.size();
  loop.points.reserve(size);
  loop.weight.reserve(size);
  const auto add = [&](int64_t row) { loop.weight.push_back(edges.weight[row]); };
  append(edges.points, chosen, loop, add);
  for (auto& [first, second] : loop.points)
    if (first > second) std::swap(first, second);
  return loop;
}

void set_material(const model::Prisms& prisms, PrismLoop& loop) {
  loop.shear_modulus.clear();
  loop.nodal_modulus.clear();
  for (size_t e = 0; e < loop.row.size(); ++e) {
    const int64_t row = loop.row[e];
    const double averaged = prisms.nodal_modulus.empty() ? 0 : prisms.nodal_modulus[row];
    loop.compliance[e] = loop.rest_volume[e] / (prisms.modulus[row] - averaged);
    loop.target_volume[e] = own_target_volume(prisms, row);
    loop.shear_modulus.push_back(prisms.shear_modulus[row]);
    if (averaged > 0) loop.nodal_modulus.push_back(averaged);
  }
}

/// λ of a prism, N/mm².
double bulk_of(const model::Prisms& prisms, int64_t row) {
  return prisms.nodal_modulus.empty() ? prisms.modulus[row] - prisms.shear_modulus[row]
                                      : prisms.nodal_modulus[row];
}

PrismLoop make_prism_loop(const model::Model& part, int64_t owned, bool soft) {
  PrismLoop loop;
  const model::Prisms& prisms = part.prisms;
  const Chosen chosen = choose(
      part, prisms.points, owned, [](int64_t) { return true; }, soft);
  const size_t size = chosen.counted.size() + chosen.others.size();
  loop.points.reserve(size);
  loop.rest_volume.reserve(size);
  loop.row.reserve(size);
  const auto add = [&](int64_t row) {
    loop.rest_volume.push_back(prisms.rest_volume[row]);
    loop.row.push_back(row);
  };
  append(prisms.points, chosen, loop, add);
  loop.target_volume = loop.rest_volume;
  loop.compliance = loop.rest_volume;
  if (model::is_solid(part)) set_material(prisms, loop);
  return loop;
}

}  // namespace

void limit_bulk(const model::Model& part, double max_bulk, Loops& loops) {
  const model::Prisms& prisms = part.prisms;
  PrismLoop& loop = loops.prisms;
  if (loop.shear_modulus.empty()) return;
  set_material(prisms, loop);
  for (size_t e = 0; e < loop.row.size(); ++e) {
    const double maximum = max_bulk * loop.shear_modulus[e];
    const double over = bulk_of(prisms, loop.row[e]) - maximum;
    if (!(over > 0)) continue;
    if (!loop.nodal_modulus.empty()) {
      loop.nodal_modulus[e] = maximum;
      continue;
    }
    const double v0 = loop.rest_volume[e], modulus = v0 / loop.compliance[e];
    loop.compliance[e] = v0 / (modulus - over);
    loop.target_volume[e] = v0 + (loop.target_volume[e] - v0) * modulus / (modulus - over);
  }
  if (!loops.nodal.empty()) loops.nodal.stiffness = nodal_stiffness(part, max_bulk);
}

double largest_bulk(const model::Model& part, const PrismLoop& loop) {
  double largest = 0;
  if (loop.shear_modulus.empty()) return largest;
  for (const int64_t row : loop.row)
    largest = std::max(largest, bulk_of(part.prisms, row) / part.prisms.shear_modulus[row]);
  return largest;
}

Loops make_loops(const model::Model& part, int64_t owned_springs, int64_t owned_prisms,
                 int64_t owned_edges, int64_t owned_points) {
  Loops loops;
  for (int exponent = 0; exponent <= 2; ++exponent) {
    SpringLoop loop = make_spring_loop(part, exponent, owned_springs);
    if (loop.size() > 0) loops.springs.push_back(std::move(loop));
  }
  loops.edges = make_edge_loop(part, owned_edges, true);
  loops.prisms = make_prism_loop(part, owned_prisms, true);
  if (model::is_solid(part)) {
    loops.fixed_edges = make_edge_loop(part, owned_edges, false);
    loops.fixed_prisms = make_prism_loop(part, owned_prisms, false);
  }
  loops.nodal = make_nodal_volumes(part, owned_points, owned_prisms);
  for (const model::TermElements& elements : part.elements)
    loops.terms.emplace_back(elements, part.points, owned_points);
  return loops;
}

}  // namespace repose::mechanics
