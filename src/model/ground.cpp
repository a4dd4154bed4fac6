#include <algorithm>

#include "add_contact.h"
#include "foundation.h"
#include "layers.h"
#include "loads.h"
#include "point_sets.h"
#include "repose/base/log.h"
#include "repose/model/build.h"
#include "repose/model/material.h"

namespace repose::model {

std::string beyond_columns(const scene::Scene& scene) {
  if (!scene.tissue.material) return "its tissue is springs";
  if (!scene.incisions.empty()) return "it has incisions";
  if (!scene.instruments.empty()) return "it has instruments";
  if (!scene.forces.empty()) return "it has forces";
  if (!scene.tissue.mass.empty()) return "its layers have masses";
  return "";
}

struct Ground::State {
  scene::Scene scene;
  std::vector<surface::Surface> bones;
  Foundation on;
  int64_t layers;
};

namespace {

/// Counts the points and elements that the layers will have.
Counts count(const Foundation& on, int64_t layers) {
  Counts counts;
  for (size_t c = 0; c < on.rim.size(); ++c) {
    const int64_t bone = !on.rim[c] && on.attachment.bone[c] >= 0;
    counts.boundary += on.rim[c] ? layers : 0;
    counts.bone += bone;
    counts.soft += on.rim[c] ? 0 : layers - bone;
  }
  return counts;
}

}  // namespace

Ground::Ground(const Anatomy& anatomy) {
  static const PetscLogEvent event = base::log_event("RpBuild");
  const base::Logged logged(event);
  const auto layers = static_cast<int64_t>(layer_depths(anatomy.scene.tissue).size());
  state_ = std::make_unique<State>(State{anatomy.scene, anatomy.bones,
                                         lay_foundation(anatomy.scene, anatomy.skin, anatomy.bones),
                                         layers});
  Foundation& on = state_->on;
  const Counts counts = count(on, layers);
  require_held(anatomy.scene, on.mesh, on.field, counts, on.attachment);
  prepend_messages(anatomy, on.report);
  report_columns(on, counts.bone, on.report);
}

Ground::~Ground() = default;
Ground::Ground(Ground&&) noexcept = default;

const SkinMesh& Ground::skin() const { return state_->on.mesh; }
int64_t Ground::layers() const { return state_->layers; }
BuildReport Ground::report() const { return state_->on.report; }

int64_t Ground::soft_points(int64_t column) const {
  if (state_->on.rim[column]) return 0;
  return state_->layers - (state_->on.attachment.bone[column] >= 0 ? 1 : 0);
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

Piece Ground::piece(const std::vector<int64_t>& columns) const {
  const Foundation& on = state_->on;
  Piece piece;
  piece.triangle = triangles_at(on.mesh, columns_of(on.mesh, triangles_at(on.mesh, columns)));
  piece.column = columns_of(on.mesh, piece.triangle);
  for (const int64_t c : piece.column) {
    piece.skin.push_back(on.mesh.points[c]);
    piece.deep.push_back(on.columns.deep[c]);
    piece.bone.push_back(on.attachment.bone[c]);
    piece.slides.push_back(on.attachment.slides_on[c]);
    piece.free.push_back(on.attachment.free[c]);
    piece.rim.push_back(on.rim[c]);
  }
  for (const int64_t t : piece.triangle) {
    Triangle& corner = piece.corner.emplace_back();
    for (int k = 0; k < 3; ++k)
      corner[k] =
          std::lower_bound(piece.column.begin(), piece.column.end(), on.mesh.triangles[t][k]) -
          piece.column.begin();
  }
  return piece;
}

Model Ground::frame() const {
  const Foundation& on = state_->on;
  Model frame;
  for (const Triangle& t : on.mesh.triangles)
    frame.skin.push_back({t[0] * state_->layers, t[1] * state_->layers, t[2] * state_->layers});
  frame.gravity = state_->scene.gravity.value_or(Vec3::Zero());
  add_bones(state_->scene, state_->bones, frame);
  frame.contact.spacing = grid_spacing(state_->scene, on);
  return frame;
}

Model raise(const scene::Scene& scene, const std::vector<surface::Surface>& bones,
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
  touch_bones(scene, mesh, attachment, model);
  for (int64_t& column : model.points.column) column = piece.column[column];
  return model;
}

}  // namespace repose::model
