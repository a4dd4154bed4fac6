#include <algorithm>
#include <array>
#include <cmath>

#include "head_directions.h"
#include "repose/model/build.h"
#include "repose/surface/triangle_tree.h"

namespace repose::model {
namespace {

constexpr double lip_forward = 12, upper_lip_up = 9, lower_lip_down = 7;  // mm from the lower teeth
constexpr double chin_forward = 8, beside_middle = 12;                    // mm
constexpr double nose_above = 15, nose_below = 60;                        // mm above the teeth
constexpr double farthest_skin = 15;                                      // mm from a place

struct Named {
  const char *landmark, *name;
};
constexpr std::array<Named, 4> places = {{{"pogonion_soft", "chin"},
                                          {"lower_lip", "lower lip"},
                                          {"upper_lip", "upper lip"},
                                          {"pronasale", "nose"}}};

/// The point of the skin nearest to another; nothing where none is near.
void add_nearest(const std::string& name, const Vec3& point, const surface::TriangleTree& skin,
                 std::vector<FacePlace>& found) {
  const auto nearest = skin.nearest(point, farthest_skin * farthest_skin);
  if (nearest.triangle >= 0) found.push_back({name, nearest.point});
}

void add_nose(const JawPoints& jaw, const HeadDirections& frame, const std::vector<Vec3>& skin,
              std::vector<FacePlace>& found) {
  const Vec3* tip = nullptr;
  for (const Vec3& x : skin) {
    const Vec3 from = x - jaw.incisor;
    const double up = frame.up.dot(from);
    if (std::abs(frame.left.dot(from)) > beside_middle || up < nose_above || up > nose_below)
      continue;
    if (!tip || frame.forward.dot(x) > frame.forward.dot(*tip)) tip = &x;
  }
  if (tip) found.push_back({"nose", *tip});
}

}  // namespace

std::vector<FacePlace> face_places(const Anatomy& anatomy) {
  std::vector<FacePlace> found;
  const surface::TriangleTree skin(anatomy.skin);
  for (const auto& [landmark, name] : places)
    if (const auto at = anatomy.scene.landmarks.find(landmark); at != anatomy.scene.landmarks.end())
      add_nearest(name, at->second, skin, found);
  if (!found.empty()) return found;
  const std::vector<BoneRole> roles = roles_of(anatomy.scene);
  const BoneGroup lower = bones_of(BoneRole::lower, roles, anatomy.bones);
  const auto frame = head_directions(make_skin_mesh(anatomy.skin),
                                     bones_of(BoneRole::upper, roles, anatomy.bones), lower);
  if (!frame) return {};
  const JawPoints jaw = jaw_points(lower, *frame);
  const Vec3 lips = jaw.incisor + lip_forward * frame->forward;
  add_nearest("chin", jaw.chin + chin_forward * frame->forward, skin, found);
  add_nearest("lower lip", lips - lower_lip_down * frame->up, skin, found);
  add_nearest("upper lip", lips + upper_lip_up * frame->up, skin, found);
  add_nose(jaw, *frame, anatomy.skin.points, found);
  return found;
}

}  // namespace repose::model
