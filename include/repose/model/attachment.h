#pragma once
#include <string>
#include <vector>

#include "repose/model/bone_field.h"
#include "repose/model/columns.h"
#include "repose/scene/scene.h"

namespace repose::model {

/// Which bone each column ends in, [V].
struct Attachment {
  std::vector<int32_t> bone;         ///< −1: its deepest point is free
  std::vector<int64_t> reached;      ///< [bones] columns that could hold to each bone
  double largest_gap = 0;            ///< mm between an attached deepest point and its bone
  int64_t released = 0;              ///< columns let go near a piece that moves differently
  std::vector<std::string> remarks;  ///< lines for a person
};

/// Ties a column that ends at bone, or short of it by no more than 1.5 mm or half its thickness, to
/// the bone nearest to its deepest point; except where that point lies in an `unattached` region.
Attachment attach_columns(const Columns& columns, const BoneField& bones,
                          const scene::Tissue& tissue);

}  // namespace repose::model
