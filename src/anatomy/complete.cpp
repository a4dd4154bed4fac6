#include "repose/anatomy/complete.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "part_lips.h"
#include "repose/scene/jaw_height.h"

namespace repose::anatomy {
namespace {

using scene::find;

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

}  // namespace repose::anatomy
