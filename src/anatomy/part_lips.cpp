#include "part_lips.h"

#include <algorithm>

#include "lip_crease.h"
#include "repose/anatomy/complete.h"
#include "repose/anatomy/propose.h"
#include "repose/base/error.h"
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

}  // namespace

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
