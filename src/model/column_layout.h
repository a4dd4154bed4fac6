#pragma once
#include <vector>

#include "attachment.h"
#include "bone_field.h"
#include "columns.h"
#include "repose/model/build.h"
#include "repose/model/cut.h"
#include "repose/model/skin_mesh.h"
#include "repose/scene/scene.h"

namespace repose::model {

/// The columns of a scene's tissue, laid and attached.
struct ColumnLayout {
  SkinMesh mesh;  ///< with the paths of the incisions as edges
  std::vector<Cut> cuts;
  BoneField field;
  Columns columns;
  Attachment attachment;
  std::vector<char> rim;  ///< [V] 1: a column that is held in whole
  BuildReport report;     ///< with the remarks so far
};

/// As ColumnGeometry's constructor, but for the loads.
ColumnLayout lay_out_columns(const scene::Scene& scene, const surface::Surface& skin,
                             const std::vector<surface::Surface>& bones);

/// Gives a model of make_layers the scene's bones, as they are and go.
void add_bones(const scene::Scene& scene, const std::vector<surface::Surface>& bones, Model& model);

/// Puts an anatomy's remarks and warnings before those of the report.
void prepend_messages(const Anatomy& anatomy, BuildReport& report);

/// Adds the columns, of which `attached` end in bone, to the layout's report.
void report_columns(int64_t attached, ColumnLayout& layout);

}  // namespace repose::model
