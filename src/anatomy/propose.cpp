#include "repose/anatomy/propose.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>

#include "repose/base/error.h"
#include "repose/surface/component.h"
#include "repose/surface/edges.h"
#include "repose/surface/read.h"
#include "search.h"

namespace repose::anatomy {
namespace {

/// The largest distance, mm, of a point from the middle of all.
double reach_of(const surface::Surface& part) {
  const Vec3 middle = base::mean(part.points);
  double reach = 0;
  for (const Vec3& p : part.points) reach = std::max(reach, (p - middle).norm());
  return reach;
}

/// Refuses surfaces that are not the skin, the skull and the mandible of one head in mm.
void require_head(const surface::Surface& skin, const surface::Surface& skull,
                  const surface::Surface& mandible) {
  for (const surface::Surface* part : {&skin, &skull, &mandible})
    if (part->points.empty()) base::refuse("{}: has no points", part->name);
  constexpr double min_reach = 35, max_reach = 170;  // mm
  const double reach = reach_of(mandible), skull_reach = reach_of(skull);
  if (skull_reach < reach)
    base::refuse(
        "{}: reaches {:.3g} mm from its middle, more than {} ({:.3g} mm); give the skull and the "
        "mandible in this order",
        mandible.name, reach, skull.name, skull_reach);
  if (!(reach >= min_reach && reach <= max_reach))
    base::refuse(
        "{}: reaches {:.3g} mm from its middle, a mandible {:g} to {:g} mm; surfaces must be in mm",
        mandible.name, reach, min_reach, max_reach);
  constexpr double beside = 30;  // mm
  const Vec3 jaw = base::mean(mandible.points);
  const Eigen::AlignedBox3d box = surface::bounding_box(skin.points);
  if (((jaw - box.min()).array() < -beside).any() || ((box.max() - jaw).array() < -beside).any())
    base::refuse("{}: the mandible {} lies outside of it; give surfaces of one head in one frame",
                 skin.name, mandible.name);
}

/// Returns a surface without points that coincide and without specks: parts of less than `least` of
/// the area of the largest one. A tooth that is apart has more.
surface::Surface without_specks(const surface::Surface& raw, const char* label,
                                std::vector<std::string>& remarks) {
  constexpr double least = 0.001, notable = 0.01;  // of the area of the largest part
  const std::vector<surface::Surface> parts = surface::components(surface::welded(raw));
  std::vector<double> areas;
  for (const surface::Surface& part : parts) areas.push_back(surface::area_of(part));
  const double largest = areas.empty() ? 0 : std::ranges::max(areas);
  surface::Surface kept{raw.name, {}, {}};
  double left_out = 0;
  int count = 0;
  for (size_t i = 0; i < parts.size(); ++i) {
    if (areas[i] >= least * largest) {
      surface::append(parts[i], kept);
      continue;
    }
    left_out += areas[i];
    ++count;
  }
  if (left_out > notable * largest)
    remarks.push_back(
        fmt::format("{} small separate parts of {} were left out, with {:.1f} % of the area of the "
                    "largest part",
                    count, label, 100 * left_out / largest));
  return kept;
}

/// Remarks on a mandible whose triangles point inwards. A head looks alike when left and right are
/// exchanged, so that shape alone does not show it.
void remark_mirrored(const surface::Surface& mandible, Search& search) {
  if (surface::volume_of(mandible) < 0)
    search.remark(
        "triangles of MANDIBLE point inwards, as in a head that is mirrored: check that its left "
        "is the patient's left");
}

/// Returns how a head of which these axes point the other way is brought into LPS. Of a mirrored
/// head the frame has left and right exchanged.
std::string remedy_of(const std::vector<std::string>& opposite) {
  std::vector<std::string> mirrored;
  if (opposite[0] == "x")
    mirrored.assign(opposite.begin() + 1, opposite.end());
  else
    mirrored = {"x", "y", "z"};
  return fmt::format("change the signs of {}, or of {} alone if the scan is mirrored",
                     fmt::join(opposite, ", "), fmt::join(mirrored, ", "));
}

/// Refuses a head that is turned in the scan by more than a patient is. A pitch of 45° with a yaw
/// and a roll of 30° is a turn of at most 67°.
void require_lps(const HeadFrame& frame, const std::string& name) {
  constexpr double most = 75 * std::numbers::pi / 180;
  if (Eigen::AngleAxisd(frame.axes).angle() <= most) return;
  std::vector<std::string> along, opposite;
  bool turned = false;
  for (int axis = 0; axis < 3; ++axis) {
    int nearest = 0;
    frame.axes.row(axis).cwiseAbs().maxCoeff(&nearest);
    const std::string letter(1, "xyz"[nearest]);
    const bool negative = frame.axes(axis, nearest) < 0;
    along.push_back((negative ? "-" : "+") + letter);
    if (negative) opposite.push_back(letter);
    turned = turned || nearest != axis;
  }
  const bool ras = !turned && opposite == std::vector<std::string>{"x", "y"};
  base::refuse(
      "{}: by the shape of the bones the head's left, back, up lie along {}{}; surfaces must be "
      "in LPS, where they lie along +x, +y, +z: {}",
      name, fmt::join(along, ", "), ras ? ", as in RAS" : "",
      turned ? "turn the head" : remedy_of(opposite));
}

}  // namespace

Proposal propose_landmarks(const surface::Surface& raw_skin, const surface::Surface& raw_skull,
                           const surface::Surface& raw_mandible, const Landmarks& given) {
  std::vector<std::string> remarks;
  const surface::Surface skin = without_specks(raw_skin, "SKIN", remarks),
                         skull = without_specks(raw_skull, "SKULL", remarks),
                         mandible = without_specks(raw_mandible, "MANDIBLE", remarks);
  require_head(skin, skull, mandible);
  HeadFrame frame = fit_head_frame(skull, mandible);
  require_lps(frame, mandible.name);
  constexpr int turns = 3;
  const Mandible prepared(mandible);
  for (int turn = 0; turn < turns; ++turn) {
    Search search(frame, given);
    search_bones(skull, prepared, search);
    const Landmarks found = search.proposal().found;
    const auto nasion = found.find("nasion_bone"), pogonion = found.find("pogonion_bone");
    if (nasion == found.end() || pogonion == found.end()) break;
    frame = frame.upright(pogonion->second, nasion->second);
  }
  Search search(frame, given);
  search_bones(skull, prepared, search);
  search_skin(skin, search);
  remark_mirrored(mandible, search);
  for (const std::string& remark : remarks) search.remark(remark);
  return search.proposal();
}

}  // namespace repose::anatomy
