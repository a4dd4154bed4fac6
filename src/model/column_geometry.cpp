#include <algorithm>

#include "add_adhesion.h"
#include "add_contact.h"
#include "add_supports.h"
#include "column_layout.h"
#include "cut_sides.h"
#include "layers.h"
#include "loads.h"
#include "point_sets.h"
#include "repose/base/error.h"
#include "repose/base/geometry.h"
#include "repose/base/log.h"
#include "repose/model/build.h"
#include "repose/model/material.h"
#include "repose/model/stiffness.h"

namespace repose::model {

struct ColumnGeometry::State {
  scene::Scene scene;
  std::vector<surface::Surface> bones;
  ColumnLayout layout;
  ColumnLoads loads;
  std::vector<AdheringJaw> jaws;
  std::vector<char> parted;  // [columns]
  int64_t layers;
  double slope = 0;
  size_t cuts = 0;  // that are in the model, the first of layout.cuts
  std::vector<DoubledColumn> doubled = {};
  std::vector<int64_t> doubled_points = {};  // [columns]

  bool is_held(int64_t column) const { return loads.instrument[column] >= 0; }
  bool ends_in_bone(int64_t column) const {
    return !layout.rim[column] && layout.attachment.bone[column] >= 0;
  }
  int64_t soft_points(int64_t column) const {
    if (layout.rim[column]) return 0;
    return layers - (is_held(column) ? 1 : 0) - (ends_in_bone(column) ? 1 : 0);
  }
  Counts count() const;
  std::optional<AdhesionRule> adhesion() const;
  void require_free_cuts() const;
  void prepare_cuts();
  void double_columns(size_t first_cuts);
};

/// Counts the points that the layers will have.
Counts ColumnGeometry::State::count() const {
  Counts counts;
  for (int64_t c = 0; c < static_cast<int64_t>(layout.rim.size()); ++c) {
    counts.boundary += layout.rim[c] ? layers : 0;
    counts.bone += ends_in_bone(c) ? 1 : 0;
    counts.soft += soft_points(c);
  }
  return counts;
}

std::optional<AdhesionRule> ColumnGeometry::State::adhesion() const {
  if (jaws.empty()) return {};
  AdhesionRule rule = adhesion_rule(*scene.anatomy, jaws);
  for (size_t c = 0; c < parted.size(); ++c)
    if (parted[c]) rule.cut_columns.push_back(static_cast<int64_t>(c));
  return rule;
}

void ColumnGeometry::State::require_free_cuts() const {
  for (size_t i = 0; i < layout.cuts.size(); ++i)
    for (const int64_t column : layout.cuts[i].columns) {
      if (!is_held(column)) continue;
      const Vec3& at = layout.mesh.points[column];
      base::refuse("{}: {}: an instrument holds the skin on the path near {:.2f}; move one of them",
                   scene.file.string(), scene.incisions[i].name, at);
    }
}

void ColumnGeometry::State::prepare_cuts() {
  std::ranges::stable_partition(layout.cuts, &Cut::lips);
  parted.assign(layout.rim.size(), 0);
  for (Cut& cut : layout.cuts) {
    add_skin_around(layout.mesh.points, layout.mesh.triangles, cut);
    for (const int64_t column : cut.columns) parted[column] = 1;
  }
  double_columns(layout.cuts.size());
}

void ColumnGeometry::State::double_columns(size_t first_cuts) {
  const auto columns = static_cast<int64_t>(layout.rim.size());
  cuts = first_cuts;
  doubled.clear();
  doubled_points.assign(columns, 0);
  int64_t first_row = columns * layers;
  for (size_t k = 0; k < cuts; ++k) {
    const Cut& cut = layout.cuts[k];
    std::vector<int64_t> inner(cut.columns.begin() + 1, cut.columns.end() - 1);
    std::ranges::sort(inner);
    for (const int64_t column : inner) {
      const int64_t points = std::min<int64_t>(cut.layers, soft_points(column));
      doubled.push_back({column, static_cast<int64_t>(k), points, first_row});
      doubled_points[column] = points;
      first_row += points;
    }
  }
}

ColumnGeometry::ColumnGeometry(const scene::Scene& scene, const surface::Surface& skin,
                               const std::vector<surface::Surface>& bones) {
  static const PetscLogEvent event = base::log_event("RpBuild");
  const base::Logged logged(event);
  const auto layers = static_cast<int64_t>(layer_depths(scene.tissue).size());
  state_ = std::make_unique<State>(
      State{scene, bones, lay_out_columns(scene, skin, bones), {}, {}, {}, layers});
  ColumnLayout& layout = state_->layout;
  state_->loads = column_loads(scene, layout.mesh, layout.columns, layout.rim);
  state_->require_free_cuts();
  const Counts counts = state_->count();
  require_held(scene, layout.mesh, layout.field, counts, layout.attachment);
  report_columns(counts.bone, layout);
  if (adheres(scene)) state_->jaws = adhering_jaws(*scene.anatomy, layout);
  state_->prepare_cuts();
  if (scene.tissue.isotropic)
    state_->slope = layer_slope(layout.mesh, layout.columns.deep, scene.tissue);
}

ColumnGeometry::ColumnGeometry(const Anatomy& anatomy)
    : ColumnGeometry(anatomy.scene, anatomy.skin, anatomy.bones) {
  prepend_messages(anatomy, state_->layout.report);
}

ColumnGeometry::~ColumnGeometry() = default;
ColumnGeometry::ColumnGeometry(ColumnGeometry&&) noexcept = default;

const SkinMesh& ColumnGeometry::skin() const { return state_->layout.mesh; }
int64_t ColumnGeometry::layers() const { return state_->layers; }
const BuildReport& ColumnGeometry::report() const { return state_->layout.report; }
std::span<const Cut> ColumnGeometry::cuts() const {
  return std::span(state_->layout.cuts).first(state_->cuts);
}
void ColumnGeometry::include_incisions(bool included) {
  const std::vector<Cut>& all = state_->layout.cuts;
  state_->double_columns(included ? all.size() : std::ranges::count_if(all, &Cut::lips));
}
const std::vector<DoubledColumn>& ColumnGeometry::doubled() const { return state_->doubled; }
int64_t ColumnGeometry::soft_points(int64_t column) const {
  return state_->soft_points(column) + state_->doubled_points[column];
}

std::vector<std::vector<int64_t>> ColumnGeometry::held() const {
  std::vector<std::vector<int64_t>> rows(state_->scene.instruments.size());
  const std::vector<int32_t>& instrument = state_->loads.instrument;
  for (size_t c = 0; c < instrument.size(); ++c)
    if (instrument[c] >= 0) rows[instrument[c]].push_back(static_cast<int64_t>(c) * layers());
  return rows;
}

Piece ColumnGeometry::piece(const std::vector<int64_t>& columns) const {
  const ColumnLayout& layout = state_->layout;
  Piece piece;
  piece.triangle =
      triangles_at(layout.mesh, vertices_of(layout.mesh, triangles_at(layout.mesh, columns)));
  piece.column = vertices_of(layout.mesh, piece.triangle);
  piece.slope = state_->slope;
  for (const int64_t t : piece.triangle)
    piece.edge.insert(piece.edge.end(), layout.mesh.triangle_edges[t].begin(),
                      layout.mesh.triangle_edges[t].end());
  base::sort_unique(piece.edge);
  const auto here = [&](const auto& values) { return base::pick(values, piece.column); };
  piece.skin = here(layout.mesh.points);
  piece.deep = here(layout.columns.deep);
  piece.rim = here(layout.rim);
  piece.parted = here(state_->parted);
  const ColumnEnds& ends = layout.attachment;
  piece.ends = {here(ends.bone),    here(ends.slides_on),         here(ends.free),
                here(ends.support), here(ends.support_stiffness), here(ends.supported_whole)};
  const ColumnLoads& loads = state_->loads;
  piece.loads = {here(loads.instrument), here(loads.target), here(loads.force), loads.layer_area};
  const auto rows_of = [&](std::array<int64_t, 3> columns) {
    for (int64_t& c : columns) c = std::ranges::lower_bound(piece.column, c) - piece.column.begin();
    return columns;
  };
  for (const int64_t t : piece.triangle) piece.corner.push_back(rows_of(layout.mesh.triangles[t]));
  piece.jaws = state_->jaws;
  return piece;
}

double ColumnGeometry::spacing() const { return grid_spacing(state_->scene, state_->layout); }

namespace {

/// The corners left of cuts become the doubles.
void part_skin(const SkinMesh& mesh, const std::vector<Cut>& cuts,
               const std::vector<DoubledColumn>& doubled, std::vector<Triangle>& skin) {
  std::vector<CutSides> sides;
  for (const Cut& cut : cuts) sides.emplace_back(cut.columns, cut.around);
  for (const DoubledColumn& at : doubled)
    for (const int64_t t : mesh.triangles_of[at.column]) {
      const Triangle& corners = mesh.triangles[t];
      if (at.points == 0 || !sides[at.cut].left_triangle(at.column, corners)) continue;
      skin[t][std::ranges::find(corners, at.column) - corners.begin()] = at.first_row;
    }
}

}  // namespace

Model ColumnGeometry::global_metadata() const {
  const ColumnLayout& layout = state_->layout;
  Model global_metadata;
  for (const Triangle& t : layout.mesh.triangles)
    global_metadata.skin.push_back(
        {t[0] * state_->layers, t[1] * state_->layers, t[2] * state_->layers});
  part_skin(layout.mesh, layout.cuts, state_->doubled, global_metadata.skin);
  global_metadata.gravity = state_->scene.gravity.value_or(Vec3::Zero());
  add_bones(state_->scene, state_->bones, global_metadata);
  global_metadata.contact.spacing = spacing();
  global_metadata.adhesion = state_->adhesion();
  return global_metadata;
}

Model build_local(const scene::Scene& scene, const std::vector<surface::Surface>& bones,
                  const Piece& piece, std::vector<int64_t>& found) {
  const bool solid = scene.tissue.material.has_value();
  const SkinMesh mesh = make_skin_mesh({"skin", piece.skin, piece.corner});
  Model model = make_layers(mesh, piece.deep, layer_depths(scene.tissue), scene.tissue.depths_mm,
                            solid ? Elements::solid : Elements::springs);
  found.assign(solid ? scene.tissue.material->regions.size() : 0, 0);
  model.gravity = scene.gravity.value_or(Vec3::Zero());
  add_bones(scene, bones, model);
  if (!piece.column.empty()) {
    set_points(piece.rim, piece.ends, scene.moves, model);
    if (solid)
      found = set_material(scene.tissue, scene.file.string(), model);
    else
      set_stiffness(scene.tissue, mesh, piece.slope, model);
    set_loads(scene.tissue, mesh, piece.loads, model);
  }
  add_contact(scene, mesh, piece.ends, model);
  if (!piece.jaws.empty()) add_adhesion(*scene.anatomy, bones, piece, model);
  if (solid) add_supports(piece.ends, *scene.tissue.material, mesh, model);
  for (int64_t& column : model.points.column) column = piece.column[column];
  return model;
}

BuiltModel ColumnGeometry::build_whole() const {
  const scene::Scene& scene = state_->scene;
  BuiltModel built;
  const std::vector<int64_t> columns = base::all_rows(skin().points.size());
  std::vector<int64_t> found;
  built.model = build_local(scene, state_->bones, piece(columns), found);
  require_regions(found, scene.file.string());
  Contact& contact = built.model.contact;
  const std::vector<ColumnSums> sums = column_sums(built.model, layers());
  contact.stiffness = contact_stiffness(scene, sums);
  contact.spacing = spacing();
  built.model.adhesion = state_->adhesion();
  if (contact.pairs.point.empty()) contact.bodies.clear();
  built.held = held();
  built.cuts = {cuts().begin(), cuts().end()};
  built.report = report();
  std::erase_if(built.model.elements, [](const auto& elements) { return elements.size() == 0; });
  const std::string adhesion = remark_on_adhesion(scene, built.model);
  if (!adhesion.empty()) built.report.remarks.push_back(adhesion);
  built.report.effective_modulus = effective_modulus(sums);
  return built;
}

}  // namespace repose::model
