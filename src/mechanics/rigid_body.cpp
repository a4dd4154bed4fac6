#include "repose/mechanics/rigid_body.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <queue>

namespace repose::mechanics {

namespace {

using surface::Distance;

/// Returns the distance of a point at `from` relative to the center of a ball, or to the nearest
/// ball of a capsule with the axis `along` (0 for none).
Distance from_middle(const Vec3& from, double radius, const Vec3& along) {
  const double length = from.norm();
  if (!(length > 0)) return {-radius, Vec3::Zero(), Mat3::Zero()};
  const Vec3 n = from / length;
  const Mat3 across = Mat3::Identity() - n * n.transpose() - along * along.transpose();
  return {length - radius, n, across / length};
}

}  // namespace

Distance distance_to(const scene::Sphere& ball, const Vec3& point) {
  return from_middle(point - ball.center, ball.radius, Vec3::Zero());
}

Distance distance_to(const scene::Capsule& capsule, const Vec3& point) {
  const Vec3 axis = capsule.to - capsule.from, from = point - capsule.from;
  const double square = axis.squaredNorm();
  const double along = square > 0 ? from.dot(axis) / square : 0;
  if (along <= 0) return from_middle(from, capsule.radius, Vec3::Zero());
  if (along >= 1) return from_middle(point - capsule.to, capsule.radius, Vec3::Zero());
  return from_middle(from - along * axis, capsule.radius, axis / std::sqrt(square));
}

Distance distance_to(const scene::Box& box, const Vec3& point) {
  const Vec3 from = point - box.center, beyond = from.cwiseAbs() - box.size / 2;
  const Vec3 side = from.unaryExpr([](double v) { return v < 0 ? -1.0 : 1.0; });
  int axis = 0;
  if (const double deepest = beyond.maxCoeff(&axis); deepest <= 0)
    return {deepest, side[axis] * Vec3::Unit(axis), Mat3::Zero()};
  const Vec3 outside = beyond.cwiseMax(0.0);
  const double length = outside.norm();
  const Vec3 n = side.cwiseProduct(outside) / length;
  Mat3 across = -n * n.transpose();
  for (int a = 0; a < 3; ++a)
    if (outside[a] > 0) across(a, a) += 1;
  return {length, n, across / length};
}

Distance distance_to(const scene::HalfSpace& half, const Vec3& point) {
  const Vec3 n = half.normal.normalized();
  return {(point - half.point).dot(n), n, Mat3::Zero()};
}

Distance RigidBody::distance(const Vec3& beside) const {
  Distance d = std::visit([&](const auto& shape) { return distance_to(shape, beside); }, *shape_);
  d.gradient = rotation_ * d.gradient;
  d.curvature = rotation_ * d.curvature * rotation_.transpose();
  return d;
}

double RigidBody::lower_bound(const Vec3& beside, double enough) const {
  const auto* field = std::get_if<surface::DistanceField>(shape_.get());
  return field ? field->lower_bound(beside, enough) : distance(beside).value;
}

Distance RigidBody::outside(const Vec3& beside) const {
  const auto* field = std::get_if<surface::DistanceField>(shape_.get());
  if (!field) return distance(beside);
  Distance d = field->outside(beside);
  d.gradient = rotation_ * d.gradient;
  return d;
}

RigidBody RigidBody::rounded(double times) const {
  const auto* field = std::get_if<surface::DistanceField>(shape_.get());
  RigidBody body = *this;
  if (field) body.shape_ = std::make_shared<const Shape>(field->rounded(times));
  return body;
}

namespace {

double deepest_in(const scene::Sphere& ball, double at_most) {
  return std::min(ball.radius, at_most);
}
double deepest_in(const scene::Capsule& capsule, double at_most) {
  return std::min(capsule.radius, at_most);
}
double deepest_in(const scene::Box& box, double at_most) {
  return std::min(box.size.minCoeff() / 2, at_most);
}
double deepest_in(const scene::HalfSpace&, double at_most) { return at_most; }

/// A box of space; a point in it is at most `bound` mm deep.
struct Region {
  double bound;
  Vec3 center, half;
  bool operator<(const Region& other) const { return bound < other.bound; }
};

/// Branch and bound: a distance changes by no more than the way. Ends after `most` regions: few
/// find the depth of a plate, and only the proof that no point is deeper takes more.
double deepest_in(const surface::DistanceField& field, double at_most) {
  constexpr int most = 1 << 16;
  constexpr double near = 1.02;  // times the depth
  if (field.surface().triangles.empty()) return 0;
  Eigen::AlignedBox3d box;
  for (const Vec3& point : field.surface().points) box.extend(point);
  double deepest = 0;
  std::priority_queue<Region> regions;
  const auto add = [&](const Vec3& center, const Vec3& half) {
    const double depth = -field.value(center);
    deepest = std::max(deepest, depth);
    regions.push({depth + half.norm(), center, half});
  };
  add(box.center(), box.sizes() / 2);
  for (int n = 0; n < most && deepest < at_most && regions.top().bound > near * deepest; ++n) {
    auto [bound, center, half] = regions.top();
    regions.pop();
    int axis = 0;
    half[axis] = half.maxCoeff(&axis) / 2;
    for (const int side : {-1, 1}) add(center + side * half[axis] * Vec3::Unit(axis), half);
  }
  return std::min(deepest, at_most);
}

}  // namespace

double RigidBody::deepest(double at_most) const {
  return std::visit([&](const auto& shape) { return deepest_in(shape, at_most); }, *shape_);
}

const surface::Surface* mesh_of(const model::Model& model, const model::Body& body) {
  return body.bone >= 0 ? &model.bone_surfaces[body.bone]
                        : std::get_if<surface::Surface>(&body.shape);
}

std::vector<RigidBody> make_bodies(const model::Model& model) {
  constexpr double min_reach = 6;  // mm, more than tissue that slides keeps away
  const double spacing = model.contact.spacing, reach = std::max(min_reach, 4 * spacing);
  std::vector<RigidBody> bodies;
  for (const model::Body& body : model.contact.bodies) {
    if (const surface::Surface* mesh = mesh_of(model, body)) {
      bodies.emplace_back(surface::DistanceField(*mesh, spacing, reach), body.bone, body.push);
      continue;
    }
    bodies.push_back(std::visit(
        [&](const auto& shape) {
          if constexpr (std::is_same_v<std::decay_t<decltype(shape)>, surface::Surface>)
            return RigidBody(surface::DistanceField(), -1, body.push);
          else
            return RigidBody(shape, -1, body.push);
        },
        body.shape));
  }
  return bodies;
}

std::vector<double> contact_offsets(const model::Model& model,
                                    const std::vector<RigidBody>& bodies) {
  const model::ContactPairs& pairs = model.contact.pairs;
  std::vector<double> offset(pairs.point.size());
  for (size_t c = 0; c < offset.size(); ++c) {
    const RigidBody& body = bodies[pairs.body[c]];
    const Vec3 beside = body.beside(model.points.position[pairs.point[c]]);
    if (pairs.binding[c] == model::Binding::slides)
      offset[c] = body.distance(beside).value;
    else if (body.lower_bound(beside, 0) < 0)
      offset[c] = std::min(0.0, body.distance(beside).value);
  }
  return offset;
}

}  // namespace repose::mechanics
