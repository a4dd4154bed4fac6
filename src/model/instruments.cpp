#include "repose/model/instruments.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "repose/base/error.h"
#include "repose/surface/defects.h"
#include "repose/surface/read.h"

namespace repose::model {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

std::optional<Stretch> line_and(const scene::Sphere& ball, const Vec3& p, const Vec3& d) {
  const Vec3 from = p - ball.center;
  const double middle = -from.dot(d),
               room = ball.radius * ball.radius - (from + middle * d).squaredNorm();
  if (room < 0) return {};
  return Stretch{middle - std::sqrt(room), middle + std::sqrt(room)};
}

/// The part of a line between two values of an affine function a + b t.
std::optional<Stretch> between(double a, double b, double low, double high) {
  if (b == 0)
    return a >= low && a <= high ? std::optional(Stretch{-infinite, infinite}) : std::nullopt;
  const double one = (low - a) / b, other = (high - a) / b;
  return Stretch{std::min(one, other), std::max(one, other)};
}

std::optional<Stretch> common(const std::optional<Stretch>& a, const std::optional<Stretch>& b) {
  if (!a || !b) return {};
  const Stretch both{std::max(a->enter, b->enter), std::min(a->leave, b->leave)};
  return both.enter <= both.leave ? std::optional(both) : std::nullopt;
}

/// The round side of a capsule between its ends.
std::optional<Stretch> line_and_side(const scene::Capsule& capsule, const Vec3& p, const Vec3& d) {
  const Vec3 axis = capsule.to - capsule.from, u = axis.normalized(), from = p - capsule.from;
  const Vec3 across = d - d.dot(u) * u, off = from - from.dot(u) * u;
  const auto length = between(from.dot(u), d.dot(u), 0, axis.norm());
  const double square = across.squaredNorm(), radius = capsule.radius;
  if (!(square > 1e-24)) return off.norm() <= radius ? length : std::nullopt;
  const double middle = -off.dot(across) / square,
               room = radius * radius - (off + middle * across).squaredNorm();
  if (room < 0) return {};
  const double half = std::sqrt(room / square);
  return common(length, Stretch{middle - half, middle + half});
}

/// A capsule is convex: all parts of the line in its ends and its side are one.
std::optional<Stretch> line_and(const scene::Capsule& capsule, const Vec3& p, const Vec3& d) {
  std::optional<Stretch> whole;
  const auto join = [&](const std::optional<Stretch>& part) {
    if (!part) return;
    whole = whole
                ? Stretch{std::min(whole->enter, part->enter), std::max(whole->leave, part->leave)}
                : *part;
  };
  join(line_and(scene::Sphere{capsule.from, capsule.radius}, p, d));
  join(line_and(scene::Sphere{capsule.to, capsule.radius}, p, d));
  if ((capsule.to - capsule.from).norm() > 0) join(line_and_side(capsule, p, d));
  return whole;
}

std::optional<Stretch> line_and(const scene::Box& box, const Vec3& p, const Vec3& d) {
  std::optional<Stretch> inside = Stretch{-infinite, infinite};
  for (int axis = 0; axis < 3; ++axis)
    inside = common(inside, between(p[axis] - box.center[axis], d[axis], -box.size[axis] / 2,
                                    box.size[axis] / 2));
  return inside;
}

std::optional<Stretch> line_and(const scene::HalfSpace& half, const Vec3& p, const Vec3& d) {
  const double height = (p - half.point).dot(half.normal), rise = d.dot(half.normal);
  return Stretch{-infinite, -height / rise};
}

}  // namespace

surface::Surface read_body(const scene::ClosedMesh& mesh) {
  surface::Surface body = surface::weld_and_orient(surface::read_surface(mesh.file));
  if (const surface::Defects d = surface::inspect(body, false); !d.outward)
    base::refuse("{}: an instrument must be a closed surface; it is {}", mesh.file.string(),
                 surface::describe(d));
  return body;
}

PushedShape::PushedShape(const scene::Instrument& instrument)
    : instrument_(instrument), direction_(instrument.push.normalized()) {
  if (const auto* mesh = std::get_if<scene::ClosedMesh>(&instrument.shape))
    mesh_.emplace(read_body(*mesh));
  if (const auto* half = std::get_if<scene::HalfSpace>(&instrument.shape))
    if (!(half->normal.dot(instrument.push) > 0))
      base::refuse("a half-space must be pushed to the side of its normal; turn one of them round");
}

/// First part of the line in the mesh, no farther than the push before p.
std::optional<Stretch> PushedShape::in_mesh(const Vec3& p) const {
  double enter = 0;
  if (!mesh_->contains(p)) {
    const auto hit = mesh_->first_hit(p, direction_, instrument_.push.norm());
    if (!hit) return {};
    enter = hit->distance;
  }
  const double beyond = enter + 1e-9 * (1 + enter);
  const auto exit = mesh_->first_hit(p + beyond * direction_, direction_, infinite);
  if (!exit) return {};
  return Stretch{enter, beyond + exit->distance};
}

std::optional<Stretch> PushedShape::along(const Vec3& p) const {
  const Vec3 before = p - instrument_.push;  // of the push, as the shape was
  if (mesh_) return in_mesh(before);
  return std::visit(
      [&](const auto& shape) -> std::optional<Stretch> {
        if constexpr (std::is_same_v<std::decay_t<decltype(shape)>, scene::ClosedMesh>)
          return {};
        else
          return line_and(shape, before, direction_);
      },
      instrument_.shape);
}

namespace {

/// Hint at the unit of a mesh that is too small or too large for an instrument in mm; else empty.
std::string hint_at_unit(const scene::Instrument& instrument) {
  constexpr double smallest = 3, largest = 1000;  // mm
  const auto* mesh = std::get_if<scene::ClosedMesh>(&instrument.shape);
  if (mesh == nullptr) return "";
  Eigen::AlignedBox3d box;
  for (const Vec3& point : read_body(*mesh).points) box.extend(point);
  const double across = box.diagonal().norm();
  if (across >= smallest && across <= largest) return "";
  return fmt::format("; {} is {:.3g} mm across and seems not to be in mm: scale it",
                     mesh->file.string(), across);
}

/// Refuses an instrument that reaches no column that is still free; one to which the skin sticks
/// holds those it reaches.
void meet(const scene::Instrument& instrument, int32_t number, const std::vector<Vec3>& skin,
          const std::vector<char>& rim, ColumnLoads& loads) {
  const PushedShape shape(instrument);
  const double push = instrument.push.norm();
  bool met = false;
  int32_t holder = -1;  // of points that it reaches, too
  for (size_t c = 0; c < skin.size() && !(met && instrument.slide); ++c) {
    if (rim[c]) continue;
    const auto part = shape.along(skin[c]);
    if (!part || part->enter > push || part->leave <= 0) continue;
    if (loads.instrument[c] >= 0) {
      holder = loads.instrument[c];
      continue;
    }
    met = true;
    if (instrument.slide) continue;
    loads.instrument[c] = number;
    loads.target[c] = skin[c] + part->leave / push * instrument.push;
  }
  if (met) return;
  if (holder >= 0)
    base::refuse("all points of the skin that it reaches are held by instruments[{}]; move it",
                 holder);
  base::refuse("it reaches no free point of the skin; move it or push it farther{}",
               hint_at_unit(instrument));
}

}  // namespace

ColumnLoads hold_by_instruments(const scene::Scene& scene, const std::vector<Vec3>& skin,
                                const std::vector<char>& rim) {
  ColumnLoads loads{std::vector<int32_t>(skin.size(), -1), skin, {}, {}};
  for (const bool slide : {false, true})
    for (size_t i = 0; i < scene.instruments.size(); ++i) {
      if (scene.instruments[i].slide != slide) continue;
      try {
        meet(scene.instruments[i], static_cast<int32_t>(i), skin, rim, loads);
      } catch (const base::InputError& error) {
        base::refuse("{}: instruments[{}]: {}", scene.file.string(), i, error.what());
      }
    }
  return loads;
}

}  // namespace repose::model
