#pragma once
#include <string>
#include <vector>

#include "bone_field.h"
#include "columns.h"
#include "repose/model/build.h"

namespace repose::model {

/// Attachment of columns, [V].
struct Attachment : ColumnEnds {
  std::vector<int64_t> reached;      ///< [bones] columns that could hold to each bone
  double largest_gap = 0;            ///< mm between an attached deepest point and its bone
  int64_t released = 0;              ///< columns released near a piece that moves differently
  std::vector<std::string> remarks;  ///< lines for a person

  /// A column that moves with a bone does otherwise.
  void settle(size_t column, scene::Attach how);
};

/// Shortens columns that end at bone in a region with a gap, by the gap but no more than a third of
/// their length. `skin` [V] is where they begin, mm.
void open_gaps(const std::vector<Vec3>& skin, const scene::Scene& scene, Columns& columns);

/// Ties a column that ends at bone, or short of it by no more than 1.5 mm or half its thickness, to
/// the bone nearest to its deepest point; then all do what the scene's tissue is to, by region (a
/// mesh or a label holds what is up to 2 mm from it). Throws InputError where a region holds no
/// column that ends at bone and is to slide.
Attachment attach_columns(const Columns& columns, const BoneField& bones,
                          const scene::Scene& scene);

}  // namespace repose::model
