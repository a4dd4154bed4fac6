#include "check_contact.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "cut_faces.h"
#include "obstacle.h"

namespace repose::tools::check {

namespace {

constexpr double considered = 6;       // mm, the stated gap where nothing is nearer
constexpr double largest_slope = 1.4;  // of interpolated distances, beside edges
constexpr double exact_to = 1e-6;      // mm, of a penetration that two programs measure exactly
constexpr double single_to = 1e-5;     // mm, of distances that are kept in single precision

const std::vector<double>* field(const model::StepRows& rows, const char* name) {
  for (const model::PointField& field : rows.point_fields)
    if (field.name == name) return &field.values;
  return nullptr;
}

/// mm, that a step's positions are uncertain by.
double slack_of(const model::StepNumbers& numbers) {
  return std::max(1e-9, numbers.displacement_error);
}

/// Weights of a uniform cubic B-spline's four coefficients at the share t of an interval, and their
/// derivatives.
std::array<std::array<double, 4>, 2> spline_weights(double t) {
  const double u = 1 - t;
  return {{{u * u * u / 6, (4 - 6 * t * t + 3 * t * t * t) / 6, (4 - 6 * u * u + 3 * u * u * u) / 6,
            t * t * t / 6},
           {-u * u / 2, (3 * t * t - 4 * t) / 2, (4 * u - 3 * u * u) / 2, t * t / 2}}};
}

/// Recomputed contact of one point.
struct AtPoint {
  double gap = considered;               // mm, the smaller of that to bodies and that to cuts
  double body_gap = considered;          // mm
  std::vector<double> wall_gaps;         // of all places, at all nearest feet
  double largest_wall_gap = considered;  // smallest over the places of their largest
  int32_t body = -1;                     // that it is to; −1: the side of a cut
  std::vector<int32_t> pressing;         // bodies that may press
  bool slides = false, mesh = false, wall = false;
  double area = 0;  // mm², that the point stands for
};

/// Recomputed contact of a step.
struct Truth {
  std::vector<AtPoint> points;
  double into_bodies = 0;  // mm, inside rigid bodies beyond the initial depth, …
  int64_t deepest_point = -1;
  int32_t deepest_body = -1;

  void offer(double depth, int64_t point, int32_t body) {
    if (depth <= into_bodies) return;
    into_bodies = depth;
    deepest_point = point;
    deepest_body = body;
  }
};

/// The bodies of a model's contact at a load.
class Bodies {
 public:
  Bodies(const model::Model& model, const model::PrescribedMotion& motion, double load)
      : spacing_(model.contact.spacing), kept_(std::max(considered, 4 * spacing_)) {
    for (const model::Body& body : model.contact.bodies) {
      shapes_.emplace_back(model, body);
      Mat4 pose = Mat4::Identity();
      if (body.bone >= 0)
        pose = motion.bone_matrix(body.bone, load);
      else
        pose.topRightCorner<3, 1>() = load * body.push;
      poses_.push_back(pose);
    }
    nodes_.resize(shapes_.size());
  }
  bool is_mesh(int32_t body) const { return shapes_[body].is_mesh(); }
  /// Where a point in space is beside a body at load 0.
  Vec3 beside(int32_t body, const Vec3& point) const {
    const Mat4& pose = poses_[body];
    return pose.topLeftCorner<3, 3>().transpose() * (point - pose.topRightCorner<3, 1>());
  }
  /// mm, of a point given by beside(); to a mesh at most `reach`, inside it of any size.
  double distance(int32_t body, const Vec3& beside) const {
    const double nearby = shapes_[body].distance(beside, reach);
    return nearby > -reach ? nearby : shapes_[body].distance(beside, infinite);
  }
  /// mm, of a point given by beside(), as the solver computes it: to a mesh by a cubic B-spline.
  double solver_distance(int32_t body, const Vec3& beside) const {
    return is_mesh(body) ? sample(body, beside)[3] : distance(body, beside);
  }
  /// Gradient at a point in space of the distance that the solver uses.
  Vec3 gradient(int32_t body, const Vec3& point) const {
    const Vec3 at = beside(body, point);
    return poses_[body].topLeftCorner<3, 3>() *
           (is_mesh(body) ? Vec3(sample(body, at).head<3>()) : shapes_[body].normal(at));
  }
  /// mm, by which the B-spline may be less than the distance to a mesh.
  double smoothing() const { return 1.67 * spacing_ + single_to; }

 private:
  /// Gradient and value of the cubic B-spline on the solver's grid (docs/reference/formats.md).
  Eigen::Vector4d sample(int32_t body, const Vec3& beside) const {
    const Vec3 origin = shapes_[body].low_corner() - Vec3::Constant(kept_ + 4 * spacing_);
    const Vec3 at = (beside - origin) / spacing_, first = at.array().floor() - 1;
    std::array<std::array<std::array<double, 4>, 2>, 3> weights;
    for (int a = 0; a < 3; ++a) weights[a] = spline_weights(at[a] - first[a] - 1);
    constexpr int side = 6;  // the coefficients, and a neighbor on each side
    std::array<double, side * side * side> value;
    for (int n = 0; n < side * side * side; ++n)
      value[n] = at_node(body, origin, first + Vec3(n / 36 - 1, n / 6 % 6 - 1, n % 6 - 1));
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    for (int n = 0; n < 64; ++n) {
      const std::array<int, 3> node{n / 16, n / 4 % 4, n % 4};
      const int here = 36 * (node[0] + 1) + 6 * (node[1] + 1) + node[2] + 1;
      const double beside_it = value[here - 36] + value[here + 36] + value[here - 6] +
                               value[here + 6] + value[here - 1] + value[here + 1];
      const double coefficient = 2 * value[here] - beside_it / 6;
      for (int a = 0; a < 4; ++a) {  // the derivatives along the axes, then none
        double weight = a < 3 ? 1 / spacing_ : 1;
        for (int b = 0; b < 3; ++b) weight *= weights[b][a == b][node[b]];
        sum[a] += weight * coefficient;
      }
    }
    return sum;
  }

  /// mm, of a point of the solver's grid, computed once.
  double at_node(int32_t body, const Vec3& origin, const Vec3& node) const {
    const auto [known, is_new] = nodes_[body].try_emplace({node.x(), node.y(), node.z()});
    if (is_new) known->second = shapes_[body].distance(origin + spacing_ * node, kept_);
    return known->second;
  }

  static constexpr double infinite = std::numeric_limits<double>::infinity();
  static constexpr double reach = considered + 2;  // mm
  double spacing_;                                 // mm
  double kept_;                                    // mm, up to which the solver keeps distances
  std::vector<Obstacle> shapes_;
  std::vector<Mat4> poses_;
  mutable std::vector<std::map<std::array<double, 3>, double>> nodes_;  // mm, by body
};

/// `slack` in mm: bodies that are nearer may press.
void add_bodies(const model::Model& model, const Bodies& bodies, const std::vector<Vec3>& position,
                double slack, Truth& truth) {
  const model::ContactPairs& pairs = model.contact.pairs;
  for (size_t c = 0; c < pairs.point.size(); ++c) {
    const int64_t row = pairs.point[c];
    const int32_t body = pairs.body[c];
    const bool slides = pairs.binding[c] == model::Binding::slides, mesh = bodies.is_mesh(body);
    const Vec3 beside = bodies.beside(body, position[row]), &before = model.points.position[row];
    const double exact = bodies.distance(body, beside),
                 exact_before = bodies.distance(body, before);
    double offset = 0;
    if (slides || exact_before < (mesh ? bodies.smoothing() : 0))
      offset = bodies.solver_distance(body, before);
    if (!slides) offset = std::min(offset, 0.0);
    const bool away = mesh && !slides && exact >= bodies.smoothing();
    const double gap = (away ? exact : bodies.solver_distance(body, beside)) - offset;
    AtPoint& point = truth.points[row];
    point.slides = point.slides || slides;
    point.mesh = point.mesh || mesh;
    point.area = pairs.area[c];
    if (slides || gap <= slack + single_to) point.pressing.push_back(body);
    if (gap <= point.gap) {
      point.gap = point.body_gap = gap;
      point.body = body;
    }
    truth.offer(std::min(exact_before, 0.0) - exact, row, body);
  }
}

void add_cut_faces(const model::Model& model, const std::vector<Vec3>& position, Truth& truth) {
  for (const int64_t p : model.contact.cut_faces.point) truth.points[p].wall = true;
  for (const CutGap& at : cut_gaps(model.contact.cut_faces, position)) {
    AtPoint& point = truth.points[at.point];
    if (at.gap[0] < point.gap) point.body = -1;
    point.gap = std::min(point.gap, at.gap[0]);
    point.largest_wall_gap = std::min(point.largest_wall_gap, std::ranges::max(at.gap));
    point.wall_gaps.insert(point.wall_gaps.end(), at.gap.begin(), at.gap.end());
  }
}

Truth find_truth(const model::Model& model, const Bodies& bodies, const std::vector<Vec3>& position,
                 double slack) {
  Truth truth;
  truth.points.resize(position.size());
  add_bodies(model, bodies, position, slack, truth);
  add_cut_faces(model, position, truth);
  return truth;
}

/// The worst of many values in one line.
class Worst {
 public:
  template <class Text>
  void offer(double excess, Text&& text) {
    if (excess <= excess_) return;
    excess_ = excess;
    text_ = text();
  }
  /// The statement that none exceeds its bound, or which one does and by how much.
  void state(const std::string& what, Comparison& comparison) const {
    comparison.statement(text_.empty() ? what : text_, text_.empty());
  }

 private:
  double excess_ = 0;
  std::string text_;
};

/// Comparison of a step's stated contact with the recomputed one.
class Claims {
 public:
  Claims(const model::Model& model, const model::StepNumbers& numbers,
         const std::vector<Vec3>& position, const Bodies& bodies, const Truth& truth,
         Comparison& comparison)
      : model_(model),
        numbers_(numbers),
        position_(position),
        bodies_(bodies),
        truth_(truth),
        comparison_(comparison) {}

  void check_gaps(const std::vector<double>& stated);
  void check_depths(const std::vector<double>& gap);
  void check_pressures(const std::vector<double>& gap, const std::vector<double>& pressure);
  void check_forces(const std::vector<double>& pressure, const std::vector<double>& force);

 private:
  std::string name_of(int32_t body) const {
    return body < 0 ? "the sides of cuts" : "'" + model_.contact.bodies[body].name + "'";
  }

  const model::Model& model_;
  const model::StepNumbers& numbers_;
  const std::vector<Vec3>& position_;
  const Bodies& bodies_;
  const Truth& truth_;
  Comparison& comparison_;
};

/// The gap of a point that is nearest to a stated one: that of each of its places may be at any of
/// feet as near.
double nearest_gap(const AtPoint& point, double stated) {
  double nearest = point.gap;
  const auto offer = [&](double gap) {
    if (std::abs(stated - gap) < std::abs(stated - nearest)) nearest = gap;
  };
  for (const double gap : point.wall_gaps)
    if (gap <= point.largest_wall_gap) offer(std::min(point.body_gap, gap));
  return nearest;
}

void Claims::check_gaps(const std::vector<double>& stated) {
  std::vector<double> gaps, again;
  Worst worst;
  for (size_t i = 0; i < stated.size(); ++i) {
    const double nearest = nearest_gap(truth_.points[i], stated[i]);
    if (!truth_.points[i].mesh) {
      gaps.push_back(stated[i]);
      again.push_back(nearest);
      continue;
    }
    const double off = std::abs(stated[i] - nearest);
    worst.offer(off <= single_to ? 0 : off, [&] {
      return fmt::format(
          "contact_gap of point {} to {}: stated {:.6g} mm, by its triangles {:.6g} mm", i,
          name_of(truth_.points[i].body), stated[i], nearest);
    });
  }
  comparison_.array("point/contact_gap", gaps, again, considered);
  worst.state("gaps to meshes follow from their triangles, to 1e-5 mm", comparison_);
}

void Claims::check_depths(const std::vector<double>& gap) {
  const double deepest = -*std::min_element(gap.begin(), gap.end());
  comparison_.number("penetration", numbers_.penetration, std::max(0.0, deepest), considered);
  if (!std::isfinite(numbers_.penetration_exact)) return;
  const double off = std::abs(numbers_.penetration_exact - truth_.into_bodies);
  Worst worst;
  worst.offer(off <= exact_to ? 0 : off, [&] {
    return fmt::format(
        "penetration_exact: stated {:.4g} mm, by the bodies' own shapes {:.4g} mm (point {} in {})",
        numbers_.penetration_exact, truth_.into_bodies, truth_.deepest_point,
        name_of(truth_.deepest_body));
  });
  worst.state("penetration_exact is that into the bodies' own shapes", comparison_);
}

void Claims::check_pressures(const std::vector<double>& gap, const std::vector<double>& pressure) {
  double pull = 0, across = 0;
  for (size_t i = 0; i < pressure.size(); ++i) {
    if (truth_.points[i].slides) continue;
    pull = std::max(pull, -pressure[i]);
    if (pressure[i] > 0) across = std::max(across, gap[i]);
  }
  comparison_.statement("contact only presses", pull <= 0);
  if (numbers_.converged)  // an interrupted search has the pressure of gaps it is about to close
    comparison_.statement("pressure is where gaps are closed", across <= slack_of(numbers_));
}

/// The force on a point is Σ p area ∇φ over the bodies that may press, its pressure Σ p: that is
/// w · force where w · area ∇φ = 1 for each of them; no such w exists between bodies that press
/// against each other.
void Claims::check_forces(const std::vector<double>& pressure, const std::vector<double>& force) {
  constexpr double steepest = 10;                                        // of w, times the area
  const double rounding = 1e-5 / std::min(1.0, model_.contact.spacing);  // of grids of floats
  Worst aside, unequal, too_large;
  int64_t others = 0;
  for (size_t i = 0; i < position_.size(); ++i) {
    const AtPoint& point = truth_.points[i];
    const Vec3 stated = Vec3::Map(force.data() + 3 * i);
    const double size = stated.norm(), pressed = pressure[i] * point.area;
    if (size == 0 && pressure[i] == 0) continue;
    if (point.wall || point.pressing.empty()) {
      ++others;
      continue;
    }
    Eigen::MatrixXd slopes(3, point.pressing.size());
    for (size_t k = 0; k < point.pressing.size(); ++k)
      slopes.col(k) = bodies_.gradient(point.pressing[k], position_[i]);
    const Eigen::MatrixXd rows = slopes.transpose();
    const Eigen::VectorXd ones = Eigen::VectorXd::Ones(rows.rows());
    const Vec3 w = rows.completeOrthogonalDecomposition().solve(ones),
               sum = slopes * slopes.completeOrthogonalDecomposition().solve(stated);
    aside.offer((stated - sum).norm() - rounding * std::max(size, std::abs(pressed)), [&] {
      return fmt::format(
          "contact_force of point {} on {}: stated {:.4g} N, along the gradients of distance "
          "{:.4g} N",
          i, name_of(point.pressing.front()), stated, sum);
    });
    const bool known = w.norm() < steepest && (rows * w - ones).norm() < 1e-9;
    others += !known;
    if (known)
      unequal.offer(std::abs(pressed - w.dot(stated)) - rounding * w.norm() * size, [&] {
        return fmt::format(
            "contact_pressure of point {}: stated {:.6g} N/mm², by its force {:.6g} N/mm²", i,
            pressure[i], w.dot(stated) / point.area);
      });
    else if (!point.slides)
      too_large.offer(size - largest_slope * pressed, [&] {
        return fmt::format(
            "contact_force of point {}: stated {:.4g} N, pressure times area {:.4g} N", i, size,
            pressed);
      });
  }
  aside.state("contact forces are along the gradients of distances", comparison_);
  unequal.state("contact pressures are those of the forces", comparison_);
  comparison_.unchecked("point/contact_pressure", others);
  too_large.state("contact forces are no larger than pressure times area", comparison_);
}

}  // namespace

void check_contact(const model::Model& model, const model::PrescribedMotion& motion,
                   const model::StepNumbers& numbers, const model::StepRows& rows,
                   Comparison& comparison) {
  if (model.contact.empty()) return;
  const auto *gap = field(rows, "contact_gap"), *pressure = field(rows, "contact_pressure"),
             *force = field(rows, "contact_force");
  comparison.statement("contact_gap, contact_pressure and contact_force are there",
                       gap && pressure && force);
  if (!gap || !pressure || !force) return;
  const Bodies bodies(model, motion, numbers.load);
  const Truth truth = find_truth(model, bodies, rows.position, slack_of(numbers));
  Claims claims(model, numbers, rows.position, bodies, truth, comparison);
  claims.check_gaps(*gap);
  claims.check_depths(*gap);
  claims.check_pressures(*gap, *pressure);
  claims.check_forces(*pressure, *force);
}

}  // namespace repose::tools::check
