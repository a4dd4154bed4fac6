#include "repose/solve/reaction.h"

#include <algorithm>
#include <map>

#include "repose/base/agreement.h"
#include "repose/discrete/natural_rows.h"
#include "repose/mechanics/nodal_volumes.h"
#include "repose/mechanics/prism_volume.h"
#include "repose/mechanics/spring_law.h"

namespace repose::solve {

using model::VolumeTerm;

namespace {

/// Sums forces on points by the group that they belong to.
class Groups {
 public:
  /// `group` [local points] is −1 for none.
  Groups(std::vector<int64_t> group, size_t groups)
      : group_(std::move(group)), force_(groups, Vec3::Zero()) {}

  template <size_t K>
  bool touch(const std::array<int64_t, K>& points) const {
    return std::any_of(points.begin(), points.end(), [&](int64_t i) { return group_[i] >= 0; });
  }
  void add(int64_t point, const Vec3& force) {
    if (group_[point] >= 0) force_[group_[point]] += force;
  }
  /// Adds what all ranks have. Collective.
  std::vector<Vec3> sum(MPI_Comm comm) {
    MPI_Allreduce(MPI_IN_PLACE, force_.data(), static_cast<int>(3 * force_.size()), MPI_DOUBLE,
                  MPI_SUM, comm);
    return std::move(force_);
  }

 private:
  std::vector<int64_t> group_;
  std::vector<Vec3> force_;  // [groups]
};

/// [local points] the group of each, −1 for none. `groups` are read on rank 0. Collective.
std::vector<int64_t> group_of_points(MPI_Comm comm, const discrete::Part& part,
                                     const std::vector<std::vector<int64_t>>& groups,
                                     int64_t count) {
  std::map<int64_t, int64_t> group_of;  // of rows in the whole model
  for (int64_t k = 0; k < count; ++k) {
    std::vector<int64_t> rows;
    if (base::rank(comm) == 0) rows = groups[k];
    base::broadcast(comm, rows);
    for (const int64_t row : rows) group_of[row] = k;
  }
  std::vector<int64_t> group;
  for (const int64_t row : part.point_row) {
    const auto found = group_of.find(row);
    group.push_back(found == group_of.end() ? -1 : found->second);
  }
  return group;
}

void add_springs(const discrete::Part& part, std::span<const Vec3> x, double weight,
                 Groups& groups) {
  const model::Springs& s = part.model.springs;
  for (int64_t j = 0; j < part.owned_springs; ++j) {
    if (!groups.touch(s.points[j])) continue;
    const auto [p, q] = s.points[j];
    const Vec3 d = x[q] - x[p];
    if (d.norm() == 0) continue;
    const double tension = mechanics::with_exponent(s.exponent[j], [&]<int e>() {
      return mechanics::spring_tension<e>(d.norm() - s.rest_length[j], s.stiffness[j],
                                          1 / s.reference[j]);
    });
    const Vec3 force = weight * tension * d.normalized();
    groups.add(p, force);
    groups.add(q, -force);
  }
}

void add_edges(const discrete::Part& part, std::span<const Vec3> x, Groups& groups) {
  const model::Edges& edges = part.model.edges;
  for (int64_t j = 0; j < part.owned_edges; ++j) {
    if (!groups.touch(edges.points[j])) continue;
    const auto [p, q] = edges.points[j];
    const Vec3 force = edges.weight[j] * (x[q] - x[p]);
    groups.add(p, force);
    groups.add(q, -force);
  }
}

/// Φ_v'(v) of a prism of springs.
double slope(const model::StepNumbers& n, double change, double rest) {
  return n.volume == VolumeTerm::paper ? 2 * (1 - n.lambda) * change
                                       : n.bulk_modulus * change / rest;
}

void add_prisms(const discrete::Part& part, std::span<const Vec3> x, const model::StepNumbers& n,
                Groups& groups) {
  const model::Prisms& prisms = part.model.prisms;
  std::vector<double> of_solid;
  if (part.solid) of_solid = mechanics::volume_slopes(part.model, x);
  for (int64_t m = 0; m < part.owned_prisms; ++m) {
    if (!groups.touch(prisms.points[m])) continue;
    const mechanics::PrismSlope v(
        mechanics::PrismEdges<double>(mechanics::triples(base::pick(x, prisms.points[m]))));
    const double by = part.solid
                          ? of_solid[m]
                          : slope(n, v.volume - prisms.rest_volume[m], prisms.rest_volume[m]);
    for (int c = 0; c < 6; ++c)
      groups.add(prisms.points[m][c], -by * mechanics::vec3(v.gradient[c]));
  }
}

}  // namespace

std::vector<Vec3> reactions(MPI_Comm comm, const discrete::Part& part,
                            const std::vector<std::vector<int64_t>>& held,
                            const model::StepNumbers& numbers, const std::vector<Vec3>& position) {
  auto requested = static_cast<int64_t>(held.size());
  base::broadcast(comm, requested);
  if (requested == 0) return {};
  discrete::Positions positions(comm, part);
  const base::VecHandle displacement = positions.make_vector();
  discrete::NaturalRows(comm, part).set_unknowns(position, positions, displacement);
  positions.set_load(numbers.load);
  positions.update(displacement);
  Groups groups(group_of_points(comm, part, held, requested), requested);
  const bool energy = numbers.functional == model::Functional::energy;
  add_springs(part, positions.local(),
              energy && numbers.volume == VolumeTerm::paper ? numbers.lambda : 1, groups);
  add_edges(part, positions.local(), groups);
  if (energy && numbers.volume != VolumeTerm::none)
    add_prisms(part, positions.local(), numbers, groups);
  return groups.sum(comm);
}

}  // namespace repose::solve
