#include "repose/mechanics/rigid_body.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "repose/model/motion.h"

namespace repose::mechanics {

namespace {

using surface::Distance;

/// Of a point `from` beside the middle of a ball, or of the nearest ball of a capsule with the axis
/// `along` (0 for none).
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

double RigidBody::reach() const {
  const auto* field = std::get_if<surface::DistanceField>(shape_.get());
  return field ? field->reach() : std::numeric_limits<double>::infinity();
}

namespace {

/// mm outside a body up to which distances are known, and how near to points.
struct Extent {
  double reach, near;
};

Extent extent_of(const model::Contact& contact, double travel) {
  constexpr double least_reach = 6;  // more than tissue that slides keeps away
  constexpr double margin = 10;      // besides the way that bones go
  return {std::max(least_reach, 4 * contact.spacing), travel + margin};
}

/// The mesh of a body, if it has one.
const surface::Surface* mesh_of(const model::Model& model, const model::Body& body) {
  return body.bone >= 0 ? &model.bone_surfaces[body.bone]
                        : std::get_if<surface::Surface>(&body.shape);
}

}  // namespace

std::vector<std::vector<char>> wanted_blocks(const model::Model& model, double travel) {
  const model::Contact& contact = model.contact;
  const Extent extent = extent_of(contact, travel);
  std::vector<std::vector<Vec3>> points(contact.bodies.size());
  for (size_t c = 0; c < contact.touches.point.size(); ++c)
    points[contact.touches.body[c]].push_back(model.points.position[contact.touches.point[c]]);
  std::vector<std::vector<char>> wanted(contact.bodies.size());
  for (size_t k = 0; k < wanted.size(); ++k)
    if (const surface::Surface* mesh = mesh_of(model, contact.bodies[k]))
      wanted[k] = surface::DistanceField::blocks_near(*mesh, contact.spacing, extent.reach,
                                                      points[k], extent.near);
  return wanted;
}

std::vector<RigidBody> make_bodies(const model::Model& model, double travel,
                                   const std::vector<std::vector<char>>& wanted) {
  const model::Contact& contact = model.contact;
  const Extent extent = extent_of(contact, travel);
  std::vector<RigidBody> bodies;
  for (size_t k = 0; k < contact.bodies.size(); ++k) {
    const model::Body& body = contact.bodies[k];
    if (const surface::Surface* mesh = mesh_of(model, body)) {
      bodies.emplace_back(
          surface::DistanceField(*mesh, contact.spacing, extent.reach, wanted[k], extent.near),
          body.bone, body.push);
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

std::vector<RigidBody> make_bodies(const model::Model& model) {
  const double travel = model::PrescribedMotion(model).largest_travel(model);
  return make_bodies(model, travel, wanted_blocks(model, travel));
}

std::vector<double> touch_offsets(const model::Model& model, const std::vector<RigidBody>& bodies) {
  const model::Touches& touches = model.contact.touches;
  std::vector<double> offset(touches.point.size());
  for (size_t c = 0; c < offset.size(); ++c) {
    const RigidBody& body = bodies[touches.body[c]];
    const double initial =
        body.distance(body.beside(model.points.position[touches.point[c]])).value;
    offset[c] = touches.binding[c] == model::Binding::slides ? initial : std::min(0.0, initial);
  }
  return offset;
}

}  // namespace repose::mechanics
