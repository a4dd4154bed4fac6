#include "rest_derivatives.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>
#include <utility>

#include "held_response.h"
#include "repose/base/collective.h"
#include "repose/mechanics/prism_volume.h"
#include "repose/model/material.h"

namespace repose::solve {

using base::check;

namespace {

constexpr double difference = 1e-6;  // mm or degrees

/// Derivatives by a parameter with the points that are solved for at rest.
struct Change {
  std::vector<Vec3> travel;  // [local points] of fixed points, mm
  std::vector<double> gaps;  // [constraints] mm
};

scene::Placement changed(scene::Placement placement, int component, double by) {
  (component < 3 ? placement.translation : placement.rotation)[component % 3] += by;
  return placement;
}

/// Positions and gaps at the objective's latest evaluation.
Change state_of(discrete::Objective& objective) {
  const auto position = objective.positions().local();
  return {{position.begin(), position.end()}, objective.contact().gaps()};
}

/// The derivative of the gradient, into `slope`, and of fixed points and gaps by a component of a
/// piece's placement.
Change differentiate_by(discrete::Objective& objective, Vec displacement, const PlanPiece& piece,
                        int component, Vec slope) {
  discrete::Positions& positions = objective.positions();
  const base::VecHandle before = positions.make_vector();
  const auto evaluate = [&](double by, Vec gradient) {
    const scene::Placement placement = changed(piece.placement, component, by);
    positions.set_motion(piece.bone, scene::motion_of(placement, piece.centroid));
    objective.evaluate(displacement, gradient);
    return state_of(objective);
  };
  const Change from = evaluate(-difference, before);
  Change to = evaluate(difference, slope);
  check(VecAXPY(slope, -1.0, before));
  check(VecScale(slope, 1 / (2 * difference)));
  const auto differentiate = [](auto& values, const auto& earlier) {
    for (size_t i = 0; i < values.size(); ++i)
      values[i] = (values[i] - earlier[i]) / (2 * difference);
  };
  differentiate(to.travel, from.travel);
  differentiate(to.gaps, from.gaps);
  evaluate(0, before);
  return to;
}

/// Forces of the strata of a solid: the derivatives of ∇Φ by ln E.
class StrataForces {
 public:
  /// At the positions' last update.
  StrataForces(const discrete::Objective& objective, const Derivatives& requested)
      : objective_(objective),
        strata_(requested.strata),
        in_region_(requested.in_region),
        support_shares_(requested.support_shares) {
    if (strata_.empty()) return;
    const model::Model& model = positions().part().model;
    std::vector<double> thickness;
    for (const Stratum& stratum : std::span(strata_).first(strata_.size() - 1))
      thickness.push_back(stratum.thickness);
    const std::vector<int64_t> skin = model::skin_rows(model.points);
    for (const auto& prism : model.prisms.points)
      share_.push_back(model::strata_shares(thickness, model::depth_of(model, prism, skin)));
  }

  /// Those of a stratum on the unknowns, N. Not collective.
  void assemble(size_t stratum, Vec forces) const {
    std::vector<Vec3> force(positions().local().size(), Vec3::Zero());
    for (size_t m = 0; m < share_.size(); ++m)
      if (share_[m][stratum] > 0 && is_of_strata(m)) add(m, share_[m][stratum], stratum, force);
    add_supports(stratum, force);
    positions().restrict_to_owned(force, forces);
  }

 private:
  const discrete::Positions& positions() const { return objective_.positions(); }

  /// Adds the forces of elastic supports by their share of the stratum.
  void add_supports(size_t stratum, std::vector<Vec3>& force) const {
    const discrete::Part& part = positions().part();
    for (const model::TermElements& elements : part.model.elements) {
      if (elements.term != "elastic_support") continue;
      model::TermElements supports = elements;
      for (size_t e = 0; e < supports.size(); ++e)
        supports.numbers[e * static_cast<size_t>(supports.numbers_each) + 3] *=
            support_shares_[e][stratum];
      const mechanics::TermLoop loop(supports, part.model.points, part.owned_points);
      loop.add_gradient(positions().local(), positions().poses(), 1, force);
    }
  }

  /// False for a prism of a region, which has moduli of its own.
  bool is_of_strata(size_t m) const { return in_region_.empty() || !in_region_[m]; }

  void add(size_t m, double share, size_t stratum, std::vector<Vec3>& force) const {
    const model::Model& model = positions().part().model;
    const auto& corners = model.prisms.points[m];
    const std::array<Vec3, 6> now = base::pick(positions().local(), corners);
    const double shear = share * strata_[stratum].shear, bulk = share * strata_[stratum].bulk;
    const auto weights = model::pair_weights(model::corners_of(model, m)).value();
    for (size_t k = 0; k < weights.size(); ++k) {
      const auto [i, j] = model::prism_pairs[k];
      const Vec3 pull = shear * weights[k] * (now[i] - now[j]);
      force[corners[i]] += pull;
      force[corners[j]] -= pull;
    }
    const mechanics::PrismSlope volume(mechanics::PrismEdges<double>(mechanics::triples(now)));
    const double pressure = bulk * (volume.volume / model.prisms.rest_volume[m] - 1) - shear;
    for (int c = 0; c < 6; ++c) force[corners[c]] += pressure * mechanics::vec3(volume.gradient[c]);
  }

  const discrete::Objective& objective_;
  const std::vector<Stratum>& strata_;
  const std::vector<char>& in_region_;
  const std::vector<std::vector<double>>& support_shares_;
  std::vector<std::vector<double>> share_;  // [prisms][strata]
};

/// The adjoint λ of a scalar Σ w · x: the derivative by a parameter is w · ∂x_b/∂p − λ · ∂(∇Φ)/∂p
/// with x_b the fixed points, and the term of the held gaps (docs/theory/plan.md).
class Adjoint {
 public:
  Adjoint(HeldResponse& response, const discrete::Positions& positions, std::vector<Vec3> weight)
      : positions_(positions),
        weight_(std::move(weight)),
        lambda_(positions.make_vector()),
        earlier_(positions.make_vector()) {
    const base::VecHandle load = positions.make_vector(), none = positions.make_vector();
    positions.restrict_to_owned(weight_, load);
    response.solve(load, none, lambda_, earlier_);
    result_.finished = response.finished();
    result_.convex = response.convex();
  }

  double derivative(Vec slope, Vec forces, std::span<const Vec3> travel) const {
    if (!result_.finished || !result_.convex) return 0;
    double carried = 0;
    for (size_t i = 0; i < weight_.size() && !travel.empty(); ++i)
      carried += weight_[i].dot(travel[i]);
    carried = base::sum_over_ranks(positions_.comm(), carried);
    PetscReal resisted = 0, held = 0;
    check(VecDot(lambda_, slope, &resisted));
    check(VecDot(earlier_, forces, &held));
    return carried - resisted + held;
  }
  Gradient& result() { return result_; }

 private:
  const discrete::Positions& positions_;
  std::vector<Vec3> weight_;  // [owned points]
  base::VecHandle lambda_, earlier_;
  Gradient result_;
};

/// The field of a column ∂x/∂p whose fixed points `travel`.
model::PointField tangent_field(HeldResponse& response, const discrete::Positions& positions,
                                const discrete::NaturalRows& natural, const std::string& name,
                                const char* unit, Vec slope, Vec forces, std::vector<Vec3> travel) {
  const base::VecHandle column = positions.make_vector(), earlier = positions.make_vector();
  check(VecScale(slope, -1.0));
  response.solve(slope, forces, column, earlier);
  if (!response.succeeded()) std::ranges::fill(travel, Vec3::Zero());
  positions.scatter_to_local(column, travel);
  model::PointField field = natural.field(name, travel);
  field.texts = {{"unit", unit}};
  field.flags = {{"finished", response.finished()}, {"convex", response.convex()}};
  return field;
}

}  // namespace

std::optional<Gradient> differentiate(Problem& problem, const discrete::NaturalRows& natural,
                                      Vec displacement, const Settings& settings,
                                      std::vector<model::PointField>& fields) {
  constexpr std::string_view axes = "xyz";
  const Derivatives& requested = settings.derivatives;
  discrete::Objective& objective = problem.objective();
  discrete::Positions& positions = objective.positions();
  const base::VecHandle slope = positions.make_vector(), forces = positions.make_vector();
  const auto abandoned = [&] { return settings.abandoned && settings.abandoned(); };
  std::optional<Adjoint> adjoint;
  positions.update(displacement);
  objective.contact().place_bodies();
  {
    HeldResponse response(problem, displacement);
    if (!requested.functional.empty())
      adjoint.emplace(response, positions, natural.owned(requested.functional));
    const auto add = [&](const std::string& name, const char* unit, Change change,
                         std::vector<double> Gradient::*derivatives) {
      response.forces_of_gaps(change.gaps, forces);
      if (adjoint)
        (adjoint->result().*derivatives)
            .push_back(adjoint->derivative(slope, forces, change.travel));
      if (requested.fields)
        fields.push_back(tangent_field(response, positions, natural, name, unit, slope, forces,
                                       std::move(change.travel)));
    };
    for (const PlanPiece& piece : requested.pieces)
      for (int c = 0; c < 6; ++c) {
        if (abandoned()) return {};
        add(fmt::format("tangent_{}_{}{}", piece.bone, c < 3 ? 't' : 'r', axes[c % 3]),
            c < 3 ? "mm/mm" : "mm/degree",
            differentiate_by(objective, displacement, piece, c, slope), &Gradient::by_pieces);
      }
    positions.update(displacement);
    const StrataForces strata(objective, requested);
    const Change unchanged{std::vector<Vec3>(positions.local().size(), Vec3::Zero()),
                           std::vector<double>(objective.contact().size(), 0.0)};
    for (size_t s = 0; s < requested.strata.size(); ++s) {
      if (abandoned()) return {};
      strata.assemble(s, slope);
      add(fmt::format("tangent_young_{}", s), "mm", unchanged, &Gradient::by_strata);
    }
  }
  objective.evaluate(displacement, slope);
  return adjoint ? std::move(adjoint->result()) : Gradient{};
}

}  // namespace repose::solve
