#include "repose/discrete/natural_rows.h"

#include <algorithm>

#include "message.h"
#include "repose/base/agreement.h"
#include "repose/base/components.h"
#include "repose/mechanics/prism_volume.h"
#include "repose/mechanics/spring_law.h"
#include "repose/mechanics/stress.h"

namespace repose::discrete {

using base::check;

namespace {

double tension(const model::Springs& springs, int64_t e, double elongation) {
  return mechanics::with_exponent(springs.exponent[e], [&]<int p>() {
    return mechanics::spring_tension<p>(elongation, springs.stiffness[e],
                                        1.0 / springs.reference[e]);
  });
}

const double* numbers(std::span<const Vec3> points) {
  return points.empty() ? nullptr : points.data()->data();
}

}  // namespace

void NaturalRows::scatter_chunk(const Rows& rows, const double* owned_values,
                                const double* natural_values, ScatterMode mode) const {
  const auto count = static_cast<PetscInt>(rows.row.size());
  const auto slab = base::slab(rows.total, base::rank(comm_), base::size(comm_));
  const auto mine = static_cast<PetscInt>(slab.rows());
  base::VecHandle owned, natural;
  check(VecCreateMPIWithArray(comm_, 1, rows.block * count, PETSC_DETERMINE, owned_values,
                              owned.out()));
  check(VecCreateMPIWithArray(comm_, 1, rows.block * mine, PETSC_DETERMINE, natural_values,
                              natural.out()));
  PetscInt first = 0;
  check(VecGetOwnershipRange(owned, &first, nullptr));
  const std::vector<PetscInt> targets(rows.row.begin(), rows.row.end());
  base::IndexSetHandle from, to;
  check(ISCreateStride(comm_, rows.block * count, first, 1, from.out()));
  check(ISCreateBlock(comm_, rows.block, count, targets.data(), PETSC_COPY_VALUES, to.out()));
  base::ScatterHandle scatter;
  check(VecScatterCreate(owned, from, natural, to, scatter.out()));
  const bool forward = mode == SCATTER_FORWARD;
  const Vec source = forward ? owned : natural, target = forward ? natural : owned;
  check(VecScatterBegin(scatter, source, target, INSERT_VALUES, mode));
  check(VecScatterEnd(scatter, source, target, INSERT_VALUES, mode));
}

void NaturalRows::scatter_rows(const Rows& rows, const double* owned, const double* natural,
                               ScatterMode mode) const {
  const auto size = static_cast<int64_t>(rows.row.size());
  int64_t longest = 0;
  MPI_Allreduce(&size, &longest, 1, MPI_INT64_T, MPI_MAX, comm_);
  for (int64_t begin = 0; begin < longest; begin += at_once_) {
    const int64_t first = std::min(begin, size), count = std::min(at_once_, size - first);
    scatter_chunk({rows.row.subspan(first, count), rows.total, rows.block},
                  owned + first * rows.block, natural, mode);
  }
}

NaturalRows::NaturalRows(MPI_Comm comm, const Part& part, int64_t at_once)
    : comm_(comm),
      part_(part),
      at_once_(at_once),
      points_{std::span(part.point_row).first(part.owned_points), part.total_points, 3},
      springs_{part.spring_row, part.total_springs, 1},
      prisms_{part.prism_row, part.total_prisms, 1} {}

std::vector<double> NaturalRows::to_slab(const Rows& rows, const std::vector<double>& owned) const {
  const base::Slab slab = base::slab(rows.total, base::rank(comm_), base::size(comm_));
  std::vector<double> natural(slab.rows());
  scatter_rows(rows, owned.data(), natural.data(), SCATTER_FORWARD);
  return natural;
}

template <class Value>
std::vector<Value> NaturalRows::to_slab_each(const Rows& rows,
                                             const std::vector<Value>& values) const {
  constexpr int numbers = base::components<Value>;
  const base::Slab slab = base::slab(rows.total, base::rank(comm_), base::size(comm_));
  std::vector<double> owned(rows.row.size() * numbers), natural(slab.rows() * numbers);
  std::vector<Value> mine(slab.rows());
  const auto at = [](auto& value, int k) -> auto& {
    if constexpr (numbers == 1)
      return value;
    else
      return value[k];
  };
  for (size_t i = 0; i < rows.row.size(); ++i)
    for (int k = 0; k < numbers; ++k)
      owned[numbers * i + k] = static_cast<double>(at(values[i], k));
  scatter_rows({rows.row, rows.total, numbers}, owned.data(), natural.data(), SCATTER_FORWARD);
  for (size_t i = 0; i < mine.size(); ++i)
    for (int k = 0; k < numbers; ++k) {
      auto& number = at(mine[i], k);
      number = static_cast<std::decay_t<decltype(number)>>(natural[numbers * i + k]);
    }
  return mine;
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

}  // namespace

model::ModelRows NaturalRows::of_model(MPI_Comm comm, const LocalModel& local_model) {
  const Part& part = local_model.part;
  const NaturalRows natural(comm, part);
  model::ModelRows rows;
  rows.counts = local_model.counts;
  rows.solid = part.solid;
  rows.contact_pairs = local_model.contact_pairs;
  const auto to_slabs = [&](const Rows& of, auto group) {
    model::for_each_array(
        group, [&](const char*, auto& values) { values = natural.to_slab_each(of, values); });
    return group;
  };
  model::Points points = part.model.points;
  points.set = part.original_set;
  rows.points = to_slabs(natural.points_, std::move(points));
  rows.outward = local_model.outward;
  model::Springs springs = part.model.springs;
  springs.points = in_rows(springs.points, part.owned_springs, part.point_row);
  rows.springs = to_slabs(natural.springs_, std::move(springs));
  model::Prisms prisms = part.model.prisms;
  prisms.points = in_rows(prisms.points, part.owned_prisms, part.point_row);
  // A rank without prisms takes part in all that others have: arrays of no row are not visited.
  int averaged = !prisms.nodal_modulus.empty();
  MPI_Allreduce(MPI_IN_PLACE, &averaged, 1, MPI_INT, MPI_MAX, comm);
  if (part.solid && prisms.modulus.empty()) prisms.modulus.resize(1);
  if (averaged != 0 && prisms.nodal_modulus.empty()) prisms.nodal_modulus.resize(1);
  rows.prisms = to_slabs(natural.prisms_, std::move(prisms));
  model::Edges edges = part.model.edges;
  edges.points = in_rows(edges.points, part.owned_edges, part.point_row);
  rows.edges = to_slabs({part.edge_row, local_model.counts.edges, 1}, std::move(edges));
  model::ContactPairs pairs = part.model.contact.pairs;
  pairs.point = base::pick(part.point_row, pairs.point);
  pairs.offset.clear();
  rows.pairs = to_slabs({part.pair_row, local_model.contact_pairs, 1}, std::move(pairs));
  return rows;
}

void NaturalRows::add_springs(std::span<const Vec3> position, model::StepRows& rows) const {
  const model::Springs& springs = part_.model.springs;
  std::vector<double> values(part_.owned_springs);
  for (int64_t e = 0; e < part_.owned_springs; ++e) {
    const auto& [p, q] = springs.points[e];
    values[e] = (position[q] - position[p]).norm() - springs.rest_length[e];
  }
  rows.elongation = to_slab(springs_, values);
  for (int64_t e = 0; e < part_.owned_springs; ++e) values[e] = tension(springs, e, values[e]);
  rows.tension = to_slab(springs_, values);
}

void NaturalRows::add_prisms(std::span<const Vec3> position, model::StepRows& rows) const {
  const model::Prisms& prisms = part_.model.prisms;
  std::vector<double> ratio(part_.owned_prisms);
  for (int64_t e = 0; e < part_.owned_prisms; ++e) {
    std::array<Vec3, 6> corners;
    for (int c = 0; c < 6; ++c) corners[c] = position[prisms.points[e][c]];
    ratio[e] = mechanics::prism_volume(corners.data()) / prisms.rest_volume[e];
  }
  rows.volume_ratio = to_slab(prisms_, ratio);
}

void NaturalRows::add_stress(std::span<const Vec3> position, model::StepRows& rows) const {
  const model::Prisms& prisms = part_.model.prisms;
  const std::vector<double> slopes = mechanics::volume_slopes(part_.model, position);
  std::vector<double> pressure(part_.owned_prisms), von_mises(part_.owned_prisms);
  std::vector<Vec3> stretch(part_.owned_prisms);
  for (int64_t e = 0; e < part_.owned_prisms; ++e) {
    std::array<Vec3, 6> before, now;
    for (int c = 0; c < 6; ++c) {
      before[c] = part_.model.points.position[prisms.points[e][c]];
      now[c] = position[prisms.points[e][c]];
    }
    const mechanics::PrismState state =
        mechanics::prism_state(prisms.shear_modulus[e], slopes[e], before, now);
    pressure[e] = state.pressure;
    von_mises[e] = state.von_mises;
    stretch[e] = state.stretch;
  }
  rows.pressure = to_slab(prisms_, pressure);
  rows.von_mises = to_slab(prisms_, von_mises);
  const base::Slab slab = base::slab(prisms_.total, base::rank(comm_), base::size(comm_));
  rows.stretch.resize(slab.rows());
  scatter_rows({prisms_.row, prisms_.total, 3}, numbers(stretch), numbers(rows.stretch),
               SCATTER_FORWARD);
}

void NaturalRows::add_contact(Objective& objective, model::StepRows& rows) const {
  const Rows points{points_.row, points_.total, 1};
  const ContactState state = contact_state(objective);
  rows.point_fields.push_back({"contact_gap", false, to_slab(points, state.gap)});
  rows.point_fields.push_back({"contact_pressure", false, to_slab(points, state.pressure)});
  rows.point_fields.push_back(field("contact_force", state.force));
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
  const base::Slab slab = base::slab(points_.total, base::rank(comm_), base::size(comm_));
  std::vector<Vec3> rows(slab.rows());
  scatter_rows(points_, numbers(values), numbers(rows), SCATTER_FORWARD);
  return rows;
}

model::PointField NaturalRows::field(const std::string& name, std::span<const Vec3> values) const {
  const std::vector<Vec3> rows = natural(values);
  const double* first = numbers(rows);
  return {name, true, {first, first + 3 * rows.size()}};
}

std::vector<Vec3> NaturalRows::owned(const std::vector<Vec3>& slab) const {
  std::vector<Vec3> rows(part_.owned_points);
  scatter_rows(points_, numbers(rows), numbers(slab), SCATTER_REVERSE);
  return rows;
}

std::vector<double> NaturalRows::at_rows(const std::vector<int64_t>& rows, int64_t total,
                                         const std::vector<double>& slab) const {
  std::vector<double> values(rows.size());
  scatter_rows({rows, total, 1}, values.data(), slab.data(), SCATTER_REVERSE);
  return values;
}

void NaturalRows::set_unknowns(const std::vector<Vec3>& slab, const Positions& positions,
                               Vec displacement) const {
  std::vector<Vec3> rows = owned(slab);
  for (size_t i = 0; i < rows.size(); ++i) rows[i] -= part_.model.points.position[i];
  positions.restrict_to_owned(rows, displacement);
}

namespace {

/// Joins the slabs of all ranks on rank 0. The first ranks are those that have rows.
template <class Group>
void join_slabs(MPI_Comm comm, int64_t rows, Group& slabs) {
  const int ranks = base::size(comm), rank = base::rank(comm);
  const auto has_rows = [&](int of) { return base::slab(rows, of, ranks).rows() > 0; };
  if (!has_rows(rank)) return;
  model::for_each_array(slabs, [&](const char*, auto& array) {
    if (rank > 0) return Sender(comm, 0)(array);
    for (int from = 1; from < ranks && has_rows(from); ++from) {
      std::decay_t<decltype(array)> theirs;
      Receiver(comm, from)(theirs);
      array.insert(array.end(), theirs.begin(), theirs.end());
    }
  });
}

}  // namespace

model::Model gather_model(MPI_Comm comm, const LocalModel& local_model) {
  model::ModelRows rows = NaturalRows::of_model(comm, local_model);
  join_slabs(comm, rows.counts.points, rows.points);
  join_slabs(comm, rows.counts.springs, rows.springs);
  join_slabs(comm, rows.counts.prisms, rows.prisms);
  join_slabs(comm, rows.counts.edges, rows.edges);
  join_slabs(comm, rows.contact_pairs, rows.pairs);
  model::Model whole = local_model.global_metadata;
  if (base::rank(comm) > 0) return whole;
  whole.points = std::move(rows.points);
  whole.springs = std::move(rows.springs);
  whole.prisms = std::move(rows.prisms);
  whole.edges = std::move(rows.edges);
  whole.contact.pairs = std::move(rows.pairs);
  return whole;
}

}  // namespace repose::discrete
