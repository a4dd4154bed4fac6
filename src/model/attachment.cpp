#include "attachment.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "region.h"
#include "repose/base/error.h"

namespace repose::model {
namespace {

constexpr double attached_within = 1.5;            // mm
constexpr double attached_within_per_depth = 0.5;  // of the column's thickness

std::vector<scene::Attach> requested_attachments(const Columns& columns, const scene::Scene& scene,
                                                 Attachment& attachment) {
  const scene::Tissue& tissue = scene.tissue;
  constexpr double near = 2;  // mm: columns end on the surface of what is segmented
  constexpr std::array words = {"hold to it", "slide along it", "touch it", "ignore it"};
  std::vector<scene::Attach> requested(columns.deep.size(), tissue.attach);
  for (size_t k = 0; k < tissue.attach_regions.size(); ++k) {
    const scene::Region& where = tissue.attach_regions[k].where;
    const scene::Attach how = tissue.attach_regions[k].attach;
    const bool segmented = std::holds_alternative<scene::ClosedMesh>(where) ||
                           std::holds_alternative<scene::LabelRegion>(where);
    const Contains inside = contains_of(where, segmented ? near : 0);
    int64_t met = 0;
    for (size_t v = 0; v < columns.deep.size(); ++v) {
      if (attachment.bone[v] < 0 || !inside(columns.deep[v])) continue;
      requested[v] = how;
      ++met;
    }
    if (met == 0 && how == scene::Attach::slide)
      base::refuse(
          "{}: region {} of tissue.attach_regions and teeth, counted from 0 in this order, is to "
          "slide and holds no column that ends at bone; move it to where tissue meets bone, or "
          "make it larger",
          scene.file.string(), k);
    attachment.remarks.push_back(
        fmt::format("attach region {}: {} columns end at bone there and {}", k, met,
                    words[static_cast<size_t>(how)]));
  }
  return requested;
}

}  // namespace

void open_gaps(const std::vector<Vec3>& skin, const scene::Scene& scene, Columns& columns) {
  constexpr double maximum = 1.0 / 3;  // of a column
  const auto& regions = scene.tissue.attach_regions;
  if (std::ranges::none_of(regions, [](const auto& region) { return region.gap > 0; })) return;
  std::vector<double> gaps(columns.deep.size(), 0);
  for (const scene::AttachRegion& region : regions) {
    const Contains inside = contains_of(region.where, 0);
    for (size_t v = 0; v < gaps.size(); ++v)
      if (columns.holds[v] && inside(columns.deep[v])) gaps[v] = region.gap;
  }
  for (size_t v = 0; v < gaps.size(); ++v) {
    const double shorter = std::min(gaps[v], maximum * columns.thickness[v]);
    if (!(shorter > 0)) continue;
    columns.deep[v] += shorter / columns.thickness[v] * (skin[v] - columns.deep[v]);
    columns.thickness[v] -= shorter;
  }
}

void Attachment::settle(size_t column, scene::Attach how) {
  if (how == scene::Attach::fixed) return;
  if (how == scene::Attach::slide) slides_on[column] = bone[column];
  if (how == scene::Attach::free) free[column] = 1;
  bone[column] = -1;
}

Attachment attach_columns(const Columns& columns, const BoneField& bones,
                          const scene::Scene& scene) {
  Attachment attachment;
  attachment.bone.assign(columns.deep.size(), -1);
  attachment.slides_on.assign(columns.deep.size(), -1);
  attachment.free.assign(columns.deep.size(), 0);
  attachment.support.assign(columns.deep.size(), -1);
  attachment.support_stiffness.assign(columns.deep.size(), 0);
  attachment.supported_whole.assign(columns.deep.size(), 0);
  attachment.reached.assign(bones.size(), 0);
  for (size_t v = 0; v < columns.deep.size(); ++v) {
    if (!columns.holds[v]) continue;
    const BoneField::Nearest nearest = bones.nearest(columns.deep[v]);
    if (nearest.distance >
        std::max(attached_within, attached_within_per_depth * columns.thickness[v]))
      continue;
    attachment.bone[v] = nearest.bone;
    attachment.largest_gap = std::max(attachment.largest_gap, nearest.distance);
    ++attachment.reached[nearest.bone];
  }
  const std::vector<scene::Attach> requested = requested_attachments(columns, scene, attachment);
  for (size_t v = 0; v < requested.size(); ++v)
    if (attachment.bone[v] >= 0) attachment.settle(v, requested[v]);
  return attachment;
}

}  // namespace repose::model
