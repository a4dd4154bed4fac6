#include "repose/discrete/natural_rows.h"

#include <algorithm>
#include <utility>

#include "exchange.h"
#include "repose/base/agreement.h"
#include "repose/mechanics/prism_volume.h"
#include "repose/mechanics/spring_law.h"
#include "repose/mechanics/stress.h"

namespace repose::discrete {

namespace {

double tension(const model::Springs& springs, int64_t e, double elongation) {
  return mechanics::with_exponent(springs.exponent[e], [&]<int p>() {
    return mechanics::spring_tension<p>(elongation, springs.stiffness[e],
                                        1.0 / springs.reference[e]);
  });
}

}  // namespace

template <class Work>
void NaturalRows::for_each_chunk(const Rows& rows, const Work& work) const {
  const int ranks = base::size(comm_);
  std::vector<int64_t> end;
  for (int r = 0; r < ranks; ++r) end.push_back(slab(rows.total, r).end);
  const auto size = static_cast<int64_t>(rows.row.size());
  const int64_t longest = base::max_over_ranks(comm_, size);
  for (int64_t begin = 0; begin < longest; begin += at_once_) {
    std::vector<std::vector<int64_t>> places(ranks);
    for (int64_t i = begin; i < std::min(begin + at_once_, size); ++i)
      places[std::ranges::upper_bound(end, rows.row[i]) - end.begin()].push_back(i);
    work(places);
  }
}

base::Slab NaturalRows::slab(int64_t total, int rank) const {
  if (holders_ == Holders::slabs) return base::slab(total, rank, base::size(comm_));
  return {rank == 0 ? 0 : total, total};
}

NaturalRows::NaturalRows(MPI_Comm comm, const Part& part, Holders holders, int64_t at_once)
    : comm_(comm),
      part_(part),
      holders_(holders),
      at_once_(at_once),
      points_{std::span(part.point_row).first(part.owned_points), part.total_points},
      springs_{part.spring_row, part.total_springs},
      prisms_{part.prism_row, part.total_prisms} {}

template <class Value>
std::vector<Value> NaturalRows::to_slab(const Rows& rows, std::span<const Value> owned) const {
  const base::Slab mine = slab(rows.total, base::rank(comm_));
  std::vector<Value> natural(mine.rows());
  for_each_chunk(rows, [&](const std::vector<std::vector<int64_t>>& places) {
    const Exchange exchange(comm_, places);
    const std::vector<int64_t> row = exchange(rows.row);
    const std::vector<Value> values = exchange(owned);
    for (size_t k = 0; k < row.size(); ++k) natural[row[k] - mine.begin] = values[k];
  });
  return natural;
}

template <class Value>
std::vector<Value> NaturalRows::from_slab(const Rows& rows, const std::vector<Value>& slab) const {
  std::vector<Value> values(rows.row.size());
  for_each_chunk(rows, [&](const std::vector<std::vector<int64_t>>& places) {
    std::vector<int64_t> place, row;
    for (const std::vector<int64_t>& of_rank : places)
      for (const int64_t i : of_rank) place.push_back(i), row.push_back(rows.row[i]);
    const auto held = static_cast<int64_t>(slab.size());
    const std::vector<Value> fetched = Exchange::fetch(comm_, row, held)(slab);
    for (size_t k = 0; k < place.size(); ++k) values[place[k]] = fetched[k];
  });
  return values;
}

namespace {

/// Elements in the whole model's rows of points.
template <size_t n>
std::vector<std::array<int64_t, n>> in_rows(const std::vector<std::array<int64_t, n>>& elements,
                                            int64_t owned, const std::vector<int64_t>& row) {
  std::vector<std::array<int64_t, n>> whole(elements.begin(), elements.begin() + owned);
  for (auto& element : whole)
    for (int64_t& point : element) point = row[point];
  return whole;
}

/// The owned prisms with the rows of their points. Collective.
model::Prisms prisms_in_rows(MPI_Comm comm, const Part& part) {
  model::Prisms prisms = part.model.prisms;
  prisms.points = in_rows(prisms.points, part.owned_prisms, part.point_row);
  // A rank without prisms takes part in all that others have: arrays of no row are not visited.
  const bool averaged = base::on_any_rank(comm, !prisms.nodal_modulus.empty());
  if (part.solid && prisms.modulus.empty()) prisms.modulus.resize(1);
  if (averaged && prisms.nodal_modulus.empty()) prisms.nodal_modulus.resize(1);
  return prisms;
}

}  // namespace

model::ModelRows NaturalRows::of_model(MPI_Comm comm, const LocalModel& local_model,
                                       Holders holders) {
  const Part& part = local_model.part;
  const NaturalRows natural(comm, part, holders);
  model::ModelRows rows;
  rows.counts = local_model.counts;
  rows.solid = part.solid;
  rows.contact_pairs = local_model.contact_pairs;
  const auto to_slabs = [&](const Rows& of, auto group) {
    model::for_each_array(group, [&](const char*, auto& values) {
      values = natural.to_slab(of, std::span(std::as_const(values)));
    });
    return group;
  };
  model::Points points = part.model.points;
  points.set = part.original_set;
  rows.points = to_slabs(natural.points_, std::move(points));
  rows.outward = local_model.outward;
  model::Springs springs = part.model.springs;
  springs.points = in_rows(springs.points, part.owned_springs, part.point_row);
  rows.springs = to_slabs(natural.springs_, std::move(springs));
  rows.prisms = to_slabs(natural.prisms_, prisms_in_rows(comm, part));
  model::Edges edges = part.model.edges;
  edges.points = in_rows(edges.points, part.owned_edges, part.point_row);
  rows.edges = to_slabs({part.edge_row, local_model.counts.edges}, std::move(edges));
  model::ContactPairs pairs = part.model.contact.pairs;
  pairs.point = base::pick(part.point_row, pairs.point);
  pairs.offset.clear();
  rows.pairs = to_slabs({part.pair_row, local_model.contact_pairs}, std::move(pairs));
  return rows;
}

void NaturalRows::add_springs(std::span<const Vec3> position, model::StepRows& rows) const {
  const model::Springs& springs = part_.model.springs;
  std::vector<double> values(part_.owned_springs);
  for (int64_t e = 0; e < part_.owned_springs; ++e) {
    const auto& [p, q] = springs.points[e];
    values[e] = (position[q] - position[p]).norm() - springs.rest_length[e];
  }
  rows.elongation = to_slab<double>(springs_, values);
  for (int64_t e = 0; e < part_.owned_springs; ++e) values[e] = tension(springs, e, values[e]);
  rows.tension = to_slab<double>(springs_, values);
}

void NaturalRows::add_prisms(std::span<const Vec3> position, model::StepRows& rows) const {
  const model::Prisms& prisms = part_.model.prisms;
  std::vector<double> ratio(part_.owned_prisms);
  for (int64_t e = 0; e < part_.owned_prisms; ++e)
    ratio[e] = mechanics::prism_volume(base::pick(position, prisms.points[e]).data()) /
               prisms.rest_volume[e];
  rows.volume_ratio = to_slab<double>(prisms_, ratio);
}

void NaturalRows::add_stress(std::span<const Vec3> position, model::StepRows& rows) const {
  const model::Prisms& prisms = part_.model.prisms;
  const std::vector<double> slopes = mechanics::volume_slopes(part_.model, position);
  std::vector<double> pressure(part_.owned_prisms), von_mises(part_.owned_prisms);
  std::vector<Vec3> stretch(part_.owned_prisms);
  for (int64_t e = 0; e < part_.owned_prisms; ++e) {
    const mechanics::PrismState state =
        mechanics::prism_state(prisms.shear_modulus[e], slopes[e],
                               base::pick(part_.model.points.position, prisms.points[e]),
                               base::pick(position, prisms.points[e]));
    pressure[e] = state.pressure;
    von_mises[e] = state.von_mises;
    stretch[e] = state.stretch;
  }
  rows.pressure = to_slab<double>(prisms_, pressure);
  rows.von_mises = to_slab<double>(prisms_, von_mises);
  rows.stretch = to_slab<Vec3>(prisms_, stretch);
}

void NaturalRows::add_contact(Objective& objective, model::StepRows& rows) const {
  constexpr double farthest = 6;  // mm, of gaps that are found
  const std::vector<Vec3> force = objective.contact_force();
  std::vector<double> least_gap(force.size(), farthest), sum(force.size(), 0.0);
  const auto add = [&](int64_t point, double gap, double pressure) {
    least_gap[point] = std::min(least_gap[point], gap);
    sum[point] += pressure;
  };
  mechanics::BodyContact& bodies = objective.contact().bodies();
  bodies.update_all_gaps(objective.positions().local());
  for (size_t c = 0; c < bodies.gaps().size(); ++c)
    add(bodies.pairs().point[c], bodies.gaps()[c], bodies.pressure(c));
  mechanics::CutFaceContact& cut_faces = objective.contact().cut_faces();
  cut_faces.update_gaps(objective.positions().local());
  for (size_t w = 0; w < cut_faces.size(); ++w)
    add(cut_faces.point(w), cut_faces.gap(w), cut_faces.pressure(w));
  rows.point_fields.push_back({"contact_gap", false, to_slab<double>(points_, least_gap)});
  rows.point_fields.push_back({"contact_pressure", false, to_slab<double>(points_, sum)});
  rows.point_fields.push_back(field("contact_force", force));
}

model::StepRows NaturalRows::rows(Objective& objective) const {
  const auto position = objective.positions().local();
  model::StepRows rows;
  rows.position = natural(position);
  rows.residual_force = natural(objective.residual_force());
  add_prisms(position, rows);
  add_springs(position, rows);
  if (part_.solid) add_stress(position, rows);
  if (part_.contact) add_contact(objective, rows);
  return rows;
}

std::vector<Vec3> NaturalRows::natural(std::span<const Vec3> values) const {
  return to_slab(points_, values);
}

model::PointField NaturalRows::field(const std::string& name, std::span<const Vec3> values) const {
  model::PointField field{name, true, {}};
  for (const Vec3& value : natural(values))
    field.values.insert(field.values.end(), value.begin(), value.end());
  return field;
}

std::vector<Vec3> NaturalRows::owned(const std::vector<Vec3>& slab) const {
  return from_slab(points_, slab);
}

std::vector<double> NaturalRows::owned(const std::vector<double>& slab) const {
  return from_slab(points_, slab);
}

std::vector<double> NaturalRows::at_rows(const std::vector<int64_t>& rows, int64_t total,
                                         const std::vector<double>& slab) const {
  return from_slab({rows, total}, slab);
}

void NaturalRows::set_unknowns(const std::vector<Vec3>& slab, const Positions& positions,
                               Vec displacement) const {
  std::vector<Vec3> rows = owned(slab);
  for (size_t i = 0; i < rows.size(); ++i) rows[i] -= part_.model.points.position[i];
  positions.restrict_to_owned(rows, displacement);
}

model::Model gather_model(MPI_Comm comm, const LocalModel& local_model) {
  model::ModelRows rows = NaturalRows::of_model(comm, local_model, NaturalRows::Holders::root);
  model::Model whole = local_model.global_metadata;
  whole.points = std::move(rows.points);
  whole.springs = std::move(rows.springs);
  whole.prisms = std::move(rows.prisms);
  whole.edges = std::move(rows.edges);
  whole.contact.pairs = std::move(rows.pairs);
  return whole;
}

}  // namespace repose::discrete
