#include "repose/model/attachment.h"

#include <fmt/format.h>

#include <algorithm>

namespace repose::model {
namespace {

constexpr double gap = 1.5;            // mm
constexpr double gap_per_depth = 0.5;  // of the column's thickness

bool in_region(const scene::SphereRegion& region, const Vec3& point) {
  return (point - region.center).norm() <= region.radius;
}

void let_go(const Columns& columns, const scene::Tissue& tissue, Attachment& attachment) {
  for (size_t k = 0; k < tissue.unattached.size(); ++k) {
    int64_t met = 0;
    for (size_t v = 0; v < columns.deep.size(); ++v) {
      if (attachment.bone[v] < 0 || !in_region(tissue.unattached[k], columns.deep[v])) continue;
      attachment.bone[v] = -1;
      ++met;
    }
    attachment.remarks.push_back(fmt::format(
        "unattached region {}: {} columns end at bone there and do not hold to it", k, met));
  }
}

}  // namespace

Attachment attach_columns(const Columns& columns, const BoneField& bones,
                          const scene::Tissue& tissue) {
  Attachment attachment;
  attachment.bone.assign(columns.deep.size(), -1);
  attachment.reached.assign(bones.size(), 0);
  for (size_t v = 0; v < columns.deep.size(); ++v) {
    if (!columns.holds[v]) continue;
    const BoneField::Nearest nearest = bones.nearest(columns.deep[v]);
    if (nearest.distance > std::max(gap, gap_per_depth * columns.thickness[v])) continue;
    attachment.bone[v] = nearest.bone;
    attachment.largest_gap = std::max(attachment.largest_gap, nearest.distance);
    ++attachment.reached[nearest.bone];
  }
  let_go(columns, tissue, attachment);
  return attachment;
}

}  // namespace repose::model
