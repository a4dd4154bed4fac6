#include <algorithm>
#include <cmath>

#include "mean_near_largest.h"
#include "repose/scene/jaw_height.h"
#include "repose/surface/edges.h"
#include "search.h"

namespace repose::anatomy {
namespace {

constexpr double midline = 2;         // mm, half width of a profile of bone
constexpr double incisors = 7;        // mm, half width of the front teeth
constexpr double condyle_depth = 9;   // mm below its top
constexpr double condyle_reach = 12;  // mm before and behind its top
constexpr double rear = 0.27;         // share of the mandible's depth in which condyles lie
constexpr double uneven = 0.8;        // of the rami's lengths, that a head may have
constexpr double coronoid = 9;        // mm above the condyle's top, that a head may have

/// The extreme edge of bone at the front teeth: the highest (sign 1) or lowest (−1) cell from the
/// height of `start` to `to_z`, within the incisors' width and `reach` of the depth of `start`. Its
/// depth is the mean over edges that end nearly there, so that no single tooth decides.
std::optional<Vec3> tooth_edge(const FrontMap& map, int sign, const ProfilePoint& start,
                               double to_z, double reach) {
  constexpr double level = 1;  // mm
  std::vector<ProfilePoint> edges;
  for (const double x : map.steps(-incisors, incisors)) {
    std::optional<ProfilePoint> end;
    for (const double z : map.steps(start.y(), to_z, sign)) {
      const auto depth = map.depth(x, z);
      if (depth && std::abs(*depth - start.x()) <= reach)
        end = ProfilePoint(*depth, z);
      else if (end)
        break;
    }
    if (end) edges.push_back(*end);
  }
  if (edges.empty()) return std::nullopt;
  const auto end = [&](const ProfilePoint& edge) { return sign * edge.y(); };
  const auto depth = [](const ProfilePoint& edge) { return edge.x(); };
  return Vec3(0, mean_near_largest(edges, level, end, depth), sign * largest_of(edges, end));
}

/// The x of a chin beside the midsagittal plane, mm: the median over its heights of the middle of
/// what lies no farther back than `arch` behind its foremost place; 0 where that is near the plane.
double middle_of_chin(const FrontMap& map, double low) {
  constexpr double above = 4, height = 12, half = 30, arch = 8;  // mm
  constexpr double near = 4;                                     // mm, that a head may have
  std::vector<double> middles;
  for (const double z : map.steps(low + above, low + above + height)) {
    const auto front = map.foremost(0, z, half);
    double right = half, left = -half;
    for (const double x : map.steps(-half, half)) {
      const auto depth = map.depth(x, z);
      if (!front || !depth || *depth > *front + arch) continue;
      right = std::min(right, x);
      left = std::max(left, x);
    }
    if (left > right) middles.push_back((left + right) / 2);
  }
  if (middles.empty()) return 0;
  const double aside = base::median(std::move(middles));
  return std::abs(aside) > near ? aside : 0;
}

/// Pogonion and point B, on the profile at x = `aside`, after menton and the lower incisors.
void search_chin(const std::vector<ProfilePoint>& profile, double aside, Search& search) {
  constexpr double usual = 0.53;  // of the height of the jaw with teeth, of B above menton
  const ProfilePoint edge = *search.profile_point("lower_incisor_edge");
  const double menton = search.find("menton_bone")->z(), height = edge.y() - menton;
  if (height < scene::lower_jaw_with_teeth)
    search.remark(fmt::format(
        "MANDIBLE is {:.0f} mm high at the chin, {:.0f} mm or more with teeth: it may be "
        "edentulous, and lower_incisor_edge the crest of the bone",
        height, scene::lower_jaw_with_teeth));
  search.put("pogonion_bone", chin_of(profile, menton, menton + 0.45 * height), "no chin", aside);
  const ProfilePoint pogonion = *search.profile_point("pogonion_bone");
  const double lowest = std::max(pogonion.y() + 0.1 * height, menton + 0.35 * height);
  const std::vector<ProfilePoint> above = between(profile, lowest, edge.y() - 0.2 * height);
  search.put("b_point", b_point_of(above, pogonion, edge, menton + usual * height),
             "no bone between pogonion and the lower incisors", aside);
}

/// Returns menton: the middle of the points less than 1 mm above the lowest one of a profile at x =
/// `aside`, seen from below. In front the lowest row of cells lies anywhere on a flat lower border.
std::optional<ProfilePoint> menton_of(const Mandible& mandible, double aside,
                                      const HeadFrame& frame) {
  constexpr double flat = 1;  // mm
  HeadFrame from_below = frame;
  from_below.axes.row(1) = frame.axes.row(2);
  from_below.axes.row(2) = -frame.axes.row(1);
  const FrontMap map(mandible.surface, from_below);
  const auto depth = [](const ProfilePoint& p) { return -p.x(); };
  const auto itself = [](const ProfilePoint& p) { return p; };
  const auto profile = map.profile(map.low_z(), map.high_z(), midline, aside);
  if (profile.empty()) return std::nullopt;
  const ProfilePoint lowest = mean_near_largest(profile, flat, depth, itself);
  return ProfilePoint(-lowest.y(), lowest.x());
}

void search_symphysis(const Mandible& mandible, Search& search) {
  constexpr double cut = 3;  // mm
  const FrontMap map(mandible.surface, search.frame());
  auto profile = map.profile(map.low_z(), map.high_z(), midline);
  const auto lacks = [&](const char* why) {
    search.lack({"menton_bone", "pogonion_bone", "b_point", "lower_incisor_edge"}, why);
  };
  if (profile.empty()) return lacks("MANDIBLE has no bone at the midline");
  const double front = foremost_of(profile)->x(), aside = middle_of_chin(map, profile.front().y());
  if (aside != 0) {
    search.remark(fmt::format(
        "the chin lies {:.0f} mm {} of the skull's midsagittal plane; its landmarks of bone and "
        "skin are put there: check them",
        std::abs(aside), aside > 0 ? "left" : "right"));
    profile = map.profile(map.low_z(), map.high_z(), midline, aside);
    if (profile.empty()) return lacks("MANDIBLE has no bone in the middle of its chin");
  }
  const ProfilePoint lowest = menton_of(mandible, aside, search.frame()).value_or(profile.front());
  if (mandible.end.within(search.frame().to_scan({aside, lowest.x(), lowest.y()}), cut))
    return lacks("MANDIBLE is cut off flat at the chin, where the scan ends");
  search.put("menton_bone", lowest, "", aside);
  const double menton = search.find("menton_bone")->z();
  if (const auto edge = tooth_edge(map, 1, {front + 6, menton + 5}, map.high_z(), 12))
    search.put("lower_incisor_edge", *edge);
  if (!search.find("lower_incisor_edge"))
    return search.lack("lower_incisor_edge", "no bone above the chin at the midline");
  search_chin(profile, aside, search);
}

/// Returns whether the mandible ends at a condyle's top because its scan did.
bool is_cut_off(const Mandible& mandible, const Vec3& top) {
  constexpr double beside = 3;  // mm
  if (mandible.end.within(top, condyle_reach)) return true;
  for (size_t i = 0; i < mandible.surface.points.size(); ++i)
    if (mandible.at_rim[i] && (mandible.surface.points[i] - top).norm() <= beside) return true;
  return false;
}

/// The center of the box around a condyle's points near its top.
Vec3 middle_of_condyle(const std::vector<Vec3>& points, const Vec3& top) {
  Eigen::AlignedBox3d box(top);
  for (const Vec3& p : points)
    if (p.z() >= top.z() - condyle_depth && std::abs(p.y() - top.y()) <= condyle_reach)
      box.extend(p);
  return box.center();
}

void search_ramus(const Mandible& mandible, int side, Search& search) {
  constexpr double range = 2;  // mm, of heights and of sums of way back and down
  const std::string name = side > 0 ? "left" : "right";
  double front = INFINITY, back = -INFINITY;
  std::vector<Vec3> points, rear_points;
  for (const Vec3& point : mandible.surface.points) {
    const Vec3 p = search.frame().to_frame(point);
    front = std::min(front, p.y());
    back = std::max(back, p.y());
    if (side * p.x() > 15) points.push_back(p);
  }
  const double from = back - rear * (back - front);
  for (const Vec3& p : points)
    if (p.y() >= from) rear_points.push_back(p);
  if (rear_points.empty())
    return search.lack(fmt::format("condyle_{}_center", name),
                       fmt::format("MANDIBLE has no {} ramus", name));
  const auto height = [](const Vec3& p) { return p.z(); };
  const auto itself = [](const Vec3& p) { return p; };
  const auto back_and_down = [](const Vec3& p) { return p.y() - p.z(); };
  search.put(fmt::format("gonion_{}", name),
             mean_near_largest(points, range, back_and_down, itself));
  const Vec3 summit = std::ranges::max(rear_points, {}, height);
  if (is_cut_off(mandible, search.frame().to_scan(summit)))
    return search.lack(
        fmt::format("condyle_{}_center", name),
        fmt::format("MANDIBLE is cut off at its {} condyle, where the scan ends", name));
  if (const double higher = largest_of(points, height) - summit.z(); higher > coronoid)
    search.remark(fmt::format(
        "the {} ramus ends {:.0f} mm higher in front, at the coronoid process, than behind: check "
        "whether its condyle is in MANDIBLE; the axes of the head follow the condyles",
        name, higher));
  const Vec3 top = mean_near_largest(rear_points, range, height, itself);
  search.put(fmt::format("condyle_{}_center", name), middle_of_condyle(points, top));
}

/// Remarks on a ramus that is far shorter than the other one: its condyle may be missing.
void remark_uneven(Search& search) {
  std::array<double, 2> length{};
  for (const int side : {0, 1}) {
    const std::string name = side == 0 ? "right" : "left";
    const auto condyle = search.find(fmt::format("condyle_{}_center", name)),
               gonion = search.find(fmt::format("gonion_{}", name));
    if (!condyle || !gonion) return;
    length[side] = (*condyle - *gonion).norm();
  }
  const int shorter = length[1] < length[0] ? 1 : 0;
  if (length[shorter] < uneven * length[1 - shorter])
    search.remark(fmt::format(
        "the {} ramus is {:.0f} mm long, the other {:.0f} mm: check whether its condyle is in "
        "MANDIBLE; the axes of the head follow the condyles",
        shorter == 1 ? "left" : "right", length[shorter], length[1 - shorter]));
}

/// The height of the nasal floor: the median over columns beside the septum of where the nasal
/// opening begins, seen from in front, above the incisors' edge.
std::optional<double> nasal_floor(const FrontMap& map, const ProfilePoint& edge) {
  constexpr double inner = 3, outer = 8, drop = 6, over = 2;  // mm
  constexpr double lowest = 12, highest = 50;                 // mm above the edge
  std::vector<double> heights;
  for (const double aside : map.steps(inner, outer))
    for (const int side : {-1, 1})
      for (const double z : map.steps(edge.y() + lowest, edge.y() + highest)) {
        const auto below = map.depth(side * aside, z - over), here = map.depth(side * aside, z);
        if (below && here && *here - *below < drop) continue;
        if (below) heights.push_back(z - over / 2);
        break;
      }
  if (heights.empty()) return std::nullopt;
  return base::median(std::move(heights));
}

/// The point of a profile above `from` where a line from there touches it in front; nothing where
/// the profile has no point.
std::optional<ProfilePoint> tangent_point(const std::vector<ProfilePoint>& profile,
                                          const ProfilePoint& from) {
  std::optional<ProfilePoint> best;
  double minimum = INFINITY;
  for (const ProfilePoint& p : profile) {
    const double slope = (p.x() - from.x()) / (p.y() - from.y());
    if (!(slope < minimum)) continue;
    minimum = slope;
    best = p;
  }
  return best;
}

/// Nasal spine, point A and nasion, by the skull's profile above the incisors.
void search_nasal_opening(const FrontMap& map, const ProfilePoint& edge, Search& search) {
  constexpr double near = 3;  // mm, of the spine to the nasal floor's height
  const auto profile = map.profile(edge.y(), map.high_z(), midline);
  const auto floor = nasal_floor(map, edge);
  if (!floor)
    return search.lack({"nasal_spine", "a_point", "nasion_bone"},
                       "SKULL has no nasal opening above the upper incisors");
  std::optional<ProfilePoint> deepest;
  for (const ProfilePoint& p : profile)
    if (p.y() > *floor && p.y() < *floor + 25 && (!deepest || p.x() > deepest->x())) deepest = p;
  search.put("nasal_spine",
             farthest_from_chord(between(profile, *floor - near, *floor + near), edge,
                                 deepest.value_or(ProfilePoint(edge.x(), *floor + 10)), 1),
             "SKULL has no bone at the nasal floor");
  const auto spine = search.profile_point("nasal_spine");
  if (spine)
    search.put(
        "a_point",
        farthest_from_chord(between(profile, edge.y() + 9, spine->y() - 4), edge, *spine, -1),
        "SKULL has no bone between the nasal spine and the upper incisors");
  const auto bridge = foremost_of(between(profile, *floor + 15, *floor + 45));
  const auto brow =
      bridge ? tangent_point(between(profile, bridge->y() + 20, bridge->y() + 38), *bridge)
             : std::nullopt;
  if (!brow) return search.lack("nasion_bone", "SKULL ends below the glabella");
  search.put(
      "nasion_bone",
      farthest_from_chord(between(profile, bridge->y() + 5, brow->y() - 3), *bridge, *brow, -1),
      "SKULL ends below the glabella");
}

void search_upper_jaw(const FrontMap& map, Search& search) {
  constexpr double reach = 18, least = 14,
                   most = 32;  // mm, from the lower incisors, or their ridge
  const auto lower = search.find("lower_incisor_edge");
  if (!lower) return search.lack("upper_incisor_edge", "the lower incisors were not found");
  for (double above = least; above <= most && !search.find("upper_incisor_edge"); above += 6) {
    const auto middle = map.foremost(0, lower->z() + above, midline);
    if (!middle || std::abs(*middle - lower->y()) > reach) continue;
    if (const auto edge =
            tooth_edge(map, -1, {*middle, lower->z() + above}, lower->z() - 2 * least, reach / 2))
      search.put("upper_incisor_edge", *edge);
  }
  const auto edge = search.profile_point("upper_incisor_edge");
  if (edge) return search_nasal_opening(map, *edge, search);
  search.lack({"upper_incisor_edge", "nasal_spine", "a_point", "nasion_bone"},
              "SKULL has no bone in front, 14 to 32 mm above the lower incisors");
}

}  // namespace

Mandible::Mandible(const surface::Surface& surface)
    : surface(surface),
      at_rim(
          surface::border_vertices(surface::EdgeTable(surface.triangles), surface.points.size())),
      end(surface) {}

void search_bones(const surface::Surface& skull, const Mandible& mandible, Search& search) {
  search_symphysis(mandible, search);
  for (const int side : {-1, 1}) search_ramus(mandible, side, search);
  remark_uneven(search);
  search_upper_jaw(FrontMap(skull, search.frame()), search);
}

}  // namespace repose::anatomy
