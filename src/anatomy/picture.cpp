#include "repose/anatomy/picture.h"

#include <fmt/format.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "front_map.h"

namespace repose::anatomy {
namespace {

constexpr double scale = 4;    // pixels a mm
constexpr double margin = 12;  // mm around the landmarks
constexpr double blank = 8;    // mm between panels
constexpr double beside = 8;   // mm from the midline, of landmarks drawn in the section
constexpr double cell = 1;     // mm, of the shaded views
constexpr int grays = 24;

/// A rectangle of the drawing's plane, mm.
struct Window {
  double left, right, low, high;

  double width() const { return right - left; }
  double height() const { return high - low; }
};

/// Draws in mm of a window, at an offset in the page.
class Panel {
 public:
  Panel(const Window& window, double offset) : window_(window), offset_(offset) {}

  double x(double u) const { return scale * (u - window_.left + offset_); }
  double y(double v) const { return scale * (window_.high - v); }
  bool holds(double u, double v) const {
    return u >= window_.left && u <= window_.right && v >= window_.low && v <= window_.high;
  }

  void title(const std::string& text) {
    text_ += fmt::format("<text x=\"{:.0f}\" y=\"16\" font-size=\"15\" fill=\"#111\">{}</text>\n",
                         x(window_.left) + 6, text);
  }

  /// A landmark with its name; names are kept apart by `lines_`.
  void mark(double u, double v, const std::string& name, const std::string& color) {
    if (!holds(u, v)) return;
    double at = y(v) + 4;
    while (std::any_of(lines_.begin(), lines_.end(), [&](const std::pair<double, double>& line) {
      return std::abs(line.second - at) < 11 && std::abs(line.first - x(u)) < 110;
    }))
      at += 4;
    lines_.emplace_back(x(u), at);
    const double side = u > (window_.left + window_.right) / 2 ? -1 : 1;
    text_ += fmt::format(
        "<circle cx=\"{0:.1f}\" cy=\"{1:.1f}\" r=\"3\" fill=\"{2}\"/>"
        "<text x=\"{3:.1f}\" y=\"{4:.1f}\" font-size=\"11\" fill=\"{2}\" text-anchor=\"{5}\" "
        "stroke=\"#fff\" stroke-width=\"2.5\" paint-order=\"stroke\">{6}</text>\n",
        x(u), y(v), color, x(u) + 6 * side, at, side > 0 ? "start" : "end", name);
  }

  void section(const surface::Surface& surface, const HeadFrame& frame, const char* color) {
    std::vector<Vec3> points;
    for (const Vec3& p : surface.points) points.push_back(frame.to_frame(p));
    std::string path;
    for (const Triangle& t : surface.triangles) {
      std::vector<Vec3> ends;
      for (int k = 0; k < 3; ++k) {
        const Vec3 &a = points[t[k]], &b = points[t[(k + 1) % 3]];
        if ((a.x() < 0) == (b.x() < 0)) continue;
        ends.push_back(a + a.x() / (a.x() - b.x()) * (b - a));
      }
      if (ends.size() != 2 || !holds(ends[0].y(), ends[0].z()) || !holds(ends[1].y(), ends[1].z()))
        continue;
      path += fmt::format("M{:.1f} {:.1f}L{:.1f} {:.1f}", x(ends[0].y()), y(ends[0].z()),
                          x(ends[1].y()), y(ends[1].z()));
    }
    text_ += fmt::format("<path d=\"{}\" stroke=\"{}\" fill=\"none\" stroke-width=\"1.5\"/>\n",
                         path, color);
  }

  /// The foremost surface, lit from above; runs of one gray are one rectangle.
  void shade(const std::vector<const FrontMap*>& maps) {
    for (double v = window_.low; v < window_.high; v += cell) {
      double begin = window_.left;
      int before = -1;
      for (double u = window_.left; u <= window_.right + cell; u += cell) {
        const int gray = u > window_.right ? -1 : gray_at(maps, u, v);
        if (gray == before) continue;
        if (before >= 0)
          text_ += fmt::format(
              "<rect x=\"{:.0f}\" y=\"{:.0f}\" width=\"{:.0f}\" height=\"{:.0f}\" "
              "fill=\"#{:02x}{:02x}{:02x}\"/>\n",
              x(begin), y(v + cell), scale * (u - begin) + 0.5, scale * cell + 0.5, level(before),
              level(before), level(before));
        begin = u;
        before = gray;
      }
    }
  }

  const std::string& text() const { return text_; }

 private:
  static int level(int gray) { return 60 + 190 * gray / grays; }

  static int gray_at(const std::vector<const FrontMap*>& maps, double u, double v) {
    std::optional<double> best;
    int gray = -1;
    for (const FrontMap* map : maps) {
      const auto here = map->depth(u, v), up = map->depth(u, v + cell),
                 aside = map->depth(u + cell, v);
      if (!here || !up || !aside || (best && *best <= *here)) continue;
      best = here;
      const Vec3 normal = Vec3(*aside - *here, -cell, *up - *here).normalized();
      gray = static_cast<int>(grays * std::clamp(normal.dot(Vec3(0.2, -0.8, 0.55)), 0.0, 0.999));
    }
    return gray;
  }

  Window window_;
  double offset_;
  std::string text_;
  std::vector<std::pair<double, double>> lines_;
};

const char* color_of(const scene::LandmarkName& landmark) {
  return landmark.on_skin ? "#b01030" : "#1040a0";
}

template <class Draw>
void each_landmark(const Proposal& proposal, const Draw& draw) {
  for (const scene::LandmarkName& landmark : scene::landmark_names())
    if (const auto found = proposal.found.find(landmark.name); found != proposal.found.end())
      draw(landmark, proposal.frame.to_frame(found->second));
}

}  // namespace

std::string draw_landmarks(const surface::Surface& skin, const surface::Surface& skull,
                           const surface::Surface& mandible, const Proposal& proposal) {
  Window side{INFINITY, -INFINITY, INFINITY, -INFINITY};
  double half = 30;
  each_landmark(proposal, [&](const auto&, const Vec3& p) {
    side.left = std::min(side.left, p.y() - margin);
    side.right = std::max(side.right, p.y() + margin);
    side.low = std::min(side.low, p.z() - margin);
    side.high = std::max(side.high, p.z() + margin);
    half = std::max(half, std::abs(p.x()) + 2 * margin);
  });
  if (side.left > side.right) side = {-1, 1, -1, 1};
  const Window front{-half, half, side.low, side.high};
  Panel section(side, 0), face(front, side.width() + blank),
      bones(front, side.width() + front.width() + 2 * blank);
  section.section(skin, proposal.frame, "#d06070");
  section.section(skull, proposal.frame, "#6080c0");
  section.section(mandible, proposal.frame, "#50a070");
  section.title("section at the midline, seen from the patient's right");
  const FrontMap skin_map(skin, proposal.frame), skull_map(skull, proposal.frame),
      jaw_map(mandible, proposal.frame);
  face.shade({&skin_map});
  face.title("skin from in front: the patient's right is on the left");
  bones.shade({&skull_map, &jaw_map});
  bones.title("bones from in front");
  each_landmark(proposal, [&](const scene::LandmarkName& landmark, const Vec3& p) {
    if (std::abs(p.x()) <= beside) section.mark(p.y(), p.z(), landmark.name, color_of(landmark));
    (landmark.on_skin ? face : bones).mark(p.x(), p.z(), landmark.name, color_of(landmark));
  });
  const double width = scale * (side.width() + 2 * front.width() + 2 * blank);
  return fmt::format(
             "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
             "viewBox=\"0 0 {0:.0f} {1:.0f}\" font-family=\"sans-serif\">\n"
             "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
             width, scale * side.height()) +
         section.text() + face.text() + bones.text() + "</svg>\n";
}

}  // namespace repose::anatomy
