#include "plan_tangents.h"

#include <algorithm>

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
  FrozenContact(const FrozenContact&) = delete;
  FrozenContact& operator=(const FrozenContact&) = delete;

 private:
  mechanics::BodyContact& body_contact() { return problem_.objective().body_contact(); }
  mechanics::CutFaceContact& cut_face_contact() { return problem_.objective().cut_face_contact(); }
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
std::vector<Vec3> differentiate(discrete::Objective& objective, Vec displacement,
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

}  // namespace

std::vector<model::PointField> plan_tangents(Problem& problem, const discrete::NaturalRows& natural,
                                             Vec displacement,
                                             const std::vector<PlanPiece>& pieces) {
  constexpr std::string_view axes = "xyz";
  discrete::Objective& objective = problem.objective();
  discrete::Positions& positions = objective.positions();
  linear::TangentSolver& solver = problem.elastic_solver();
  const base::VecHandle slope = positions.make_vector(), column = positions.make_vector();
  std::vector<model::PointField> fields;
  {
    positions.update(displacement);
    objective.place_bodies();
    const FrozenContact frozen(problem);
    solver.refresh(displacement);
    for (const PlanPiece& piece : pieces)
      for (int component = 0; component < 6; ++component) {
        std::vector<Vec3> values = differentiate(objective, displacement, piece, component, slope);
        check(VecScale(slope, -1.0));
        bool convex = solver.solve(displacement, slope, column, close);
        // Where iterations ran out, the next solve renews the preconditioner or takes factors.
        if (convex && !solver.finished()) convex = solver.solve(displacement, slope, column, close);
        const bool finished = solver.finished();
        if (!convex || !finished) {
          check(VecSet(column, 0));
          std::ranges::fill(values, Vec3::Zero());
        }
        positions.scatter_to_local(column, values);
        model::PointField& field = fields.emplace_back(
            natural.field(fmt::format("tangent_{}_{}{}", piece.bone, component < 3 ? 't' : 'r',
                                      axes[component % 3]),
                          values));
        field.texts = {{"unit", component < 3 ? "mm/mm" : "mm/degree"}};
        field.flags = {{"finished", finished}, {"convex", convex}};
      }
  }
  objective.evaluate(displacement, slope);
  return fields;
}

}  // namespace repose::solve
