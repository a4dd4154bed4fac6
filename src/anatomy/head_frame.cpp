#include "repose/anatomy/head_frame.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "repose/surface/distance.h"

namespace repose::anatomy {
namespace {

constexpr size_t samples = 3000, coarse_samples = 300;
constexpr int rounds = 60;
constexpr double kept = 0.67;  // share of pairs that a round fits

/// A plane by a unit normal that points left, and a point.
struct Plane {
  Vec3 normal, point;

  Vec3 mirrored(const Vec3& x) const { return x - 2 * normal.dot(x - point) * normal; }
};

std::vector<Vec3> thinned(const std::vector<Vec3>& points, size_t number) {
  std::vector<Vec3> chosen;
  const size_t step = 1 + points.size() / number;
  for (size_t i = 0; i < points.size(); i += step) chosen.push_back(points[i]);
  return chosen;
}

/// A point, the vertex nearest to its mirror image, and how far, mm, they are apart.
struct Pair {
  Vec3 point, partner;
  double off;
};

/// The pairs that are nearest to each other, a fixed share of all.
std::vector<Pair> nearest_pairs(const Plane& plane, const std::vector<Vec3>& chosen,
                                const std::vector<Vec3>& points, const surface::PointTree& tree) {
  std::vector<Pair> pairs;
  for (const Vec3& p : chosen) {
    const Vec3 image = plane.mirrored(p);
    const Vec3& partner = points[tree.nearest(image)];
    pairs.push_back({p, partner, (partner - image).norm()});
  }
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) { return a.off < b.off; });
  pairs.resize(std::max<size_t>(3, static_cast<size_t>(kept * static_cast<double>(pairs.size()))));
  return pairs;
}

/// The best of planes through `middle`, yawed and rolled by up to 20° in steps of 4°.
Plane first_plane(const Vec3& middle, const std::vector<Vec3>& points,
                  const surface::PointTree& tree) {
  constexpr double maximum = 20, step = 4, degree = 0.017453292519943295;
  const std::vector<Vec3> few = thinned(points, coarse_samples);
  Plane best{Vec3::UnitX(), middle};
  double minimum = INFINITY;
  for (double yaw = -maximum; yaw <= maximum; yaw += step)
    for (double roll = -maximum; roll <= maximum; roll += step) {
      const Plane plane{Vec3(1, std::tan(degree * yaw), std::tan(degree * roll)).normalized(),
                        middle};
      double sum = 0;
      for (const Pair& pair : nearest_pairs(plane, few, points, tree)) sum += pair.off;
      if (!(sum < minimum)) continue;
      minimum = sum;
      best = plane;
    }
  return best;
}

/// The plane that mirrors the first of each pair onto the second with the least squares.
Plane plane_of(const std::vector<Pair>& pairs) {
  std::vector<Vec3> moving, fixed;
  Vec3 middle = Vec3::Zero();
  for (const Pair& pair : pairs) {
    moving.push_back(pair.point);
    fixed.push_back(pair.partner);
    middle += (pair.point + pair.partner) / (2.0 * static_cast<double>(pairs.size()));
  }
  const Mat3 turn = base::fit_similarity(moving, fixed, false, base::Handedness::mirrored).rotation;
  const Eigen::SelfAdjointEigenSolver<Mat3> axes((turn + turn.transpose()) / 2);
  Vec3 normal = axes.eigenvectors().col(0);  // eigenvalue −1
  if (normal.x() < 0) normal = -normal;
  return {normal, middle};
}

Plane fit_plane(const surface::Surface& skull) {
  const std::vector<Vec3> chosen = thinned(skull.points, samples);
  const surface::PointTree tree(skull.points);
  Vec3 middle = Vec3::Zero();
  for (const Vec3& p : chosen) middle += p / static_cast<double>(chosen.size());
  Plane plane = first_plane(middle, skull.points, tree);
  for (int round = 0; round < rounds; ++round) {
    const Plane next = plane_of(nearest_pairs(plane, chosen, skull.points, tree));
    const double change = (next.normal - plane.normal).norm() +
                          0.01 * std::abs(next.normal.dot(next.point - plane.point));
    plane = next;
    if (change < 1e-5) break;
  }
  return plane;
}

}  // namespace

HeadFrame HeadFrame::upright(const Vec3& low, const Vec3& high) const {
  const Vec3 along = axes * (high - low);
  const double angle = std::atan2(along.y(), along.z());
  HeadFrame turned = *this;
  turned.axes = Eigen::AngleAxisd(angle, Vec3::UnitX()).toRotationMatrix() * axes;
  return turned;
}

HeadFrame fit_head_frame(const surface::Surface& skull) {
  const Plane plane = fit_plane(skull);
  const Vec3 left = plane.normal;
  const Vec3 back = (Vec3::UnitY() - left.y() * left).normalized();
  HeadFrame frame;
  frame.axes.row(0) = left.transpose();
  frame.axes.row(1) = back.transpose();
  frame.axes.row(2) = left.cross(back).transpose();
  frame.origin = plane.point;
  return frame;
}

}  // namespace repose::anatomy
