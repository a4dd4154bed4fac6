#include <algorithm>

#include "add_contact.h"
#include "column_layout.h"
#include "layers.h"
#include "loads.h"
#include "point_sets.h"
#include "repose/base/log.h"
#include "repose/model/build.h"
#include "repose/model/material.h"

namespace repose::model {

std::string explain_central_build(const scene::Scene& scene) {
  if (!scene.tissue.material) return "its tissue is springs";
  if (!scene.incisions.empty()) return "it has incisions";
  if (!scene.instruments.empty()) return "it has instruments";
  if (!scene.forces.empty()) return "it has forces";
  if (!scene.tissue.mass.empty()) return "its layers have masses";
  return "";
}

struct ColumnGeometry::State {
  scene::Scene scene;
  std::vector<surface::Surface> bones;
  ColumnLayout layout;
  int64_t layers;
};

namespace {

/// Counts the points and elements that the layers will have.
Counts count(const ColumnLayout& layout, int64_t layers) {
  Counts counts;
  for (size_t c = 0; c < layout.rim.size(); ++c) {
    const int64_t bone = !layout.rim[c] && layout.attachment.bone[c] >= 0;
    counts.boundary += layout.rim[c] ? layers : 0;
    counts.bone += bone;
    counts.soft += layout.rim[c] ? 0 : layers - bone;
  }
  return counts;
}

}  // namespace

ColumnGeometry::ColumnGeometry(const Anatomy& anatomy) {
  static const PetscLogEvent event = base::log_event("RpBuild");
  const base::Logged logged(event);
  const auto layers = static_cast<int64_t>(layer_depths(anatomy.scene.tissue).size());
  state_ = std::make_unique<State>(
      State{anatomy.scene, anatomy.bones,
            lay_out_columns(anatomy.scene, anatomy.skin, anatomy.bones), layers});
  ColumnLayout& layout = state_->layout;
  const Counts counts = count(layout, layers);
  require_held(anatomy.scene, layout.mesh, layout.field, counts, layout.attachment);
  prepend_messages(anatomy, layout.report);
  report_columns(layout, counts.bone, layout.report);
}

ColumnGeometry::~ColumnGeometry() = default;
ColumnGeometry::ColumnGeometry(ColumnGeometry&&) noexcept = default;

const SkinMesh& ColumnGeometry::skin() const { return state_->layout.mesh; }
int64_t ColumnGeometry::layers() const { return state_->layers; }
BuildReport ColumnGeometry::report() const { return state_->layout.report; }

int64_t ColumnGeometry::soft_points(int64_t column) const {
  if (state_->layout.rim[column]) return 0;
  return state_->layers - (state_->layout.attachment.bone[column] >= 0 ? 1 : 0);
}

namespace {

void make_unique(std::vector<int64_t>& rows) {
  std::sort(rows.begin(), rows.end());
  rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
}

/// The triangles at the given columns.
std::vector<int64_t> triangles_at(const SkinMesh& mesh, const std::vector<int64_t>& columns) {
  std::vector<int64_t> triangles;
  for (const int64_t c : columns) {
    const auto around = mesh.triangles_of[c];
    triangles.insert(triangles.end(), around.begin(), around.end());
  }
  make_unique(triangles);
  return triangles;
}

std::vector<int64_t> columns_of(const SkinMesh& mesh, const std::vector<int64_t>& triangles) {
  std::vector<int64_t> columns;
  for (const int64_t t : triangles)
    columns.insert(columns.end(), mesh.triangles[t].begin(), mesh.triangles[t].end());
  make_unique(columns);
  return columns;
}

}  // namespace

Piece ColumnGeometry::piece(const std::vector<int64_t>& columns) const {
  const ColumnLayout& layout = state_->layout;
  Piece piece;
  piece.triangle =
      triangles_at(layout.mesh, columns_of(layout.mesh, triangles_at(layout.mesh, columns)));
  piece.column = columns_of(layout.mesh, piece.triangle);
  for (const int64_t c : piece.column) {
    piece.skin.push_back(layout.mesh.points[c]);
    piece.deep.push_back(layout.columns.deep[c]);
    piece.bone.push_back(layout.attachment.bone[c]);
    piece.slides.push_back(layout.attachment.slides_on[c]);
    piece.free.push_back(layout.attachment.free[c]);
    piece.rim.push_back(layout.rim[c]);
  }
  for (const int64_t t : piece.triangle) {
    Triangle& corner = piece.corner.emplace_back();
    for (int k = 0; k < 3; ++k)
      corner[k] =
          std::lower_bound(piece.column.begin(), piece.column.end(), layout.mesh.triangles[t][k]) -
          piece.column.begin();
  }
  return piece;
}

Model ColumnGeometry::global_metadata() const {
  const ColumnLayout& layout = state_->layout;
  Model global_metadata;
  for (const Triangle& t : layout.mesh.triangles)
    global_metadata.skin.push_back(
        {t[0] * state_->layers, t[1] * state_->layers, t[2] * state_->layers});
  global_metadata.gravity = state_->scene.gravity.value_or(Vec3::Zero());
  add_bones(state_->scene, state_->bones, global_metadata);
  global_metadata.contact.spacing = grid_spacing(state_->scene, layout);
  return global_metadata;
}

Model build_local(const scene::Scene& scene, const std::vector<surface::Surface>& bones,
                  const Piece& piece, std::vector<int64_t>& found) {
  SkinMesh mesh;
  mesh.points = piece.skin;
  mesh.triangles = piece.corner;
  Attachment attachment;
  attachment.bone = piece.bone;
  attachment.slides_on = piece.slides;
  attachment.free = piece.free;
  Model model = make_layers(mesh, piece.deep, layer_depths(scene.tissue), scene.tissue.depths_mm,
                            Elements::solid);
  found.assign(scene.tissue.material->regions.size(), 0);
  model.gravity = scene.gravity.value_or(Vec3::Zero());
  add_bones(scene, bones, model);
  if (!piece.column.empty()) {
    set_points(piece.rim, attachment, scene.moves, model);
    found = set_material(scene.tissue, scene.file.string(), model);
    set_masses(scene.tissue, mesh, model);
  }
  add_bone_contact(scene, mesh, attachment, model);
  for (int64_t& column : model.points.column) column = piece.column[column];
  return model;
}

}  // namespace repose::model
