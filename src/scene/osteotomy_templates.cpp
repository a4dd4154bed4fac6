#include "osteotomy_templates.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "head_axes.h"
#include "repose/scene/jaw_height.h"

namespace repose::scene {
namespace {

/// Landmarks of a plan that a template needs.
class TemplatePlacement {
 public:
  explicit TemplatePlacement(const AnatomyPlan& anatomy)
      : anatomy_(anatomy), axes_(require_axes(anatomy)) {}

  Vec3 at(const char* name) const {
    return require_landmark(anatomy_.landmarks, name, anatomy_.file.string());
  }
  bool has(const char* name) const { return anatomy_.landmarks.contains(name); }
  Vec3 hinge() const { return (at("condyle_right_center") + at("condyle_left_center")) / 2; }
  const HeadAxes& axes() const { return axes_; }

 private:
  const AnatomyPlan& anatomy_;
  HeadAxes axes_;
};

void place_le_fort(const TemplatePlacement& head, double level, Osteotomy& cut) {
  constexpr double behind = 0.57;  // of the way from the incisors to the condyles
  const Vec3 point = head.at("nasal_spine") + level * head.axes().up;
  const Vec3 edge = head.at("upper_incisor_edge");
  const double distance = behind * (head.hinge() - edge).dot(head.axes().back);
  cut.planes = {{point, -head.axes().up, {}},
                {edge + distance * head.axes().back, -head.axes().back, {}}};
}

enum class SheetHeight { low, high, top };

/// A corner of a sheet: fractions of the half width between the condyles and of the length from the
/// incisors to them, and which height.
struct SheetCorner {
  double width, length;
  SheetHeight height;
};

/// The axes of the mandible, whatever the scan's pitch: its level goes through the edge of the
/// lower incisors and a share of the way from the condyles to menton, as on heads that are upright.
HeadAxes mandible_axes(const TemplatePlacement& head) {
  constexpr double share = 0.371;
  const Vec3 hinge = head.hinge(), &left = head.axes().left;
  const Vec3 forward =
      head.at("lower_incisor_edge") - (hinge + share * (head.at("menton_bone") - hinge));
  const Vec3 back = (forward.dot(left) * left - forward).normalized();
  return {left, back, left.cross(back)};
}

void place_genioplasty(const TemplatePlacement& head, double level, Osteotomy& cut) {
  constexpr double falls = 0.42, down = 0.91;  // sine and cosine of 25°
  const bool known = head.has("lower_incisor_edge") && head.has("menton_bone");
  const HeadAxes axes = known ? mandible_axes(head) : head.axes();
  cut.planes = {{head.at("b_point") - level * axes.up, -falls * axes.back - down * axes.up, {}}};
}

void place_sagittal_split(const TemplatePlacement& head, Osteotomy& cut) {
  using enum SheetHeight;
  constexpr double below_condyle = 0.255, below_menton = 10;  // of the height; mm
  constexpr double above_condyle = 10;  // mm: crowns above the lingual sheet are cut, too
  constexpr std::array<SheetCorner, 11> corners{{{0.70, 0.425, low},
                                                 {0.70, 0.425, high},
                                                 {1.15, 1.30, high},
                                                 {1.15, 1.30, low},
                                                 {1.22, 0.30, low},
                                                 {1.22, 0.30, high},
                                                 {0.22, 0.525, high},
                                                 {0.70, 1.37, high},
                                                 {0.70, 0.425, top},
                                                 {1.22, 0.30, top},
                                                 {0.22, 0.525, top}}};
  constexpr std::array<Triangle, 10> right{{{0, 3, 2},
                                            {0, 2, 1},
                                            {0, 1, 5},
                                            {0, 5, 4},
                                            {1, 2, 7},
                                            {1, 7, 6},
                                            {1, 9, 5},
                                            {1, 8, 9},
                                            {6, 8, 1},
                                            {6, 10, 8}}};
  const Vec3 hinge = head.hinge(), edge = head.at("lower_incisor_edge");
  const auto [left, back, up] = mandible_axes(head);
  const double half = (head.at("condyle_left_center") - hinge).norm();
  const double length = (hinge - edge).dot(back), menton = (head.at("menton_bone") - hinge).dot(up);
  const auto height = [&](SheetHeight which) {
    if (which == top) return above_condyle;
    return which == high ? below_condyle * menton : menton - below_menton;
  };
  CutSheet sheet;
  for (const int side : {-1, 1}) {
    const auto first = static_cast<int64_t>(sheet.points.size());
    for (const SheetCorner& c : corners)
      sheet.points.push_back(hinge + side * c.width * half * left + (c.length - 1) * length * back +
                             height(c.height) * up);
    for (const Triangle& t : right)
      sheet.triangles.push_back(side < 0 ? Triangle{first + t[0], first + t[1], first + t[2]}
                                         : Triangle{first + t[0], first + t[2], first + t[1]});
  }
  cut.sheet = std::move(sheet);
}

/// mm, how far a plane lies above a point along `up`.
double height_above(const CutPlane& plane, const Vec3& point, const Vec3& up) {
  return (plane.point - point).dot(plane.normal) / up.dot(plane.normal);
}

std::vector<std::string> check_upper(const CutPlane& plane, const TemplatePlacement& head) {
  constexpr double floor = 3, roots = 27;  // mm above the spine, above the edge
  std::vector<std::string> lines;
  const double above = height_above(plane, head.at("nasal_spine"), head.axes().up);
  const Vec3 incisors = head.at("upper_incisor_edge");
  const double edge = height_above(plane, incisors, head.axes().up),
               jaw = (head.at("nasal_spine") - incisors).dot(head.axes().up);
  if (above < 0)
    lines.push_back(
        fmt::format("its plane passes {:.1f} mm below the nasal spine, through the hard palate; "
                    "place it 5 mm above the spine (template: le_fort_1)",
                    -above));
  else if (above < floor)
    lines.push_back(fmt::format(
        "its plane passes {:.1f} mm above the nasal spine; with less than {:g} mm it may open the "
        "hard palate",
        above, floor));
  if (edge < roots && jaw >= upper_jaw_with_teeth)
    lines.push_back(fmt::format(
        "its plane passes {:.1f} mm above the edge of the upper incisors; by rule roots "
        "end {:g} mm above it",
        edge, roots));
  return lines;
}

std::vector<std::string> check_lower(const CutPlane& plane, const TemplatePlacement& head) {
  constexpr double roots = 25, canal = 5;        // mm
  constexpr double along = 0.25, upward = 0.36;  // of length and height: the mental foramen
  std::vector<std::string> lines;
  const auto [left, back, up] = mandible_axes(head);
  const Vec3 edge = head.at("lower_incisor_edge"), menton = head.at("menton_bone");
  const double below = -height_above(plane, edge, up), jaw = (edge - menton).dot(up);
  if (below < roots && jaw >= lower_jaw_with_teeth)
    lines.push_back(fmt::format(
        "its plane passes {:.1f} mm below the edge of the lower incisors; by rule roots "
        "end {:g} mm below it",
        below, roots));
  const Vec3 foramen = edge + along * (head.hinge() - edge).dot(back) * back +
                       ((menton - edge).dot(up) + upward * (edge - menton).dot(up)) * up;
  const double clear = -height_above(plane, foramen, up);
  if (clear < canal)
    lines.push_back(fmt::format(
        "its plane passes {:.1f} mm {} the mental foramen's place by rule; the mandibular canal "
        "reaches {:g} mm below it: place the plane lower or steeper",
        std::abs(clear), clear < 0 ? "above" : "below", canal));
  return lines;
}

}  // namespace

void place_template(const AnatomyPlan& anatomy, std::optional<double> level, Osteotomy& cut) {
  const TemplatePlacement head(anatomy);
  switch (*cut.made_by) {
    case OsteotomyTemplate::le_fort_1:
      return place_le_fort(head, level.value_or(5), cut);
    case OsteotomyTemplate::sagittal_split:
      return place_sagittal_split(head, cut);
    case OsteotomyTemplate::genioplasty:
      return place_genioplasty(head, level.value_or(4), cut);
  }
}

std::vector<std::string> check_cut(const AnatomyPlan& anatomy, const Osteotomy& cut) {
  constexpr double level = 0.7;  // cosine of the angle to the vertical: planes that are level
  for (const char* name : {"condyle_right_center", "condyle_left_center", "nasal_spine",
                           "upper_incisor_edge", "lower_incisor_edge", "menton_bone"})
    if (!anatomy.landmarks.contains(name)) return {};
  const TemplatePlacement head(anatomy);
  std::vector<std::string> lines;
  for (const CutPlane& plane : cut.planes) {
    const double up = plane.normal.normalized().dot(head.axes().up);
    if (std::abs(up) < level || plane.radius) continue;
    const double above_teeth = height_above(plane, head.at("upper_incisor_edge"), head.axes().up);
    const auto found = above_teeth > 0 ? check_upper(plane, head) : check_lower(plane, head);
    lines.insert(lines.end(), found.begin(), found.end());
  }
  return lines;
}

}  // namespace repose::scene
