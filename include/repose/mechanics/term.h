#pragma once
#include <Eigen/Core>
#include <array>
#include <memory>
#include <span>
#include <string>
#include <unsupported/Eigen/AutoDiff>
#include <vector>

#include "repose/base/geometry.h"
#include "repose/model/model.h"

/// Energy terms beside springs, edges, prisms and contact: an energy, N·mm, of the positions of an
/// element's few points (mm) and of numbers of its own (model::TermElements). A new one is a class:
///
///     struct Bed {  // a spring of no length to a place that stays
///       static constexpr int points = 1, numbers = 4;  // the place (mm), the stiffness (N/mm)
///       template <class Number>
///       static Number energy(const Corners<Number, points>& x, std::span<const double> n) {
///         return n[3] / 2 * (x[0] - Vec3(n[0], n[1], n[2]).cast<Number>()).squaredNorm();
///       }
///     };
///     mechanics::add_term<Bed>("bed");
namespace repose::mechanics {

/// Places of points, whose coordinates may be dual numbers.
template <class Number, int points>
using Corners = std::array<Eigen::Matrix<Number, 3, 1>, points>;

/// Value, gradient and Hessian by the coordinates of points.
template <int points>
struct Expansion {
  static constexpr int n = 3 * points;
  double value;
  Eigen::Matrix<double, n, 1> gradient;
  Eigen::Matrix<double, n, n> hessian;
};

/// Differentiates `function` twice automatically (forward mode); it is called with Corners of a
/// dual number of duals.
template <int points, class Function>
Expansion<points> differentiate(const std::array<Vec3, points>& at, Function&& function) {
  constexpr int n = 3 * points;
  using First = Eigen::AutoDiffScalar<Eigen::Matrix<double, n, 1>>;
  using Second = Eigen::AutoDiffScalar<Eigen::Matrix<First, n, 1>>;
  Corners<Second, points> x;
  for (int k = 0; k < n; ++k) {
    Second& coordinate = x[k / 3][k % 3];
    coordinate.value() = First(at[k / 3][k % 3], n, k);
    for (int l = 0; l < n; ++l) coordinate.derivatives()[l] = First(l == k ? 1.0 : 0.0);
  }
  const Second result = function(x);
  Expansion<points> expansion;
  expansion.value = result.value().value();
  expansion.gradient = result.value().derivatives();
  for (int l = 0; l < n; ++l) expansion.hessian.col(l) = result.derivatives()[l].derivatives();
  return expansion;
}

/// Differentiates `function` once; returns the value.
template <int points, class Function>
double differentiate(const std::array<Vec3, points>& at, Function&& function,
                     Eigen::Matrix<double, 3 * points, 1>& gradient) {
  constexpr int n = 3 * points;
  using First = Eigen::AutoDiffScalar<Eigen::Matrix<double, n, 1>>;
  Corners<First, points> x;
  for (int k = 0; k < n; ++k) x[k / 3][k % 3] = First(at[k / 3][k % 3], n, k);
  const First result = function(x);
  gradient = result.derivatives();
  return result.value();
}

class Term {
 public:
  using Places = std::span<const Vec3>;     ///< [points]
  using Numbers = std::span<const double>;  ///< [numbers]
  using Gradient = Eigen::VectorXd;         ///< [3 points] N
  using Hessian = Eigen::MatrixXd;          ///< [3 points, 3 points] N/mm
  virtual ~Term() = default;
  virtual int points() const = 0;
  virtual int numbers() const = 0;
  virtual double gradient(Places x, Numbers numbers, Gradient& gradient) const = 0;  ///< value
  virtual Hessian hessian(Places x, Numbers numbers) const = 0;
};

/// A term whose derivatives are taken automatically.
template <class Energy>
class DifferentiatedTerm final : public Term {
 public:
  int points() const override { return Energy::points; }
  int numbers() const override { return Energy::numbers; }
  double gradient(Places x, Numbers numbers, Gradient& gradient) const override {
    Eigen::Matrix<double, 3 * Energy::points, 1> slope;
    const double value = differentiate<Energy::points>(
        corners(x), [&](const auto& at) { return Energy::energy(at, numbers); }, slope);
    gradient = slope;
    return value;
  }
  Hessian hessian(Places x, Numbers numbers) const override {
    return differentiate<Energy::points>(
               corners(x), [&](const auto& at) { return Energy::energy(at, numbers); })
        .hessian;
  }

 private:
  static std::array<Vec3, Energy::points> corners(Places x) {
    std::array<Vec3, Energy::points> at;
    std::copy_n(x.begin(), Energy::points, at.begin());
    return at;
  }
};

/// Makes a term known by a name, in the program's whole run, before any model with it is solved,
/// read or checked; the same on all ranks.
void add_term(const std::string& name, std::unique_ptr<const Term> term);
template <class Energy>
void add_term(const std::string& name) {
  add_term(name, std::make_unique<DifferentiatedTerm<Energy>>());
}

/// The term of elements. InputError where it is unknown, or has other numbers of points or numbers.
const Term& term_of(const model::TermElements& elements);

/// [bones] where bones are, from the initial state on; empty: there.
using BonePoses = std::span<const Mat4>;

/// The elements of one term that touch soft tissue. Those that move with a bone have the energy of
/// their points' places in its frame.
class TermLoop {
 public:
  /// Those of a part in local numbers; elements whose first point is before `owned` count here.
  TermLoop(const model::TermElements& elements, const model::Points& points, int64_t owned);

  /// Over the counted elements, N·mm.
  double value(std::span<const Vec3> position, BonePoses poses = {}) const;
  /// Adds scale · gradient; returns the value, unscaled.
  double add_gradient(std::span<const Vec3> position, BonePoses poses, double scale,
                      std::span<Vec3> gradient) const;
  /// Calls visit(p, q, block) with p ≤ q in each element: the Hessian, or its positive semidefinite
  /// part.
  template <class Visit>
  void for_each_block(std::span<const Vec3> position, BonePoses poses, bool exact,
                      Visit&& visit) const {
    for (size_t e = 0; e < size(); ++e) {
      const Mat3 turn = pose_of(e, poses).topLeftCorner<3, 3>();
      const Eigen::MatrixXd hessian = hessian_of(e, position, poses, exact);
      for (Eigen::Index i = 0; i < term_->points(); ++i)
        for (Eigen::Index j = i; j < term_->points(); ++j)
          visit(points_of(e)[i], points_of(e)[j],
                Mat3(turn * hessian.block<3, 3>(3 * i, 3 * j) * turn.transpose()));
    }
  }
  /// Calls visit(p, q) for the points of each element, both ways.
  template <class Visit>
  void for_each_link(Visit&& visit) const {
    for (size_t e = 0; e < size(); ++e)
      for (const int32_t p : points_of(e))
        for (const int32_t q : points_of(e)) visit(p, q);
  }

 private:
  size_t size() const { return points_.size() / each_; }
  std::span<const int32_t> points_of(size_t e) const { return {points_.data() + e * each_, each_}; }
  std::span<const double> numbers_of(size_t e) const {
    return {numbers_.data() + e * term_->numbers(), static_cast<size_t>(term_->numbers())};
  }
  Mat4 pose_of(size_t e, BonePoses poses) const;
  std::vector<Vec3> places(size_t e, std::span<const Vec3> position, BonePoses poses) const;
  Eigen::MatrixXd hessian_of(size_t e, std::span<const Vec3> position, BonePoses poses,
                             bool exact) const;

  const Term* term_;
  size_t each_;
  size_t counted_ = 0;  // elements that come first
  std::vector<int32_t> points_;
  std::vector<double> numbers_;
  std::vector<int32_t> bone_;  // [elements] with which each moves, −1: none
};

}  // namespace repose::mechanics
