#include "readers.h"

#include <fmt/format.h>

#include <array>

#include "head_axes.h"
#include "repose/base/text.h"
#include "repose/scene/landmarks.h"

namespace repose::scene {
namespace {

/// Landmarks of the two sides.
constexpr std::array<std::array<const char*, 2>, 3> pairs{
    {{"condyle_right_center", "condyle_left_center"},
     {"gonion_right", "gonion_left"},
     {"mouth_right", "mouth_left"}}};

/// Landmarks that lie one below the other, on bone and on skin.
constexpr std::array<std::array<const char*, 2>, 9> order{{{"nasion_bone", "nasal_spine"},
                                                           {"nasal_spine", "upper_incisor_edge"},
                                                           {"lower_incisor_edge", "b_point"},
                                                           {"b_point", "menton_bone"},
                                                           {"pronasale", "upper_lip"},
                                                           {"subnasale", "stomion"},
                                                           {"stomion", "lower_lip"},
                                                           {"lower_lip", "b_soft"},
                                                           {"b_soft", "pogonion_soft"}}};

void check_front(const Value& file, const Landmarks& landmarks) {
  const Vec3* condyle = find(landmarks, "condyle_right_center");
  for (const char* name : {"lower_incisor_edge", "upper_incisor_edge", "pronasale", "stomion"})
    if (const Vec3* front = find(landmarks, name); front && condyle && front->y() > condyle->y())
      file.refuse(
          "has {} {:.0f} mm behind the condyles along +y, as in RAS; landmarks must be in LPS: "
          "change the signs of x and y, or have the file say its coordinate system",
          name, front->y() - condyle->y());
}

void check_sides(const Value& file, const Landmarks& landmarks) {
  for (const auto& [right, left] : pairs) {
    const Vec3 *a = find(landmarks, right), *b = find(landmarks, left);
    if (!a != !b) file.refuse("has {} without {}; place both", a ? right : left, a ? left : right);
    if (a && b && a->x() >= b->x())
      file.refuse(
          "has {} at x = {:.1f} mm and {} at x = {:.1f} mm, but +x is the patient's left: they are "
          "exchanged",
          right, a->x(), left, b->x());
  }
}

/// Refuses a misspelled landmark, which would pass for a point of the user's own and be ignored.
void check_names(const Value& file, const Landmarks& landmarks) {
  for (const auto& [name, place] : landmarks)
    if (const std::string meant = misspelled_name(name, landmarks); !meant.empty())
      file.refuse("has {}, which is no landmark's name, and lacks {}; rename it", base::quote(name),
                  meant);
}

/// Refuses condyles that are as far apart as those of no head in mm.
void check_unit(const Value& file, const Landmarks& landmarks) {
  constexpr double low = 60, high = 160;  // mm
  const Vec3 *right = find(landmarks, "condyle_right_center"),
             *left = find(landmarks, "condyle_left_center");
  if (!right || !left) return;
  const double apart = (*left - *right).norm();
  if (!(apart >= low && apart <= high))
    file.refuse(
        "has condyle_left_center {:.6g} mm from condyle_right_center, in a head {:g} to {:g} mm: "
        "landmarks must be in mm; multiply them by 10 if they are in cm, by 1000 if in m",
        apart, low, high);
}

void check_order(const Value& file, const Landmarks& landmarks) {
  for (const auto& [upper, lower] : order) {
    const Vec3 *a = find(landmarks, upper), *b = find(landmarks, lower);
    if (a && b && a->z() <= b->z())
      file.refuse("has {} at z = {:.1f} mm, not above {} at z = {:.1f} mm; place them again", upper,
                  a->z(), lower, b->z());
  }
}

}  // namespace

void check_frame(const Value& file, const Landmarks& landmarks) {
  check_front(file, landmarks);
  check_unit(file, landmarks);
}

AnatomyPlan read_anatomy(const Value& value) {
  const Map map(value);
  const Value file = map.at("landmarks");
  AnatomyPlan plan;
  plan.file = file.file();
  plan.landmarks = with_standard_names(landmarks_by_name(plan.file), plan.file.string());
  check_names(file, plan.landmarks);
  check_frame(file, plan.landmarks);
  check_sides(file, plan.landmarks);
  check_order(file, plan.landmarks);
  plan.axes = head_axes(plan.landmarks);
  if (const auto lips = map.find("lips")) plan.part_lips = lips->choice() == 0;
  if (const auto vestibule = map.find("vestibule")) plan.vestibule = vestibule->choice() == 0;
  if (const auto gap = map.find("gap")) plan.gap = gap->number();
  if (const auto gap = map.find("lower_gap")) plan.lower_gap = gap->number();
  if (const auto adhesion = map.find("adhesion")) plan.adhesion = adhesion->number();
  if (const auto tone = map.find("tone")) plan.tone = tone->number();
  if (const auto pedicle = map.find("pedicle")) plan.pedicle = pedicle->number();
  return plan;
}

double gap_of_lower_teeth(const AnatomyPlan& plan) {
  constexpr double largest = 4;  // mm
  if (plan.lower_gap) return *plan.lower_gap;
  const Vec3 *upper = find(plan.landmarks, "upper_incisor_edge"),
             *lower = find(plan.landmarks, "lower_incisor_edge");
  if (!upper || !lower) return plan.gap;
  return std::max(plan.gap, std::min(plan.axes.row(1).dot(*lower - *upper) / 2, largest));
}

std::array<Eigen::Vector2d, 2> vestibule_sides(const AnatomyPlan& plan) {
  constexpr double beside = 12, before = 16, behind = 38;  // mm
  const Vec3 edge = plan.axes * plan.landmarks.at("upper_incisor_edge"),
             right = plan.axes * plan.landmarks.at("mouth_right"),
             left = plan.axes * plan.landmarks.at("mouth_left");
  return {Eigen::Vector2d(right.x() - beside, edge.y() - before),
          Eigen::Vector2d(left.x() + beside, edge.y() + behind)};
}

void read_septum(const Value& anatomy, Scene& scene) {
  constexpr double reach = 5;  // mm on either side of an edge
  const auto septum = Map(anatomy).find("septum");
  if (!septum) return;
  if (!scene.tissue.material)
    septum->refuse("needs a solid; give tissue.material in place of tissue.springs or remove it");
  CurveRegion edges{{}, reach};
  for (const char* name : {"nasal_spine", "pronasale", "nasion_bone"}) {
    const Vec3* place = find(scene.anatomy->landmarks, name);
    if (!place)
      septum->refuse("needs the landmark {}, which {} lacks", name, scene.anatomy->file.string());
    edges.path.push_back(*place);
  }
  Material& material = *scene.tissue.material;
  material.regions.insert(material.regions.begin(),
                          {edges, {septum->number(), material.deep.poisson}});
  std::vector<AttachRegion>& attach = scene.tissue.attach_regions;
  attach.insert(attach.begin(),
                {Sphere{edges.path.front(), reach}, Attach::contact, scene.anatomy->gap});
  scene.remarks.push_back(fmt::format(
      "septum by landmarks: {:g} N/mm² within {:g} mm of the lines from the nasal spine to "
      "pronasale to nasion (material region 0), not held by bone within {:g} mm of the spine",
      septum->number(), reach, reach));
}

}  // namespace repose::scene
