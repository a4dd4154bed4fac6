#include "repose/anatomy/head_frame.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <map>
#include <numbers>

#include "repose/base/error.h"
#include "repose/surface/component.h"
#include "repose/surface/edges.h"
#include "repose/surface/triangle_tree.h"
#include "search.h"

namespace repose::anatomy {
namespace {

/// A plane by a unit normal, of either sign, and a point.
struct Plane {
  Vec3 normal, point;

  Vec3 mirrored(const Vec3& x) const { return x - 2 * normal.dot(x - point) * normal; }
  /// The part of a direction that is parallel to the plane.
  Vec3 within(const Vec3& way) const { return way - normal.dot(way) * normal; }
};

/// The point nearest to the center of each cell of a grid, whatever the order of the points.
std::vector<Vec3> nearest_to_centers(const std::vector<Vec3>& points, const Vec3& low,
                                     double size) {
  struct Chosen {
    double squared;
    std::array<double, 3> place;
    auto operator<=>(const Chosen&) const = default;
  };
  std::map<std::array<double, 3>, Chosen> cells;
  for (const Vec3& p : points) {
    const Vec3 cell = ((p - low) / size).array().floor();
    const Chosen candidate{((p - low) / size - cell - Vec3::Constant(0.5)).squaredNorm(),
                           {p.x(), p.y(), p.z()}};
    const auto [place, fresh] = cells.try_emplace({cell.x(), cell.y(), cell.z()}, candidate);
    if (!fresh && candidate < place->second) place->second = candidate;
  }
  std::vector<Vec3> chosen;
  for (const auto& [cell, nearest] : cells) chosen.emplace_back(nearest.place.data());
  return chosen;
}

/// At most `number` points, by the finest grid that holds no more.
std::vector<Vec3> thinned(const std::vector<Vec3>& points, size_t number) {
  constexpr int finest = 40;
  if (points.size() <= number) return points;
  const Eigen::AlignedBox3d box = surface::bounding_box(points);
  double size = box.sizes().maxCoeff();
  std::vector<Vec3> chosen;
  for (int level = 0; level < finest && size > 0; ++level, size /= std::numbers::sqrt2) {
    std::vector<Vec3> finer = nearest_to_centers(points, box.min(), size);
    if (finer.size() > number) break;
    chosen = std::move(finer);
  }
  return chosen;
}

/// The vertices of a surface, with a third of the areas of the triangles around.
surface::Samples vertices(const surface::Surface& surface) {
  surface::Samples samples{surface.points, std::vector<double>(surface.points.size())};
  for (const Triangle& t : surface.triangles) {
    const auto [a, b, c] = surface::corners(surface, t);
    for (const int64_t corner : t) samples.area[corner] += (b - a).cross(c - a).norm() / 6;
  }
  return samples;
}

/// The mirror image of a skull in a plane, compared with the skull: Σ a d²/(1 + d²/s²) over points
/// of areas a, d mm from their image to the surface, so that points without a partner hardly count.
class MirrorFit {
 public:
  MirrorFit(const surface::TriangleTree& tree, const surface::Samples& points, double scale)
      : tree_(tree), points_(points), scale_(scale) {}

  double off(const Plane& plane) const {
    double sum = 0;
    for (size_t i = 0; i < points_.point.size(); ++i) {
      const double squared = tree_.nearest(plane.mirrored(points_.point[i])).squared;
      sum += points_.area[i] * squared / (1 + squared / (scale_ * scale_));
    }
    return sum;
  }
  Plane next(const Plane& plane) const;

 private:
  const surface::TriangleTree& tree_;
  const surface::Samples& points_;
  double scale_;
};

/// The plane after a step of reweighted Gauss-Newton.
Plane MirrorFit::next(const Plane& plane) const {
  const Vec3 n = plane.normal, a = n.unitOrthogonal(), b = n.cross(a);
  Mat3 matrix = Mat3::Zero();
  Vec3 right = Vec3::Zero();
  for (size_t i = 0; i < points_.point.size(); ++i) {
    const Vec3& p = points_.point[i];
    const Vec3 image = plane.mirrored(p), way = image - tree_.nearest(image).point;
    const double d = way.norm();
    if (d == 0) continue;
    const Vec3 u = way / d, arm = p - plane.point;
    const auto turned = [&](const Vec3& axis) {
      return -2 * (u.dot(n) * arm.dot(axis) + u.dot(axis) * arm.dot(n));
    };
    const Vec3 row(turned(a), turned(b), 2 * u.dot(n));
    const double root = 1 + d * d / (scale_ * scale_), weight = points_.area[i] / (root * root);
    matrix += weight * row * row.transpose();
    right -= weight * d * row;
  }
  const Vec3 step = matrix.ldlt().solve(right);
  return {(n + step.x() * a + step.y() * b).normalized(), plane.point + step.z() * n};
}

/// A plane, and how far off the mirror image lies, mm².
struct Fit {
  Plane plane;
  double off;
};

std::vector<Fit> best_of(std::vector<Fit> fits, size_t number) {
  std::ranges::sort(fits, {}, &Fit::off);
  fits.resize(std::min(number, fits.size()));
  return fits;
}

/// Planes through the middle of points, with normals some 7° apart over half of the sphere.
std::vector<Fit> first_planes(const Vec3& middle, const MirrorFit& fit) {
  constexpr int directions = 400;
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  std::vector<Fit> fits;
  for (int i = 0; i < directions; ++i) {
    const double x = 1 - (i + 0.5) / directions, radius = std::sqrt(1 - x * x);
    const Plane plane{Vec3(x, radius * std::cos(golden * i), radius * std::sin(golden * i)),
                      middle};
    fits.push_back({plane, fit.off(plane)});
  }
  return fits;
}

/// Ends where a step turns the plane by less than `end` radians and moves it by less than 100 times
/// that in mm.
Fit refine(Plane plane, const MirrorFit& fit, double end = 1e-5) {
  constexpr int rounds = 60;
  for (int round = 0; round < rounds; ++round) {
    const Plane next = fit.next(plane);
    const double change = next.normal.cross(plane.normal).norm() +
                          0.01 * std::abs(next.normal.dot(next.point - plane.point));
    plane = next;
    if (change < end) break;
  }
  return {plane, fit.off(plane)};
}

/// Many directions are tried on few points, the best planes refined on more, and the best of these
/// on vertices, which turn with a head, or on so many points that a turned head, which the grid
/// meets otherwise, has the same plane: first with the broad scale, of one minimum, then with that
/// which leaves out what is not symmetric.
Plane fit_plane(const surface::Surface& skull) {
  constexpr double spacing = 2;  // mm
  constexpr size_t most = 40000;
  const surface::TriangleTree tree(skull);
  const std::vector<Vec3> spread = surface::sample(skull, spacing).point;
  const auto evenly = [&](size_t number) {
    const std::vector<Vec3> points = thinned(spread, number);
    return surface::Samples{points, std::vector<double>(points.size(), 1.0)};
  };
  const surface::Samples few = evenly(300), more = evenly(3000),
                         many = skull.points.size() <= most ? vertices(skull) : evenly(most);
  const MirrorFit coarse(tree, few, 10), fine(tree, more, 5), broad(tree, many, 5),
      finest(tree, many, 2);
  std::vector<Fit> fits = best_of(first_planes(base::mean(few.point), coarse), 12);
  for (Fit& fit : fits) fit = refine(fit.plane, coarse);
  fits = best_of(std::move(fits), 3);
  for (Fit& fit : fits) fit = refine(fit.plane, fine);
  const Plane best = best_of(std::move(fits), 1).front().plane;
  return refine(refine(best, broad, 1e-4).plane, finest).plane;
}

/// The middles of the symphysis, near the plane, and of both rami, the parts farthest from it.
std::array<Vec3, 2> symphysis_and_rami(const surface::Surface& mandible, const Plane& plane) {
  constexpr double near = 6, beside = 0.7;  // mm; share of the largest distance
  const auto off = [&](const Vec3& p) { return std::abs(plane.normal.dot(p - plane.point)); };
  double reach = 0;
  for (const Vec3& p : mandible.points) reach = std::max(reach, off(p));
  std::vector<Vec3> symphysis, rami;
  for (const Vec3& p : mandible.points) {
    if (off(p) < near) symphysis.push_back(p);
    if (off(p) > beside * reach) rami.push_back(p);
  }
  if (symphysis.empty())
    base::refuse(
        "{}: has no point within {:g} mm of the skull's midsagittal plane; give surfaces of one "
        "head in one frame",
        mandible.name, near);
  return {base::mean(symphysis), base::mean(rami)};
}

}  // namespace

HeadFrame HeadFrame::upright(const Vec3& low, const Vec3& high) const {
  const Vec3 along = axes * (high - low);
  const double angle = std::atan2(along.y(), along.z());
  HeadFrame turned = *this;
  turned.axes = Eigen::AngleAxisd(angle, Vec3::UnitX()).toRotationMatrix() * axes;
  return turned;
}

Vec3 fit_midsagittal_normal(const surface::Surface& bones) {
  const Vec3 normal = fit_plane(bones).normal;
  return normal.x() < 0 ? Vec3(-normal) : normal;
}

HeadFrame fit_head_frame(const surface::Surface& skull, const surface::Surface& mandible) {
  constexpr double rise = 22 * std::numbers::pi / 180;  // of the way from symphysis to rami
  const Plane plane = fit_plane(skull);
  const auto [symphysis, rami] = symphysis_and_rami(mandible, plane);
  const Vec3 way = plane.within(rami - symphysis).normalized(),
             above = plane.within(base::mean(skull.points) - (symphysis + rami) / 2);
  Mat3 axes;
  axes.row(1) = way;
  axes.row(2) = (above - above.dot(way) * way).normalized();
  axes.row(0) = axes.row(1).cross(axes.row(2));
  return {Eigen::AngleAxisd(rise, Vec3::UnitX()).toRotationMatrix() * axes, plane.point};
}

}  // namespace repose::anatomy
