#include "repose/anatomy/propose.h"

#include "repose/base/error.h"
#include "search.h"

namespace repose::anatomy {
namespace {

Vec3 mean_of(const std::vector<Vec3>& points) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

/// Refuses surfaces of which the mandible does not lie as in a head in LPS.
void require_head(const surface::Surface& skin, const surface::Surface& skull,
                  const surface::Surface& mandible) {
  for (const surface::Surface* part : {&skin, &skull, &mandible})
    if (part->points.empty()) base::refuse("{}: has no points", part->name);
  const Vec3 jaw = mean_of(mandible.points), cranium = mean_of(skull.points);
  if (jaw.z() > cranium.z())
    base::refuse(
        "{}: its middle lies {:.0f} mm above that of {}; give the skull and the mandible in this "
        "order, with +z up",
        mandible.name, jaw.z() - cranium.z(), skull.name);
  double low = INFINITY, high = -INFINITY;
  for (const Vec3& p : mandible.points) {
    low = std::min(low, p.z());
    high = std::max(high, p.z());
  }
  std::vector<Vec3> chin, rami;
  for (const Vec3& p : mandible.points)
    if (p.z() < low + (high - low) / 3)
      chin.push_back(p);
    else if (p.z() > high - (high - low) / 4)
      rami.push_back(p);
  if (const double back = mean_of(chin).y() - mean_of(rami).y(); back > 0)
    base::refuse(
        "{}: its chin lies {:.0f} mm behind its rami along +y, as in RAS; surfaces must be in LPS: "
        "change the signs of x and y",
        mandible.name, back);
  constexpr double beside = 30;  // mm
  Vec3 minimum = skin.points.front(), maximum = minimum;
  for (const Vec3& p : skin.points) {
    minimum = minimum.cwiseMin(p);
    maximum = maximum.cwiseMax(p);
  }
  if (((jaw - minimum).array() < -beside).any() || ((maximum - jaw).array() < -beside).any())
    base::refuse("{}: the mandible {} lies outside of it; give surfaces of one head in one frame",
                 skin.name, mandible.name);
}

}  // namespace

Proposal propose_landmarks(const surface::Surface& skin, const surface::Surface& skull,
                           const surface::Surface& mandible, const Landmarks& given) {
  require_head(skin, skull, mandible);
  HeadFrame frame = fit_head_frame(skull);
  constexpr int turns = 3;
  for (int turn = 0; turn < turns; ++turn) {
    Search search(frame, given);
    search_bones(skull, mandible, search);
    const Landmarks found = search.proposal().found;
    const auto nasion = found.find("nasion_bone"), pogonion = found.find("pogonion_bone");
    if (nasion == found.end() || pogonion == found.end()) break;
    frame = frame.upright(pogonion->second, nasion->second);
  }
  Search search(frame, given);
  search_bones(skull, mandible, search);
  search_skin(skin, search);
  return search.proposal();
}

}  // namespace repose::anatomy
