#include "add_contact.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <type_traits>

#include "motion_range.h"
#include "repose/base/error.h"
#include "repose/model/build.h"
#include "repose/model/instruments.h"
#include "repose/surface/triangle_tree.h"

namespace repose::model {
namespace {

constexpr double margin = 2;  // mm, beyond what points and bones may come nearer

/// mm², what each point of a layered model stands for in its layer.
std::vector<double> layer_areas(const SkinMesh& mesh, const Model& model) {
  const size_t layers = model.points.position.size() / std::max<size_t>(mesh.points.size(), 1);
  std::vector<double> area(model.points.position.size(), 0.0);
  const auto& x = model.points.position;
  for (const Triangle& t : mesh.triangles)
    for (size_t l = 0; l < layers; ++l) {
      const size_t a = t[0] * layers + l, b = t[1] * layers + l, c = t[2] * layers + l;
      const double share = (x[b] - x[a]).cross(x[c] - x[a]).norm() / 6;
      for (const size_t p : {a, b, c}) area[p] += share;
    }
  return area;
}

void add(int64_t point, int32_t body, Binding binding, double area, ContactPairs& pairs) {
  pairs.point.push_back(point);
  pairs.body.push_back(body);
  pairs.binding.push_back(binding);
  pairs.area.push_back(area);
}

/// Free points against the bones that they may come to.
void add_bone_contact(const scene::Scene& scene, const Attachment& attachment,
                      const std::vector<double>& area, Model& model) {
  for (size_t b = 0; b < model.bones.size(); ++b)
    model.contact.bodies.push_back({model.bones[b], static_cast<int32_t>(b)});
  const bool touching = scene.contact && scene.contact->bones;
  std::vector<surface::TriangleTree> trees(model.bone_surfaces.begin(), model.bone_surfaces.end());
  std::vector<double> travel;
  const MotionRange range(scene, model.bone_surfaces);
  for (size_t b = 0; b < model.bones.size(); ++b)
    travel.push_back(range.travel(model.bone_surfaces[b], static_cast<int32_t>(b)));
  const double farthest = travel.empty() ? 0 : *std::max_element(travel.begin(), travel.end());
  const size_t layers = area.size() / std::max<size_t>(attachment.bone.size(), 1);
  for (size_t p = 0; p < area.size(); ++p) {
    if (model.points.set[p] != PointSet::soft_tissue) continue;
    const size_t column = p / layers;
    const int32_t slides_on = p % layers == layers - 1 ? attachment.slides_on[column] : -1;
    for (int32_t b = 0; b < static_cast<int32_t>(trees.size()); ++b) {
      const auto row = static_cast<int64_t>(p);
      const double reach = travel[b] + farthest + margin;
      if (b == slides_on)
        add(row, b, Binding::slides, area[p], model.contact.pairs);
      else if (touching && !attachment.free[column] &&
               trees[b].any_within(model.points.position[p], reach * reach) >= 0)
        add(row, b, Binding::touches, area[p], model.contact.pairs);
    }
  }
}

Body::Shape shape_of(const scene::Instrument& instrument) {
  return std::visit(
      [](const auto& shape) -> Body::Shape {
        if constexpr (std::is_same_v<std::decay_t<decltype(shape)>, scene::ClosedMesh>)
          return read_body(shape);
        else
          return shape;
      },
      instrument.shape);
}

/// Free points of the skin against an instrument: those that slide on it, or those around what it
/// holds.
void add_instrument_contact(const scene::Scene& scene, size_t number,
                            const std::vector<double>& area, Model& model) {
  const scene::Instrument& instrument = scene.instruments[number];
  const auto body = static_cast<int32_t>(model.contact.bodies.size());
  model.contact.bodies.push_back(
      {fmt::format("instruments[{}]", number), -1, shape_of(instrument), instrument.push});
  const PushedShape pushed(instrument);
  bool met = !instrument.slide;
  for (size_t p = 0; p < area.size(); ++p) {
    if (model.points.layer[p] != 0 || model.points.set[p] != PointSet::soft_tissue) continue;
    add(static_cast<int64_t>(p), body, Binding::touches, area[p], model.contact.pairs);
    const auto part = pushed.along(model.points.position[p]);
    met = met || (part && part->enter <= instrument.push.norm() && part->leave > 0);
  }
  if (!met)
    base::refuse(
        "{}: instruments[{}]: it reaches no free point of the skin; move it or push it "
        "farther",
        scene.file.string(), number);
}

/// mm, the 2nd percentile of the thickness of bone that is near the deep end of a column, along the
/// way from there into the bone; `most` if that is larger.
double thin_bone(const ColumnLayout& layout, double maximum) {
  constexpr double near = 20, start = 0.01, share = 0.02;  // mm, mm, of the rays
  constexpr size_t rays = 1000;
  std::vector<double> thickness;
  const std::vector<Vec3>& deep = layout.columns.deep;
  for (size_t c = 0; c < deep.size(); c += 1 + deep.size() / rays) {
    const BoneField::Nearest bone = layout.field.nearest(deep[c]);
    if (!(bone.distance < near)) continue;
    const Vec3 into =
        bone.distance > 10 * start ? bone.point - deep[c] : deep[c] - layout.mesh.points[c];
    const Vec3 direction = into.normalized();
    const auto exit = layout.field.first_hit(bone.point + start * direction, direction, maximum);
    thickness.push_back(exit ? start + exit->distance : maximum);
  }
  if (thickness.empty()) return maximum;
  const auto thin =
      thickness.begin() + static_cast<int64_t>(share * static_cast<double>(thickness.size()));
  std::nth_element(thickness.begin(), thin, thickness.end());
  return *thin;
}

}  // namespace

double grid_spacing(const scene::Scene& scene, const ColumnLayout& layout) {
  constexpr double finest = 0.5;  // mm
  if (scene.contact && scene.contact->grid) return *scene.contact->grid;
  if (!scene.osteotomies.empty()) return finest;  // edges that a saw leaves are sharp
  constexpr double coarsest = 0.6;                // mm
  return std::clamp(thin_bone(layout, 2 * coarsest) / 2, finest, coarsest);
}

void add_bone_contact(const scene::Scene& scene, const SkinMesh& mesh, const Attachment& attachment,
                      Model& model) {
  add_bone_contact(scene, attachment, layer_areas(mesh, model), model);
}

void add_contact(const scene::Scene& scene, const ColumnLayout& layout, Model& model) {
  Contact& contact = model.contact;
  const SkinMesh& mesh = layout.mesh;
  const std::vector<double> area = layer_areas(mesh, model);
  add_bone_contact(scene, layout.attachment, area, model);
  for (size_t i = 0; i < scene.instruments.size(); ++i)
    if (scene.instruments[i].slide || (scene.contact && scene.contact->bones))
      add_instrument_contact(scene, i, area, model);
  if (contact.pairs.point.empty()) contact.bodies.clear();
  contact.spacing = grid_spacing(scene, layout);
  const auto layers = static_cast<int64_t>(model.points.position.size() / mesh.points.size());
  contact.stiffness = contact_stiffness(scene, column_sums(model, layers));
}

void share_pairs(const std::vector<std::array<int64_t, 2>>& twins, Model& model) {
  ContactPairs& pairs = model.contact.pairs;
  std::map<int64_t, int64_t> twin_of;
  for (const auto& [row, twin] : twins) twin_of[row] = twin;
  const size_t before = pairs.point.size();
  for (size_t c = 0; c < before; ++c) {
    const auto twin = twin_of.find(pairs.point[c]);
    if (twin == twin_of.end()) continue;
    pairs.area[c] /= 2;
    add(twin->second, pairs.body[c], pairs.binding[c], pairs.area[c], pairs);
  }
}

}  // namespace repose::model
