#include "movement.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

namespace repose::app {
namespace {

constexpr double worth_saying = 0.3;  // mm, of a component beside the largest one
constexpr double unmoved = 0.1;       // mm
constexpr double same_place = 25;     // mm

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

}  // namespace

size_t nearest_point(const Vec3& place, const std::vector<Vec3>& points) {
  size_t nearest = 0;
  for (size_t i = 1; i < points.size(); ++i)
    if ((points[i] - place).squaredNorm() < (points[nearest] - place).squaredNorm()) nearest = i;
  return nearest;
}

std::string describe_movement(const std::vector<model::FacePlace>& places, const Mat3& axes,
                              const std::vector<Vec3>& initial, const std::vector<Vec3>& moved) {
  size_t farthest = 0;
  const auto moved_by = [&](size_t i) { return Vec3(moved[i] - initial[i]); };
  for (size_t i = 1; i < initial.size(); ++i)
    if (moved_by(i).squaredNorm() > moved_by(farthest).squaredNorm()) farthest = i;
  const double largest = initial.empty() ? 0 : moved_by(farthest).norm();
  if (largest < unmoved) return "The face does not move.";
  std::string text;
  std::vector<Vec3> movement;
  for (const model::FacePlace& place : places) {
    movement.push_back(moved_by(nearest_point(place.at, initial)));
    if (movement.back().norm() >= unmoved)
      text += fmt::format("{} {}; ", place.name, describe_shift(axes * movement.back()));
  }
  text += fmt::format("largest movement {:.1f} mm ({})", largest,
                      place_of(initial[farthest], largest, places, movement));
  text[0] = static_cast<char>(std::toupper(text[0]));
  return text + ".";
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
