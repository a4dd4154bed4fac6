#include <algorithm>
#include <cmath>

#include "lip_crease.h"
#include "search.h"

namespace repose::anatomy {
namespace {

constexpr double skin_midline = 1;  // mm, half width of the skin's profile

/// The height of the deepest crease of the skin near the edge of the upper incisors.
std::optional<double> crease_height(const FrontMap& skin, double edge) {
  constexpr double below = 10, above = 7;  // mm
  if (const auto gap = open_mouth(skin, edge)) return gap;
  std::optional<double> height;
  double maximum = -INFINITY;
  for (const double z : skin.steps(edge - below, edge + above)) {
    double sum = 0;
    int count = 0;
    for (const double x : {-6.0, -4.0, -2.0, 0.0, 2.0, 4.0, 6.0})
      if (const auto depth = crease_depth(skin, x, z)) {
        sum += *depth;
        ++count;
      }
    if (count < 4 || !(sum / count > maximum)) continue;
    maximum = sum / count;
    height = z;
  }
  return height;
}

/// Returns half of the widest gap between the lips, mm.
double search_mouth(const FrontMap& skin, Search& search) {
  const auto edge = search.find("upper_incisor_edge"), known = search.find("stomion");
  std::optional<double> z;
  if (known)
    z = known->z();
  else if (edge)
    z = crease_height(skin, edge->z());
  LipCrease crease;
  if (z) crease = follow_crease(skin, *z, search.find("mouth_right"), search.find("mouth_left"));
  if (!z && edge) crease = follow_crease(skin, edge->z(), {}, {});
  if (crease.points.size() < 3) {
    search.lack({"stomion", "mouth_right", "mouth_left"},
                edge ? "SKIN has no crease between lips near the upper incisors"
                     : "the upper incisors were not found");
    return 0;
  }
  const auto middle =
      std::ranges::min_element(crease.points, {}, [](const Vec3& p) { return std::abs(p.x()); });
  search.put("stomion", Vec3(0, middle->y(), middle->z()));
  search.put("mouth_right", crease.points.front());
  search.put("mouth_left", crease.points.back());
  if (crease.lost)
    search.remark(fmt::format(
        "the crease between the lips ends {:.0f} mm right and {:.0f} mm left of the "
        "midline, where the corners of the mouth cannot be; they are put {:.0f} mm right "
        "and {:.0f} mm left of it: check them, and give the true ones (-landmarks)",
        (*crease.lost)[0], (*crease.lost)[1], -crease.points.front().x(),
        crease.points.back().x()));
  if (crease.open)
    search.remark(fmt::format(
        "the mouth is open in SKIN, by up to {:.1f} mm: stomion and corners are those of the gap",
        crease.gap));
  return crease.gap / 2;
}

/// The skin's profile in a sagittal plane, and where its scan ended.
struct SkinProfile {
  double x;  // mm
  std::vector<ProfilePoint> points;
  const ScanEnd& end;
};

/// Takes a point of a profile, unless the scan ended there.
void put_inside(const std::string& name, const std::optional<ProfilePoint>& point,
                const SkinProfile& profile, const std::string& otherwise, Search& search) {
  constexpr double cut = 2;  // mm
  if (point && profile.end.within(search.frame().to_scan({profile.x, point->x(), point->y()}), cut))
    return search.lack(name, "SKIN is cut off flat there, where the scan ends");
  search.put(name, point, otherwise, profile.x);
}

void search_nose_tip(const SkinProfile& profile, Search& search) {
  const auto nasion = search.find("nasion_bone"), spine = search.find("nasal_spine");
  if (!spine)
    return search.lack({"pronasale", "subnasale", "nasion_soft"}, "the nasal spine was not found");
  const double top = nasion ? nasion->z() : spine->z() + 45;
  put_inside("pronasale", foremost_of(between(profile.points, spine->z() - 10, top)), profile,
             "SKIN has no nose", search);
  const auto tip = search.profile_point("pronasale");
  const auto brow = foremost_of(between(profile.points, top + 8, top + 30));
  if (!tip || !brow)
    return search.lack("nasion_soft",
                       tip ? "SKIN ends below the glabella" : "the tip of the nose was not found");
  search.put("nasion_soft",
             farthest_from_chord(between(profile.points, top - 12, top + 12), *tip, *brow, -1),
             "SKIN ends below the glabella");
}

void search_lips(const SkinProfile& profile, const SkinProfile& at_chin, double gap,
                 Search& search) {
  const auto tip = search.profile_point("pronasale"), stomion = search.profile_point("stomion"),
             spine = search.profile_point("nasal_spine");
  const auto chin = search.profile_point("pogonion_soft");
  if (!tip || !stomion || !spine)
    return search.lack({"subnasale", "upper_lip", "lower_lip", "b_soft"},
                       "nose or mouth was not found");
  const double s = stomion->y(), low = gap > 0 ? s - gap : s - 2;  // where the lower lip begins
  const auto first = foremost_of(between(profile.points, s + 2, s + 0.6 * (tip->y() - s)));
  if (first)
    search.put("subnasale",
               farthest_from_chord(between(profile.points, first->y() + 2, tip->y() - 3), *first,
                                   *tip, -1),
               "");
  const auto base = search.profile_point("subnasale");
  if (base)
    search.put(
        "upper_lip",
        farthest_from_chord(between(profile.points, s + 2, base->y() - 3), *stomion, *base, 1),
        "SKIN has no upper lip");
  if (!base) search.lack("subnasale", "SKIN has no base of the nose");
  if (!chin) return search.lack("lower_lip", "the chin was not found");
  const auto lip = foremost_of(between(at_chin.points, low - 12, low));
  if (!lip) return search.lack("lower_lip", "SKIN has no lower lip");
  search.put(
      "b_soft",
      farthest_from_chord(between(at_chin.points, chin->y() + 3, lip->y() - 3), *chin, *lip, -1),
      "SKIN has no sulcus between lower lip and chin", at_chin.x);
  const auto sulcus = search.profile_point("b_soft");
  search.put("lower_lip",
             farthest_from_chord(
                 between(profile.points, std::max(low - 14, sulcus ? sulcus->y() + 2 : 0), low),
                 sulcus.value_or(*chin), *stomion, 1),
             "SKIN has no lower lip");
}

void search_soft_chin(const SkinProfile& at_chin, const surface::Surface& skin, Search& search) {
  constexpr double around = 3, most_above = 9;  // mm
  constexpr double share = 0.08;                // of the height of the face
  const auto menton = search.find("menton_bone"), chin = search.find("pogonion_bone");
  if (!menton || !chin)
    return search.lack({"pogonion_soft", "menton_soft"}, "the chin of MANDIBLE was not found");
  const auto nasion = search.find("nasion_bone");
  const double above =
      nasion ? std::min(most_above, share * (nasion->z() - menton->z())) : most_above;
  put_inside("pogonion_soft", chin_of(at_chin.points, chin->z() - above, chin->z() + above),
             at_chin, "SKIN has no chin", search);
  std::optional<Vec3> below;
  for (const Vec3& point : skin.points) {
    const Vec3 p = search.frame().to_frame(point);
    if (std::abs(p.x() - menton->x()) > around || std::abs(p.y() - menton->y()) > around) continue;
    if (p.z() < menton->z() && (!below || p.z() > below->z())) below = p;
  }
  if (below)
    search.put("menton_soft", Vec3(menton->x(), menton->y(), below->z()));
  else
    search.lack("menton_soft", "SKIN has no point below menton");
}

}  // namespace

void search_skin(const surface::Surface& skin, Search& search) {
  constexpr double behind = 15;  // mm, the bone: what is seen through a wide hole
  const FrontMap map(skin, search.frame());
  const ScanEnd end(skin);
  double back = INFINITY;
  if (const auto spine = search.find("nasal_spine"), chin = search.find("pogonion_bone");
      spine && chin)
    back = std::max(spine->y(), chin->y()) + behind;
  const auto profile_at = [&](double x) {
    auto points = map.profile(map.low_z(), map.high_z(), skin_midline, x);
    std::erase_if(points, [&](const ProfilePoint& p) { return p.x() > back; });
    return SkinProfile{x, std::move(points), end};
  };
  const SkinProfile midline = profile_at(0),
                    at_chin = profile_at(search.find("menton_bone").value_or(Vec3::Zero()).x());
  const double half_gap = search_mouth(map, search);
  search_nose_tip(midline, search);
  search_soft_chin(at_chin, skin, search);
  search_lips(midline, at_chin, half_gap, search);
}

std::vector<Vec3> find_lip_crease(const surface::Surface& skin, const HeadFrame& frame,
                                  const Landmarks& landmarks) {
  constexpr double apart = 2, rounding = 1e-6;  // mm; from the middle, so that sides are alike
  Search search(frame, landmarks);
  const FrontMap map(skin, frame);
  const auto right = search.find("mouth_right"), left = search.find("mouth_left"),
             stomion = search.find("stomion"), edge = search.find("upper_incisor_edge");
  std::optional<double> z;
  if (stomion)
    z = stomion->z();
  else if (right && left)
    z = crease_height(map, (right->z() + left->z()) / 2 + 1);
  else if (edge)
    z = crease_height(map, edge->z());
  if (!z) return {};
  const LipCrease crease = follow_crease(map, *z, right, left);
  const std::vector<Vec3>& points = crease.points;
  std::vector<Vec3> path;
  for (size_t i = 0; i < points.size(); ++i) {
    const bool end = i == 0 || i + 1 == points.size();
    const double from_end =
        std::min(points[i].x() - points.front().x(), points.back().x() - points[i].x());
    const double steps = points[i].x() / apart;
    if (end || (from_end > apart / 2 && std::abs(steps - std::round(steps)) < rounding))
      path.push_back(frame.to_scan(points[i]));
  }
  return path;
}

}  // namespace repose::anatomy
