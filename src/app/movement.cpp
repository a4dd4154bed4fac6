#include "movement.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>
#include <utility>

#include "repose/surface/triangle_tree.h"

namespace repose::app {
namespace {

constexpr double worth_saying = 0.3;  // mm, of a component beside the largest one
constexpr double unmoved = 0.1;       // mm
constexpr double still = 1e-3;        // mm
constexpr double same_place = 25;     // mm
constexpr double beside_stomion = 8;  // mm
constexpr double closed = 0.1;        // mm

/// "7.4 mm forward, 0.3 down", the largest component first and with its unit.
std::string describe_shift(const Vec3& by) {
  struct Component {
    double length;
    const char* word;
  };
  std::vector<Component> parts = {{std::abs(by.y()), by.y() < 0 ? "forward" : "back"},
                                  {std::abs(by.z()), by.z() > 0 ? "up" : "down"},
                                  {std::abs(by.x()), by.x() > 0 ? "to the left" : "to the right"}};
  std::ranges::stable_sort(
      parts, [](const Component& a, const Component& b) { return a.length > b.length; });
  std::string text = fmt::format("{:.1f} mm {}", parts[0].length, parts[0].word);
  for (size_t k = 1; k < parts.size(); ++k)
    if (parts[k].length >= worth_saying)
      text += fmt::format(", {:.1f} {}", parts[k].length, parts[k].word);
  return text;
}

/// The place near `at` that moves at least half as far as it does: beside a parted mouth the lips
/// lie together and move apart.
std::string place_of(const Vec3& at, double moved, const std::vector<model::FacePlace>& places,
                     const std::vector<Vec3>& movement) {
  const auto tidy = [](double x) { return std::round(x) + 0.0; };  // turns −0 into 0
  const std::string where =
      fmt::format("at ({:.0f}, {:.0f}, {:.0f})", tidy(at.x()), tidy(at.y()), tidy(at.z()));
  const model::FacePlace* nearest = nullptr;
  for (size_t k = 0; k < places.size(); ++k) {
    const double distance = (places[k].at - at).norm();
    if (distance > same_place || movement[k].norm() < moved / 2) continue;
    if (!nearest || distance < (nearest->at - at).norm()) nearest = &places[k];
  }
  return nearest ? fmt::format("{}, {}", nearest->name, where) : where;
}

/// The two points of the skin that one vertex became where the lips part, nearest to stomion.
std::optional<std::pair<size_t, size_t>> parted_vertex(const Vec3& stomion,
                                                       const std::vector<Vec3>& points) {
  std::vector<size_t> near;
  for (size_t i = 0; i < points.size(); ++i)
    if ((points[i] - stomion).norm() < beside_stomion) near.push_back(i);
  std::ranges::stable_sort(near, {}, [&](size_t i) { return (points[i] - stomion).squaredNorm(); });
  for (size_t k = 0; k < near.size(); ++k)
    for (size_t l = k + 1; l < near.size(); ++l)
      if (points[near[k]] == points[near[l]]) return std::pair(near[k], near[l]);
  return std::nullopt;
}

/// Returns how far a point's triangles extend beyond it along `up`, mm, summed.
double extent_above(size_t point, const Vec3& up, const surface::Surface& skin) {
  double above = 0;
  for (const Triangle& t : skin.triangles)
    if (std::ranges::count(t, static_cast<int64_t>(point)) > 0)
      for (const int64_t corner : t) above += up.dot(skin.points[corner] - skin.points[point]);
  return above;
}

/// The movement of the skin's point nearest to a place, linear in its triangle.
Vec3 movement_at(const Vec3& place, const surface::TriangleTree& tree,
                 const surface::Surface& initial, const std::vector<Vec3>& moved) {
  const auto nearest = tree.nearest(place);
  const Triangle& corner = initial.triangles[nearest.triangle];
  const Vec3 weight = surface::barycentric(surface::corners(initial, corner), nearest.point);
  Vec3 movement = Vec3::Zero();
  for (int k = 0; k < 3; ++k)
    movement += weight[k] * (moved[corner[k]] - initial.points[corner[k]]);
  return movement;
}

}  // namespace

std::string describe_movement(const std::vector<model::FacePlace>& places, const Mat3& axes,
                              const surface::Surface& initial, const std::vector<Vec3>& moved) {
  if (moved.empty()) return "The model has no skin/points; point/displacement states movements.";
  size_t farthest = 0;
  const auto moved_by = [&](size_t i) { return Vec3(moved[i] - initial.points[i]); };
  for (size_t i = 1; i < moved.size(); ++i)
    if (moved_by(i).squaredNorm() > moved_by(farthest).squaredNorm()) farthest = i;
  const double largest = moved_by(farthest).norm();
  if (largest < still) return "The face does not move.";
  if (largest < unmoved) return fmt::format("The face moves {:.2g} mm at most.", largest);
  std::string text;
  std::vector<Vec3> movement;
  const surface::TriangleTree tree(initial);
  for (const model::FacePlace& place : places) {
    movement.push_back(movement_at(place.at, tree, initial, moved));
    if (movement.back().norm() >= unmoved)
      text += fmt::format("{} {}; ", place.name, describe_shift(axes * movement.back()));
  }
  text += fmt::format("largest movement {:.1f} mm ({})", largest,
                      place_of(initial.points[farthest], largest, places, movement));
  text[0] = static_cast<char>(std::toupper(text[0]));
  return text + ".";
}

std::string describe_lips(const scene::Landmarks& landmarks, const Vec3& up,
                          const surface::Surface& initial, const std::vector<Vec3>& moved) {
  if (!landmarks.contains("stomion")) return "";
  const auto pair = parted_vertex(landmarks.at("stomion"), initial.points);
  if (!pair) return "";
  const auto [one, other] = *pair;
  const bool first_is_upper = extent_above(one, up, initial) > extent_above(other, up, initial);
  const double gap = (first_is_upper ? 1 : -1) * up.dot(moved[one] - moved[other]);
  if (gap < closed) return "Lips closed. ";
  return fmt::format("Lips {:.1f} mm apart at stomion, closed at first. ", gap);
}

std::string describe_trust(const solve::Summary& summary, double discretization) {
  const double error = summary.last.displacement_error;
  std::string text = !summary.path.complete() ? "NOT AT REST"
                     : std::isfinite(error)   ? fmt::format("Within {:.2g} mm of rest", error)
                                              : "At rest, within a distance that is not known";
  if (discretization >= 0) text += fmt::format("; the mesh adds up to {:.2g} mm", discretization);
  return text + ".";
}

}  // namespace repose::app
