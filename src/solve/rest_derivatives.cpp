#include "rest_derivatives.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "repose/base/collective.h"
#include "repose/mechanics/prism_volume.h"
#include "repose/model/material.h"

namespace repose::solve {

using base::check;

namespace {

constexpr double difference = 1e-6;  // mm or degrees
constexpr double close = 1e-4;       // relative residual of the linear solves
constexpr double stiffer = 16;       // the penalty that holds what presses at its body
constexpr double apart = 1;          // mm that what does not press would have to come nearer

/// Contact whose active set does not change, while it lives: what presses keeps its pressure at the
/// present gap and is held there by a stiffer penalty, all else stays off.
class FrozenContact {
 public:
  explicit FrozenContact(Problem& problem)
      : problem_(problem), stiffness_(body_contact().stiffness()) {
    const auto p = body_contact().multipliers(), q = cut_face_contact().multipliers();
    touch_multipliers_.assign(p.begin(), p.end());
    wall_multipliers_.assign(q.begin(), q.end());
    const auto position = problem.objective().positions().local();
    body_contact().update_all_gaps(position);
    cut_face_contact().update_gaps(position);
    const double stiff = stiffer * stiffness_;
    const auto frozen = [&](double pressure, double gap) {
      return pressure != 0 ? pressure + stiff * gap : stiff * (gap - apart);
    };
    std::vector<double> pressing(touch_multipliers_.size()), parting(wall_multipliers_.size());
    for (size_t c = 0; c < pressing.size(); ++c)
      pressing[c] = frozen(body_contact().pressure(c), body_contact().gaps()[c]);
    for (size_t w = 0; w < parting.size(); ++w)
      parting[w] = frozen(cut_face_contact().pressure(w), cut_face_contact().gap(w));
    set(stiff, pressing, parting);
  }
  ~FrozenContact() { set(stiffness_, touch_multipliers_, wall_multipliers_); }
  FrozenContact(FrozenContact&&) = delete;

 private:
  mechanics::BodyContact& body_contact() { return problem_.objective().contact().bodies(); }
  mechanics::CutFaceContact& cut_face_contact() {
    return problem_.objective().contact().cut_faces();
  }
  void set(double stiffness, std::span<const double> pressing, std::span<const double> parting) {
    body_contact().set_stiffness(stiffness);
    cut_face_contact().set_stiffness(stiffness);
    body_contact().set_multipliers(pressing);
    cut_face_contact().set_multipliers(parting);
    problem_.tangent().forget_contact();
  }

  Problem& problem_;
  double stiffness_;
  std::vector<double> touch_multipliers_, wall_multipliers_;
};

scene::Placement changed(scene::Placement placement, int component, double by) {
  (component < 3 ? placement.translation : placement.rotation)[component % 3] += by;
  return placement;
}

/// The derivative of the gradient, into `slope`, and of the fixed points, mm, by a component of a
/// piece's placement.
std::vector<Vec3> differentiate_by(discrete::Objective& objective, Vec displacement,
                                   const PlanPiece& piece, int component, Vec slope) {
  discrete::Positions& positions = objective.positions();
  const base::VecHandle before = positions.make_vector();
  const auto evaluate = [&](double by, Vec gradient) {
    const scene::Placement placement = changed(piece.placement, component, by);
    positions.set_motion(piece.bone, scene::motion_of(placement, piece.centroid));
    objective.evaluate(displacement, gradient);
    return std::vector<Vec3>(positions.local().begin(), positions.local().end());
  };
  const std::vector<Vec3> from = evaluate(-difference, before);
  std::vector<Vec3> travel = evaluate(difference, slope);
  check(VecAXPY(slope, -1.0, before));
  check(VecScale(slope, 1 / (2 * difference)));
  for (size_t i = 0; i < travel.size(); ++i) travel[i] = (travel[i] - from[i]) / (2 * difference);
  evaluate(0, before);
  return travel;
}

/// Forces of the strata of a solid: the derivatives of ∇Φ by ln E.
class StrataForces {
 public:
  /// At the positions' last update.
  StrataForces(const discrete::Positions& positions, const std::vector<Stratum>& strata)
      : positions_(positions), strata_(strata) {
    if (strata.empty()) return;
    const model::Model& model = positions.part().model;
    std::vector<double> thickness;
    for (const Stratum& stratum : std::span(strata).first(strata.size() - 1))
      thickness.push_back(stratum.thickness);
    const std::vector<int64_t> skin = tops(model.points);
    for (const auto& prism : model.prisms.points)
      share_.push_back(model::strata_shares(thickness, model::depth_of(model, prism, skin)));
  }

  /// N, of a stratum on all local points, into `slope`. Not collective.
  void restrict_to_owned(size_t stratum, Vec slope) const {
    std::vector<Vec3> force(positions_.local().size(), Vec3::Zero());
    for (size_t m = 0; m < share_.size(); ++m)
      if (share_[m][stratum] > 0 && is_of_strata(m)) add(m, share_[m][stratum], stratum, force);
    positions_.restrict_to_owned(force, slope);
  }

 private:
  /// [local points] The point at the top of the column of each.
  static std::vector<int64_t> tops(const model::Points& points) {
    std::unordered_map<int64_t, int64_t> top;
    for (size_t i = 0; i < points.layer.size(); ++i)
      if (points.layer[i] == 0) top[points.column[i]] = static_cast<int64_t>(i);
    std::vector<int64_t> rows;
    for (const int64_t column : points.column) rows.push_back(top.at(column));
    return rows;
  }

  /// False for a prism of a region, which has moduli of its own.
  bool is_of_strata(size_t m) const {
    constexpr double rounding = 1e-9;
    const model::Prisms& prisms = positions_.part().model.prisms;
    double shear = prisms.shear_modulus[m], bulk = prisms.modulus[m];
    for (size_t s = 0; s < strata_.size(); ++s) {
      shear -= share_[m][s] * strata_[s].shear;
      bulk -= share_[m][s] * strata_[s].bulk;
    }
    return std::abs(shear) <= rounding * prisms.shear_modulus[m] &&
           std::abs(bulk) <= rounding * prisms.modulus[m];
  }

  void add(size_t m, double share, size_t stratum, std::vector<Vec3>& force) const {
    const model::Model& model = positions_.part().model;
    const auto& corners = model.prisms.points[m];
    const std::array<Vec3, 6> now = base::pick(positions_.local(), corners);
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

  const discrete::Positions& positions_;
  const std::vector<Stratum>& strata_;
  std::vector<std::vector<double>> share_;  // [prisms][strata]
};

/// The linear solves of derivatives at one rest position.
class LinearResponse {
 public:
  LinearResponse(Problem& problem, Vec displacement)
      : solver_(problem.elastic_solver()), displacement_(displacement) {
    solver_.refresh(displacement);
  }

  /// Solves H response = load; 0 where that fails. Collective.
  void solve(Vec load, Vec response) {
    convex_ = solver_.solve(displacement_, load, response, close);
    // Where iterations ran out, the next solve renews the preconditioner or takes factors.
    if (convex_ && !solver_.finished())
      convex_ = solver_.solve(displacement_, load, response, close);
    finished_ = solver_.finished();
    if (!succeeded()) check(VecSet(response, 0));
  }
  bool finished() const { return finished_; }
  bool convex() const { return convex_; }
  bool succeeded() const { return finished_ && convex_; }

 private:
  linear::TangentSolver& solver_;
  Vec displacement_;
  bool finished_ = false, convex_ = false;
};

/// The adjoint λ of a scalar Σ w · x: the derivative by a parameter is w · ∂x_b/∂p − λ · ∂(∇Φ)/∂p,
/// x_b the fixed points.
class Adjoint {
 public:
  Adjoint(LinearResponse& response, const discrete::Positions& positions, std::vector<Vec3> weight)
      : positions_(positions), weight_(std::move(weight)), lambda_(positions.make_vector()) {
    const base::VecHandle load = positions.make_vector();
    positions.restrict_to_owned(weight_, load);
    response.solve(load, lambda_);
    result_.finished = response.finished();
    result_.convex = response.convex();
  }

  double derivative(Vec slope, std::span<const Vec3> travel) const {
    if (!result_.finished || !result_.convex) return 0;
    double carried = 0;
    for (size_t i = 0; i < weight_.size() && !travel.empty(); ++i)
      carried += weight_[i].dot(travel[i]);
    carried = base::sum_over_ranks(positions_.comm(), carried);
    PetscReal resisted = 0;
    check(VecDot(lambda_, slope, &resisted));
    return carried - resisted;
  }
  Gradient& result() { return result_; }

 private:
  const discrete::Positions& positions_;
  std::vector<Vec3> weight_;  // [owned points]
  base::VecHandle lambda_;
  Gradient result_;
};

/// The field of a column ∂x/∂p whose fixed points `travel`.
model::PointField tangent_field(LinearResponse& response, const discrete::Positions& positions,
                                const discrete::NaturalRows& natural, const std::string& name,
                                const char* unit, Vec slope, std::vector<Vec3> travel) {
  const base::VecHandle column = positions.make_vector();
  check(VecScale(slope, -1.0));
  response.solve(slope, column);
  if (!response.succeeded()) std::ranges::fill(travel, Vec3::Zero());
  positions.scatter_to_local(column, travel);
  model::PointField field = natural.field(name, travel);
  field.texts = {{"unit", unit}};
  field.flags = {{"finished", response.finished()}, {"convex", response.convex()}};
  return field;
}

}  // namespace

std::optional<Gradient> differentiate(Problem& problem, const discrete::NaturalRows& natural,
                                      Vec displacement, const Derivatives& requested,
                                      std::vector<model::PointField>& fields) {
  constexpr std::string_view axes = "xyz";
  discrete::Objective& objective = problem.objective();
  discrete::Positions& positions = objective.positions();
  const base::VecHandle slope = positions.make_vector();
  std::optional<Adjoint> adjoint;
  positions.update(displacement);
  objective.contact().place_bodies();
  {
    const FrozenContact frozen(problem);
    LinearResponse response(problem, displacement);
    if (!requested.functional.empty())
      adjoint.emplace(response, positions, natural.owned(requested.functional));
    const auto add = [&](const std::string& name, const char* unit, std::vector<Vec3> travel,
                         std::vector<double> Gradient::*derivatives) {
      if (adjoint) (adjoint->result().*derivatives).push_back(adjoint->derivative(slope, travel));
      if (requested.fields)
        fields.push_back(
            tangent_field(response, positions, natural, name, unit, slope, std::move(travel)));
    };
    for (const PlanPiece& piece : requested.pieces)
      for (int c = 0; c < 6; ++c)
        add(fmt::format("tangent_{}_{}{}", piece.bone, c < 3 ? 't' : 'r', axes[c % 3]),
            c < 3 ? "mm/mm" : "mm/degree",
            differentiate_by(objective, displacement, piece, c, slope), &Gradient::by_pieces);
    positions.update(displacement);
    const StrataForces strata(positions, requested.strata);
    for (size_t s = 0; s < requested.strata.size(); ++s) {
      strata.restrict_to_owned(s, slope);
      add(fmt::format("tangent_young_{}", s), "mm",
          std::vector<Vec3>(positions.local().size(), Vec3::Zero()), &Gradient::by_strata);
    }
  }
  objective.evaluate(displacement, slope);
  if (!adjoint) return {};
  return std::move(adjoint->result());
}

}  // namespace repose::solve
