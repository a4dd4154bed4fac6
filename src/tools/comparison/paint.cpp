#include "repose/tools/comparison/paint.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>

#include "repose/base/error.h"
#include "repose/surface/read.h"

namespace repose::tools::comparison {

using namespace surface;

namespace {

using Color = std::array<double, 3>;

/// Values at the vertices: colors, or labels as the first of three numbers.
struct Held {
  std::vector<Color> values;
  bool colors;
};

Held held_by(const VertexValues& mesh, const std::filesystem::path& file) {
  const std::array channels{mesh.find("red"), mesh.find("green"), mesh.find("blue")};
  const std::vector<double>* label = mesh.find("label");
  const bool colors = channels[0] && channels[1] && channels[2];
  if (!colors && !label)
    base::refuse("{}: its vertices have neither colors (red, green, blue) nor a property label",
                 file.string());
  Held held{std::vector<Color>(mesh.points.size(), Color{}), colors};
  for (size_t p = 0; p < held.values.size(); ++p)
    for (int c = 0; c < (colors ? 3 : 1); ++c)
      held.values[p][c] = std::round(colors ? (*channels[c])[p] : (*label)[p]);
  return held;
}

double apart(const Color& one, const Color& other) {
  double maximum = 0;
  for (int c = 0; c < 3; ++c) maximum = std::max(maximum, std::abs(one[c] - other[c]));
  return maximum;
}

/// Returns the paints, the most frequent first.
std::vector<Color> paints_of(const Held& held) {
  constexpr double blended = 40;
  constexpr size_t min_part = 200;
  std::map<Color, size_t> count;
  for (const Color& value : held.values) ++count[value];
  std::vector<std::pair<Color, size_t>> frequent(count.begin(), count.end());
  std::ranges::stable_sort(frequent, std::greater(), &std::pair<Color, size_t>::second);
  std::vector<Color> paints;
  for (const auto& paint_and_vertices : frequent) {
    const Color& value = paint_and_vertices.first;
    const bool blend = paint_and_vertices.second * min_part < held.values.size() ||
                       std::any_of(paints.begin(), paints.end(), [&](const Color& paint) {
                         return apart(value, paint) <= blended;
                       });
    if (paints.empty() || !held.colors || !blend) paints.push_back(value);
  }
  return paints;
}

}  // namespace

Paint::Paint(const std::filesystem::path& file) {
  const VertexValues mesh = read_vertex_values(file);
  if (mesh.points.empty()) base::refuse("{}: it has no vertices", file.string());
  const Held held = held_by(mesh, file);
  const std::vector<Color> paints = paints_of(held);
  for (const Color& paint : paints)
    names_.push_back(held.colors ? fmt::format("color {} {} {}", paint[0], paint[1], paint[2])
                                 : fmt::format("label {}", paint[0]));
  for (const Color& value : held.values) {
    const auto off = [&](const Color& paint) { return apart(value, paint); };
    const auto nearest = std::ranges::min_element(paints, {}, off);
    paint_.push_back(static_cast<int>(nearest - paints.begin()));
  }
  tree_ = tree_of_points(mesh.points);
}

int Paint::at(const Vec3& point) const {
  constexpr double beside = 10;  // mm
  const TriangleTree::Nearest vertex = tree_->nearest(point);
  return std::sqrt(vertex.squared) <= beside ? paint_[vertex.triangle] : -1;
}

}  // namespace repose::tools::comparison
