#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "repose/mechanics/contact.h"

namespace repose::mechanics {

/// A uniform cubic B-spline's weights at one parameter: of value, slope and second derivative, of
/// at most four controls. Beyond its ends the spline goes on straight.
struct SplineWeights {
  int first = 0, count = 0;
  std::array<std::array<double, 4>, 3> of = {};  ///< [derivative][control − first]
};
SplineWeights spline_weights(double at, int controls);

/// The sides of cuts against one another: places of one side, the other as a bicubic B-spline
/// surface through which they do not pass (docs/theory/contact.md). The gap is the signed distance
/// to the surface where it is now, so that all of it is a function of the positions alone.
class CutFaceContact {
 public:
  CutFaceContact() = default;
  CutFaceContact(const model::CutFaces& cut_faces, double stiffness);  ///< with local point numbers
  void set_stiffness(double stiffness) { stiffness_ = stiffness; }
  std::span<const double> multipliers() const { return multiplier_; }  ///< [W] N/mm²
  void set_multipliers(std::span<const double> p) { multiplier_.assign(p.begin(), p.end()); }

  /// Adds scale · gradient; returns the value, N·mm, unscaled.
  double add_gradient(std::span<const Vec3> position, double scale, std::span<Vec3> gradient);
  /// Finds the feet of all places, for all functions below.
  void update_gaps(std::span<const Vec3> position);
  /// Calls visit(p, q, block) for every two points of each place that acts, p before q or the same,
  /// at the latest update: the Hessian, or a semidefinite relative.
  template <class Visit>
  void for_each_block(bool exact, Visit&& visit) const {
    for (size_t w = 0; w < places_.size(); ++w) {
      if (!acts(w)) continue;
      if (exact)
        visit_blocks(w, bilinear(w, now(w)), visit);
      else
        visit_products(lumped(w), places_[w].area * stiffness_, visit);
    }
  }
  /// The gaps below `reach` mm at the latest update, to first order.
  std::vector<LinearGap> linear_gaps(double reach) const;
  /// Calls visit(p, q, block) for the curvature −a p ∂²g of the multipliers at the latest update.
  template <class Visit>
  void for_each_curvature(std::span<const LinearGap> gaps, Visit&& visit) const {
    for (const LinearGap& g : gaps)
      if (const double p = multiplier_[g.constraint]; p != 0)
        visit_blocks(g.constraint, bilinear(g.constraint, {0, p, 0}), visit);
  }
  /// Points that may come to face each other, one before the other, sorted.
  std::span<const std::array<int32_t, 2>> links() const { return links_; }
  /// Gaps (mm; where nothing is opposite the distance) and pressures p − k g (N/mm²) at the latest
  /// update.
  double gap(size_t w) const { return feet_[w].gap; }
  double pressure(size_t w) const { return now(w).pressure; }
  const Vec3& normal(size_t w) const { return feet_[w].normal; }  ///< out of the other side
  double area(size_t w) const { return places_[w].area; }         ///< mm²
  int64_t point(size_t w) const { return places_[w].point; }  ///< the point nearest to the place
  size_t size() const { return places_.size(); }              ///< W

 private:
  using Share = std::pair<int32_t, double>;
  /// A point's part in ∂g, T_1·∂r, T_2·∂r, n·∂r_,1 and n·∂r_,2, r = place − foot, as columns.
  using Touched = std::pair<int32_t, Eigen::Matrix<double, 3, 5>>;
  struct Net {
    /// Parameters at the surface's ends, beyond which nothing is opposite: a column farther than
    /// the net along the cut, the last rows inwards.
    static Eigen::Vector2d begin() { return {-1, 0}; }
    Eigen::Vector2d end() const { return {columns, rows - 1}; }

    int columns, rows;
    std::vector<std::vector<Share>> controls;  // column by column
  };
  struct Place {
    size_t net;  // the other side
    int64_t point;
    double area;
    std::vector<Share> shares;
    int column, row;  // of its own net
  };
  /// A net's surface around one place on it, and its derivatives along the cut and inwards.
  struct Patch {
    Patch() = default;
    Patch(const Net& net, const Eigen::Vector2d& at);  ///< weights alone
    Patch(const Net& net, const std::vector<Vec3>& controls, const Eigen::Vector2d& at);
    /// Calls visit(control, weight) for a derivative of the surface.
    template <class Visit>
    void for_each(int d_along, int d_inwards, Visit&& visit) const {
      for (int i = 0; i < along.count; ++i)
        for (int j = 0; j < inwards.count; ++j)
          visit((along.first + i) * rows + inwards.first + j,
                along.of[d_along][i] * inwards.of[d_inwards][j]);
    }
    Vec3 sum(const std::vector<Vec3>& controls, int d_along, int d_inwards) const;
    Eigen::Matrix2d metric() const;
    Eigen::Matrix2d bend(const Vec3& offset) const;  ///< second derivatives in a direction

    int rows = 0;
    SplineWeights along, inwards;
    Vec3 point, first, second, first_first, first_second, second_second;
  };
  /// A net's surface at places `step` apart, up to its ends.
  struct Samples {
    Samples() = default;
    Samples(const Net& net, const std::vector<Vec3>& controls);
    /// Returns where samples are nearer to a point than those around, but for far ones.
    std::vector<Eigen::Vector2d> near(const Vec3& at) const;

    static constexpr double step = 0.5;  // of a patch
    int columns = 0, rows = 0;
    std::vector<Vec3> point;
  };
  struct Foot {
    Patch patch;
    Vec3 normal = Vec3::Zero();
    double gap = 0;
    bool opposite = false;  // the surface is, not its end
  };

  Pressing now(size_t w) const;
  bool acts(size_t w) const { return now(w).stiffness > 0; }
  void add_net(const model::CutFaces& cut_faces, size_t cut, size_t first);
  void add_place(int64_t point, double area, const Eigen::Vector2d& at);
  void link(const Net& own, const Net& other);
  std::vector<Touched> touched(size_t w) const;  // of a place that acts, by point
  using Form = Eigen::Matrix<double, 5, 5>;
  Form bilinear(size_t w, const Pressing& pressing) const;
  LinearGap::Gradient lumped(size_t w) const;
  /// The blocks of a form in the columns of Touched.
  template <class Visit>
  void visit_blocks(size_t w, const Form& form, Visit&& visit) const {
    const std::vector<Touched> points = touched(w);
    for (size_t i = 0; i < points.size(); ++i)
      for (size_t j = i; j < points.size(); ++j) {
        const auto& [p, at_p] = points[i];
        const auto& [q, at_q] = points[j];
        visit(p, q, Mat3(at_p * form * at_q.transpose()));
      }
  }

  double stiffness_ = 1;
  std::vector<Net> nets_;
  std::vector<Place> places_;
  std::vector<double> multiplier_;
  std::vector<Foot> feet_;
  std::vector<std::vector<Vec3>> means_;  // mm, that feet_ follow from: [nets][controls], [places]
  std::vector<std::array<int32_t, 2>> links_;
};

}  // namespace repose::mechanics
