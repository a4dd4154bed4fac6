#include "repose/tools/registration/register.h"

#include <Eigen/LU>
#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <cmath>

#include "repose/base/error.h"
#include "repose/surface/edges.h"
#include "repose/surface/triangle_tree.h"

namespace repose::tools::registration {
using namespace surface;
namespace {

constexpr double level = 1e-3;  ///< of the test for a bad landmark, over all

double squared(double x) { return x * x; }

/// Landmarks in use, and what the rest of them say of each.
class Fitter {
 public:
  Fitter(const std::vector<Vec3>& moving, const std::vector<Vec3>& fixed, bool with_scale)
      : moving_(moving), fixed_(fixed), with_scale_(with_scale), used_(moving.size(), true) {}

  const std::vector<bool>& used() const { return used_; }
  int64_t count() const { return std::count(used_.begin(), used_.end(), true); }
  void leave_out(size_t i) { used_[i] = false; }

  /// The fit of those in use but `i`; none: all in use.
  Similarity fit_without(size_t i) const {
    const auto [x, y] = without(i);
    return base::fit_similarity(x, y, with_scale_);
  }

  bool can_predict(size_t i) const {
    const auto x = without(i).first;
    return x.size() >= 3 && base::breadth(x) > min_breadth;
  }

  double error(const Similarity& fit, size_t i) const {
    return (fit.apply(moving_[i]) - fixed_[i]).norm();
  }

  double rms(const Similarity& fit) const {
    double sum = 0;
    for (size_t i = 0; i < used_.size(); ++i)
      if (used_[i]) sum += squared(error(fit, i));
    return std::sqrt(sum / static_cast<double>(count()));
  }

  /// The error that the others predict for `i`, over what their scatter allows: > 1 is bad.
  double suspicion(size_t i) const {
    const auto [x, y] = without(i);
    const int freedom = static_cast<int>(3 * x.size()) - (with_scale_ ? 7 : 6);
    if (!can_predict(i) || freedom < 1) return 0;
    const Similarity fit = base::fit_similarity(x, y, with_scale_);
    double sum = 0;
    for (size_t k = 0; k < x.size(); ++k) sum += (fit.apply(x[k]) - y[k]).squaredNorm();
    const double variance = std::max(sum / freedom, squared(1e-9 * extent()));
    const double f = squared(error(fit, i)) / (3 * variance * inflation(x, moving_[i]));
    const boost::math::fisher_f law(3, freedom);
    const double share = level / static_cast<double>(count());
    return f / boost::math::quantile(boost::math::complement(law, share));
  }

 private:
  std::pair<std::vector<Vec3>, std::vector<Vec3>> without(size_t i) const {
    std::pair<std::vector<Vec3>, std::vector<Vec3>> rest;
    for (size_t k = 0; k < used_.size(); ++k)
      if (used_[k] && k != i) {
        rest.first.push_back(moving_[k]);
        rest.second.push_back(fixed_[k]);
      }
    return rest;
  }

  double extent() const { return bounding_diagonal(fixed_); }

  /// Variance of a predicted position over that of one landmark, mean of the axes: its own, that of
  /// the shift, and that of the turn, Cov ω = J⁻¹ with J = Σ |q|² I − q qᵀ.
  static double inflation(const std::vector<Vec3>& x, const Vec3& point) {
    Vec3 mean = Vec3::Zero();
    for (const Vec3& p : x) mean += p / static_cast<double>(x.size());
    Mat3 inertia = Mat3::Zero();
    for (const Vec3& p : x) {
      const Vec3 q = p - mean;
      inertia += q.squaredNorm() * Mat3::Identity() - q * q.transpose();
    }
    const Vec3 q = point - mean;
    Mat3 cross;
    cross << 0, -q.z(), q.y(), q.z(), 0, -q.x(), -q.y(), q.x(), 0;
    const double turn = (cross * inertia.inverse() * cross.transpose()).trace() / 3;
    return 1 + 1 / static_cast<double>(x.size()) + turn;
  }

  const std::vector<Vec3>&moving_, &fixed_;
  bool with_scale_;
  std::vector<bool> used_;
};

constexpr size_t none = static_cast<size_t>(-1);

void check_breadth(const std::vector<Vec3>& points, const char* which) {
  const double found = base::breadth(points);
  if (!(found > min_breadth))
    base::refuse(
        "the {} landmarks lie on a line (breadth {:.2g} of their length, more than {:g} needed), "
        "which leaves the turn about it open; add one beside the line",
        which, found, min_breadth);
}

/// Refuses sets whose median ratio of distances between two landmarks is that of other units.
void check_sizes(const std::vector<Vec3>& moving, const std::vector<Vec3>& fixed) {
  std::vector<double> ratios;
  for (size_t i = 0; i < moving.size(); ++i)
    for (size_t k = 0; k < i; ++k)
      if (moving[i] != moving[k])
        ratios.push_back((fixed[i] - fixed[k]).norm() / (moving[i] - moving[k]).norm());
  const double ratio = base::median(std::move(ratios));
  if (ratio >= 1 / max_size_ratio && ratio <= max_size_ratio) return;
  base::refuse(
      "the fixed landmarks lie {:.4g} times as far apart as the moving ones, expected {:g} to {:g} "
      "times: one of the two sets is not in mm; scale it and its mesh to mm (repose-register "
      "-similarity fits the scale)",
      ratio, 1 / max_size_ratio, max_size_ratio);
}

std::vector<double> distances(const std::vector<Vec3>& points, const Surface& surface,
                              double scale) {
  const TriangleTree tree(surface);
  std::vector<double> result;
  for (const Vec3& point : points) result.push_back(scale * std::sqrt(tree.nearest(point).squared));
  return result;
}

}  // namespace

LandmarkFit fit_landmarks(const std::vector<Vec3>& moving, const std::vector<Vec3>& fixed,
                          bool with_scale) {
  const size_t n = moving.size();
  if (n < 3)
    base::refuse("{} landmark(s) in common; a rigid transform needs three that are not on a line",
                 n);
  check_breadth(moving, "moving");
  check_breadth(fixed, "fixed");
  if (!with_scale) check_sizes(moving, fixed);
  Fitter fitter(moving, fixed, with_scale);
  LandmarkFit result;
  result.can_be_checked = n >= 4;
  result.rms_all = fitter.rms(fitter.fit_without(none));
  result.rms_mirrored =
      fitter.rms(base::fit_similarity(moving, fixed, with_scale, base::Handedness::mirrored));
  const int64_t minimum = n == 4 ? 3 : 4;
  for (size_t out = 0; out < std::max<size_t>(n / 3, 1) && fitter.count() > minimum; ++out) {
    std::vector<double> suspicion(n, 0);
    for (size_t i = 0; i < n; ++i)
      if (fitter.used()[i]) suspicion[i] = fitter.suspicion(i);
    const auto worst = std::max_element(suspicion.begin(), suspicion.end());
    if (!(*worst > 1)) break;
    fitter.leave_out(worst - suspicion.begin());
  }
  result.transform = fitter.fit_without(none);
  result.rms = fitter.rms(result.transform);
  for (size_t i = 0; i < n; ++i) {
    result.left_out.push_back(!fitter.used()[i]);
    result.residual.push_back(fitter.error(result.transform, i));
    result.predicted.push_back(fitter.can_predict(i) ? fitter.error(fitter.fit_without(i), i)
                                                     : NAN);
  }
  return result;
}

std::string remark_on_distance(const std::vector<std::string>& names,
                               const std::vector<Vec3>& on_moving, const Surface& moving,
                               const std::vector<Vec3>& on_fixed, const Surface& fixed,
                               double scale) {
  constexpr double limit = 15;  // mm
  const std::vector<double> from_moving = distances(on_moving, moving, scale),
                            from_fixed = distances(on_fixed, fixed, 1);
  size_t worst = 0;
  const auto difference = [&](size_t i) { return std::abs(from_moving[i] - from_fixed[i]); };
  for (size_t i = 1; i < names.size(); ++i)
    if (difference(i) > difference(worst)) worst = i;
  if (difference(worst) <= limit && base::median(from_moving) <= limit &&
      base::median(from_fixed) <= limit)
    return "";
  return fmt::format(
      "landmark {} lies {:.4g} mm from {} and {:.4g} mm from {}: landmarks seem to be of another "
      "scan, frame (RAS or LPS) or unit than their mesh; give those of the mesh, in mm",
      names[worst], from_moving[worst], moving.name, from_fixed[worst], fixed.name);
}

Surface moved(const Surface& surface, const Similarity& transform) {
  Surface result = surface;
  for (Vec3& point : result.points) point = transform.apply(point);
  return result;
}

}  // namespace repose::tools::registration
