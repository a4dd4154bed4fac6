#include "orientation.h"

#include <Eigen/Geometry>

#include "repose/model/skin_mesh.h"
#include "repose/surface/edges.h"

namespace repose::model {
namespace {

constexpr double far_apart = 200, near = 50;  // mm

using Box = Eigen::AlignedBox3d;

std::string corner_text(const Box& box) {
  return fmt::format("{:.0f} to {:.0f} mm", box.min(), box.max());
}

void refuse_far_apart(const std::string& skin_name, const surface::Surface& bone,
                      const Box& skin_box, const Box& bone_box) {
  const Vec3 turn(-1, -1, 1);
  Box turned;
  turned.extend(turn.cwiseProduct(bone_box.min()));
  turned.extend(turn.cwiseProduct(bone_box.max()));
  const bool other_frame = skin_box.exteriorDistance(turned) <= near;
  base::refuse("{} is at {}, but {} at {}: {:.0f} mm apart; {}", skin_name, corner_text(skin_box),
               bone.name, corner_text(bone_box), skin_box.exteriorDistance(bone_box),
               other_frame ? "one is in LPS and the other in RAS coordinates, export both in one"
                           : "export both in the coordinates of one scan, in mm");
}

}  // namespace

void require_same_place(const SkinMesh& mesh, const std::string& skin_name,
                        const std::vector<surface::Surface>& bones, const BoneField& field) {
  const Box skin_box = surface::bounding_box(mesh.points);
  for (const surface::Surface& bone : bones)
    if (const Box box = surface::bounding_box(bone.points);
        skin_box.exteriorDistance(box) > far_apart)
      refuse_far_apart(skin_name, bone, skin_box, box);
  std::vector<int64_t> inside;
  for (size_t v = 0; v < mesh.points.size(); ++v)
    if (field.containing(mesh.points[v]) >= 0) inside.push_back(static_cast<int64_t>(v));
  if (!inside.empty())
    refuse_places(
        skin_name, mesh, inside,
        fmt::format("{} of {} vertices lie inside bone (the first in {})", inside.size(),
                    mesh.points.size(), bones[field.containing(mesh.points[inside.front()])].name),
        "the skin must be outside all bone: check that both come from one scan and in one "
        "frame");
}

bool face_outwards(const std::vector<BoneField::Nearest>& nearest, SkinMesh& mesh) {
  double towards_bone = 0;
  for (size_t v = 0; v < nearest.size(); ++v) {
    if (nearest[v].bone < 0) continue;
    const Vec3 towards = nearest[v].point - mesh.points[v];
    towards_bone += mesh.vertex_area[v] * (mesh.vertex_normal[v].dot(towards) > 0 ? 1 : -1);
  }
  if (towards_bone >= 0) return false;
  flip(mesh);
  return true;
}

}  // namespace repose::model
