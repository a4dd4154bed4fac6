#include "repose/anatomy/complete.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "lip_crease.h"
#include "repose/anatomy/propose.h"
#include "repose/base/error.h"
#include "repose/scene/jaw_height.h"
#include "repose/surface/edges.h"

namespace repose::anatomy {
namespace {

using scene::find;
using Path = std::vector<Vec3>;

/// The frame of the head at the mouth.
HeadFrame frame_of(const scene::AnatomyPlan& plan) {
  HeadFrame frame;
  frame.axes = plan.axes;
  const Vec3 *mouth_right = find(plan.landmarks, "mouth_right"),
             *mouth_left = find(plan.landmarks, "mouth_left");
  const Vec3* edge = find(plan.landmarks, "upper_incisor_edge");
  if (mouth_right && mouth_left)
    frame.origin = (*mouth_right + *mouth_left) / 2;
  else if (edge)
    frame.origin = *edge;
  return frame;
}

bool has_mouth(const scene::Scene& scene) {
  return std::ranges::any_of(scene.incisions, &scene::Incision::parts_lips);
}

void add_mouth(const Path& path, const char* where, scene::Scene& scene,
               std::vector<std::string>& remarks) {
  scene.incisions.push_back(
      {.path = path, .layers = scene.tissue.layers, .name = "mouth", .by_landmarks = true});
  remarks.push_back(fmt::format("lips are parted {} by landmarks: {} points from {:.1f} to {:.1f}",
                                where, path.size(), path.front(), path.back()));
}

/// Returns whether a border of a skin passes near a path, as seen from in front.
bool ends_near(const surface::Surface& skin, const HeadFrame& frame, const Path& path) {
  constexpr double near = 6;  // mm
  const std::vector<char> border =
      surface::border_vertices(surface::EdgeTable(skin.triangles), skin.points.size());
  for (size_t v = 0; v < border.size(); ++v) {
    if (!border[v]) continue;
    const Vec3 at = frame.to_frame(skin.points[v]);
    for (const Vec3& point : path) {
      const Vec3 apart = frame.to_frame(point) - at;
      if (std::hypot(apart.x(), apart.z()) < near) return true;
    }
  }
  return false;
}

/// Moves points that lie far behind a skin forward onto it: on the given one the lips part deeper.
Path brought_forward(const FrontMap& skin, const HeadFrame& frame, Path path) {
  constexpr double far = 2;  // mm
  for (Vec3& point : path) {
    Vec3 at = frame.to_frame(point);
    const auto y = skin.depth(at.x(), at.z());
    if (!y || *y > at.y() - far) continue;
    at.y() = *y;
    point = frame.to_scan(at);
  }
  return path;
}

/// Adds the crease between the lips, found on a skin, as the scene's mouth; where they are apart,
/// keeps the middle of the gap in its plan. Leaves a mouth of the scene's own.
void part_lips(const surface::Surface& skin, scene::Scene& scene,
               std::vector<std::string>& remarks) {
  scene::AnatomyPlan& plan = *scene.anatomy;
  if (!plan.part_lips || has_mouth(scene)) return;
  const HeadFrame frame = frame_of(plan);
  const Vec3* edge = find(plan.landmarks, "upper_incisor_edge");
  const Vec3* stomion = find(plan.landmarks, "stomion");
  const Vec3* height = stomion ? stomion : edge;
  const Path path = find_lip_crease(skin, frame, plan.landmarks);
  if (height && open_mouth(FrontMap(skin, frame), frame.to_frame(*height).z())) {
    plan.lip_gap = path;
    remarks.push_back("the mouth is open in the scan: the lips are apart");
    return;
  }
  if (path.size() < 2)
    base::refuse(
        "{}: no crease between the lips was found on the skin by stomion, mouth_right and "
        "mouth_left or upper_incisor_edge; place these, give mouth: {{path: ...}}, or set "
        "anatomy.lips: joined",
        plan.file.string());
  add_mouth(path, "along their crease", scene, remarks);
}

/// Returns whether all of some landmarks are known; if not, remarks on the first that is missing
/// and on the `effect`.
bool all_known(const scene::AnatomyPlan& plan, std::initializer_list<const char*> names,
               const char* effect, std::vector<std::string>& remarks) {
  for (const char* name : names) {
    if (find(plan.landmarks, name)) continue;
    remarks.push_back(
        fmt::format("{}: landmark {} is missing, so {}", plan.file.string(), name, effect));
    return false;
  }
  return true;
}

/// Lowest and highest z of the vestibule along the axes of the head: between B and the nasal spine
/// on bone, and no farther than the lips reach, which end at B' and subnasale.
std::array<double, 2> vestibule_height(const scene::AnatomyPlan& plan) {
  const Vec3 *b_soft = find(plan.landmarks, "b_soft"),
             *subnasale = find(plan.landmarks, "subnasale");
  const auto height = [&](const Vec3* at) { return plan.axes.row(2).dot(*at); };
  const double low = height(find(plan.landmarks, "b_point")),
               high = height(find(plan.landmarks, "nasal_spine"));
  return {b_soft ? std::max(low, height(b_soft)) : low,
          subnasale ? std::min(high, height(subnasale)) : high};
}

void add_vestibule(scene::Scene& scene, std::vector<std::string>& remarks) {
  const scene::AnatomyPlan& plan = *scene.anatomy;
  if (!plan.vestibule ||
      !all_known(plan,
                 {"b_point", "nasal_spine", "upper_incisor_edge", "mouth_right", "mouth_left"},
                 "the lips hold to teeth as to bone: no vestibule", remarks))
    return;
  const auto [front_right, back_left] = scene::vestibule_sides(plan);
  const auto [bottom, top] = vestibule_height(plan);
  const Vec3 low(front_right.x(), front_right.y(), bottom), high(back_left.x(), back_left.y(), top);
  const Vec3* stomion = find(plan.landmarks, "stomion");
  const double lower_gap = stomion ? scene::gap_of_lower_teeth(plan) : plan.gap;
  std::vector<scene::AttachRegion>& regions = scene.tissue.attach_regions;
  const auto put = [&](size_t number, const Vec3& to, double gap) {
    const scene::Box box{(low + to) / 2, to - low};
    regions.insert(
        regions.begin() + static_cast<std::ptrdiff_t>(number),
        scene::AttachRegion{scene::TurnedBox{box, plan.axes}, scene::Attach::contact, gap});
  };
  put(0, high, plan.gap);
  if (lower_gap != plan.gap)
    put(1, {high.x(), high.y(), plan.axes.row(2).dot(*stomion)}, lower_gap);
  remarks.push_back(fmt::format(
      "vestibule by landmarks: {:.0f} … {:.0f}, {:.0f} … {:.0f}, {:.0f} … {:.0f} mm along "
      "left, back and up of the head, {:.2g} mm in front of upper and {:.2g} mm of "
      "lower teeth (first attach regions)",
      low.x(), high.x(), low.y(), high.y(), low.z(), high.z(), plan.gap, lower_gap));
}

/// Without the landmarks that tell the lips and the teeth apart lips do not adhere.
void settle_adhesion(scene::AnatomyPlan& plan, std::vector<std::string>& remarks) {
  if (plan.vestibule && plan.adhesion != 0 &&
      !all_known(
          plan,
          {"stomion", "mouth_right", "mouth_left", "upper_incisor_edge", "lower_incisor_edge"},
          "lips do not adhere to teeth", remarks))
    plan.adhesion = 0;
}

void remark_tone(const scene::Scene& scene, std::vector<std::string>& remarks) {
  const scene::AnatomyPlan& plan = *scene.anatomy;
  if (!scene.tissue.material || plan.tone == 0 ||
      !all_known(plan, {"stomion", "mouth_right", "mouth_left", "subnasale", "b_soft"},
                 "the ring muscle has no tone", remarks))
    return;
  remarks.push_back(fmt::format(
      "ring muscle by landmarks: a tone of up to {:g} N/mm² between subnasale and B′", plan.tone));
}

/// Reports a head that is pitched in the scan, or whose level is not known.
void remark_pitch(const scene::AnatomyPlan& plan, std::vector<std::string>& remarks) {
  constexpr double most = 6;  // degrees
  if (!all_known(
          plan,
          {"condyle_right_center", "condyle_left_center", "nasion_bone", "upper_incisor_edge"},
          "the level of the head is that of the scan", remarks))
    return;
  const double pitch = std::asin(-plan.axes(1, 2)) * 180 / M_PI;
  if (std::abs(pitch) < most) return;
  remarks.push_back(fmt::format(
      "the head lies about {:.0f} degrees chin {} in the scan, by its condyles, nasion and upper "
      "incisors: templates, clinical moves and lips by landmarks follow the head",
      std::abs(pitch), pitch > 0 ? "up" : "down"));
}

void remark_teeth(const scene::AnatomyPlan& plan, std::vector<std::string>& remarks) {
  const Vec3 *spine = find(plan.landmarks, "nasal_spine"),
             *upper = find(plan.landmarks, "upper_incisor_edge"),
             *lower = find(plan.landmarks, "lower_incisor_edge"),
             *menton = find(plan.landmarks, "menton_bone");
  const auto remark = [&](const char* jaw, double height, double minimum) {
    if (height < minimum)
      remarks.push_back(fmt::format(
          "the {} jaw is {:.0f} mm high at the midline, with teeth {:g} mm or more: it may be "
          "edentulous, and lips without support of teeth are predicted with a larger error",
          jaw, height, minimum));
  };
  const Vec3 up = plan.axes.row(2);
  if (spine && upper) remark("upper", up.dot(*spine - *upper), scene::upper_jaw_with_teeth);
  if (lower && menton) remark("lower", up.dot(*lower - *menton), scene::lower_jaw_with_teeth);
}

}  // namespace

void complete(const surface::Surface& skin, scene::Scene& scene,
              std::vector<std::string>& remarks) {
  if (!scene.anatomy) return;
  remark_pitch(*scene.anatomy, remarks);
  remark_teeth(*scene.anatomy, remarks);
  part_lips(skin, scene, remarks);
  add_vestibule(scene, remarks);
  settle_adhesion(*scene.anatomy, remarks);
  remark_tone(scene, remarks);
}

void fit_lips(const surface::Surface& skin, scene::Scene& scene,
              std::vector<std::string>& remarks) {
  if (!scene.anatomy) return;
  const HeadFrame frame = frame_of(*scene.anatomy);
  const FrontMap map(skin, frame);
  for (scene::Incision& cut : scene.incisions)
    if (cut.by_landmarks) cut.path = brought_forward(map, frame, cut.path);
  const Path& gap = scene.anatomy->lip_gap;
  if (gap.size() < 2 || has_mouth(scene) || ends_near(skin, frame, gap)) return;
  add_mouth(brought_forward(map, frame, gap), "along the gap between them, which remeshing closed,",
            scene, remarks);
}

}  // namespace repose::anatomy
