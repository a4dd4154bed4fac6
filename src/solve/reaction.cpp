#include "repose/solve/reaction.h"

#include <algorithm>

#include "repose/base/agreement.h"
#include "repose/discrete/gather.h"
#include "repose/mechanics/nodal_volumes.h"
#include "repose/mechanics/prism_volume.h"
#include "repose/mechanics/spring_law.h"

namespace repose::solve {

using model::VolumeTerm;

namespace {

/// Sums forces on points by the group that they belong to.
class Groups {
 public:
  Groups(size_t points, const std::vector<std::vector<int64_t>>& groups)
      : group_(points, -1), force_(groups.size(), Vec3::Zero()) {
    for (size_t k = 0; k < groups.size(); ++k)
      for (const int64_t point : groups[k]) group_[point] = static_cast<int64_t>(k);
  }

  template <size_t K>
  bool touch(const std::array<int64_t, K>& points) const {
    return std::any_of(points.begin(), points.end(), [&](int64_t i) { return group_[i] >= 0; });
  }
  void add(int64_t point, const Vec3& force) {
    if (group_[point] >= 0) force_[group_[point]] += force;
  }
  const std::vector<Vec3>& forces() const { return force_; }

 private:
  std::vector<int64_t> group_;  // [N] or −1
  std::vector<Vec3> force_;     // [groups]
};

void add_springs(const model::Model& model, const std::vector<double>& x, double weight,
                 Groups& groups) {
  const model::Springs& s = model.springs;
  for (size_t j = 0; j < s.points.size(); ++j) {
    if (!groups.touch(s.points[j])) continue;
    const auto [p, q] = s.points[j];
    const Vec3 d = Vec3::Map(&x[3 * q]) - Vec3::Map(&x[3 * p]);
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

void add_edges(const model::Model& model, const std::vector<double>& x, Groups& groups) {
  const model::Edges& edges = model.edges;
  for (size_t j = 0; j < edges.points.size(); ++j) {
    if (!groups.touch(edges.points[j])) continue;
    const auto [p, q] = edges.points[j];
    const Vec3 force = edges.weight[j] * (Vec3::Map(&x[3 * q]) - Vec3::Map(&x[3 * p]));
    groups.add(p, force);
    groups.add(q, -force);
  }
}

/// Φ_v'(v) of prism m.
double slope(const model::StepNumbers& n, double change, double rest, double pressure) {
  if (n.volume == VolumeTerm::paper) return 2 * (1 - n.lambda) * change;
  if (n.volume == VolumeTerm::penalty) return n.bulk_modulus * change / rest;
  return -pressure;
}

void add_prisms(const model::Model& model, const std::vector<double>& x,
                const std::vector<double>& pressure, const model::StepNumbers& n, Groups& groups) {
  const model::Prisms& prisms = model.prisms;
  std::vector<double> of_solid;
  if (model::is_solid(model))
    of_solid = mechanics::volume_slopes(
        model, {reinterpret_cast<const Vec3*>(x.data()), model.points.position.size()});
  for (size_t m = 0; m < prisms.points.size(); ++m) {
    if (!groups.touch(prisms.points[m])) continue;
    mechanics::PrismTriples<double> corners;
    for (int c = 0; c < 6; ++c)
      corners[c] = mechanics::triple(Vec3::Map(&x[3 * prisms.points[m][c]]));
    const mechanics::PrismSlope<double> v{mechanics::PrismEdges<double>(corners)};
    const double by = !of_solid.empty()
                          ? of_solid[m]
                          : slope(n, v.volume - prisms.rest_volume[m], prisms.rest_volume[m],
                                  pressure.empty() ? 0 : pressure[m]);
    for (int c = 0; c < 6; ++c)
      groups.add(prisms.points[m][c], -by * mechanics::vec3(v.gradient[c]));
  }
}

}  // namespace

std::vector<Vec3> reactions(MPI_Comm comm, const model::Model& model,
                            const std::vector<std::vector<int64_t>>& held,
                            const model::StepNumbers& numbers, const model::StepRows& rows) {
  auto requested = static_cast<int64_t>(held.size());
  MPI_Bcast(&requested, 1, MPI_INT64_T, 0, comm);
  if (requested == 0) return {};
  const std::vector<double> x =
      discrete::gather(comm, rows.position.empty() ? nullptr : rows.position.data()->data(),
                       3 * rows.position.size());
  const std::vector<double> pressure =
      discrete::gather(comm, rows.pressure.data(), rows.pressure.size());
  if (base::rank(comm) != 0) return {};
  Groups groups(model.points.position.size(), held);
  const bool energy = numbers.functional == model::Functional::energy;
  add_springs(model, x, energy && numbers.volume == VolumeTerm::paper ? numbers.lambda : 1, groups);
  add_edges(model, x, groups);
  if (energy && numbers.volume != VolumeTerm::none) add_prisms(model, x, pressure, numbers, groups);
  return groups.forces();
}

}  // namespace repose::solve
