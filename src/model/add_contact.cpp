#include "add_contact.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <type_traits>

#include "loads.h"
#include "motion_range.h"
#include "repose/base/error.h"
#include "repose/model/build.h"
#include "repose/model/instruments.h"
#include "repose/surface/triangle_tree.h"

namespace repose::model {
namespace {

constexpr double margin = 2;  // mm, beyond what points and bones may come nearer

void add(int64_t point, int32_t body, Binding binding, double area, ContactPairs& pairs) {
  pairs.point.push_back(point);
  pairs.body.push_back(body);
  pairs.binding.push_back(binding);
  pairs.area.push_back(area);
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

/// Adds the pairs of free points with the bodies that they may come to.
class ContactAdder {
 public:
  ContactAdder(const scene::Scene& scene, const ColumnEnds& ends, Model& model)
      : ends_(ends),
        model_(model),
        trees_(model.bone_surfaces.begin(), model.bone_surfaces.end()),
        touching_(scene.contact && scene.contact->bones) {
    const MotionRange range(scene, model.bone_surfaces);
    for (size_t b = 0; b < model.bones.size(); ++b) {
      model.contact.bodies.push_back({model.bones[b], static_cast<int32_t>(b)});
      reach_.push_back(range.travel(model.bone_surfaces[b], static_cast<int32_t>(b)));
    }
    const double farthest = reach_.empty() ? 0 : *std::max_element(reach_.begin(), reach_.end());
    for (double& reach : reach_) reach = reach + farthest + margin;
    for (size_t i = 0; i < scene.instruments.size(); ++i) {
      const scene::Instrument& instrument = scene.instruments[i];
      if (instrument.slide || touching_)
        model.contact.bodies.push_back(
            {fmt::format("instruments[{}]", i), -1, shape_of(instrument), instrument.push});
    }
  }

  void add_point(int64_t point, double area) {
    const auto column = static_cast<size_t>(model_.points.column[point]);
    const bool skin = model_.points.layer[point] == 0;
    const auto bones = static_cast<int32_t>(trees_.size()),
               bodies = static_cast<int32_t>(model_.contact.bodies.size());
    for (int32_t b = 0; b < bones; ++b)
      if (b == slides_on(point))
        add(point, b, Binding::slides, area, model_.contact.pairs);
      else if (touching_ && !ends_.free[column] && !held_against(point, b) &&
               trees_[b].any_within(model_.points.position[point], reach_[b] * reach_[b]) >= 0)
        add(point, b, Binding::touches, area, model_.contact.pairs);
    for (int32_t b = bones; skin && b < bodies; ++b)
      add(point, b, Binding::touches, area, model_.contact.pairs);
  }

 private:
  bool is_deepest(int64_t point) const {
    const auto layers =
        static_cast<int64_t>(model_.points.position.size() / ends_.slides_on.size());
    return point % layers == layers - 1;
  }
  int32_t slides_on(int64_t point) const {
    return is_deepest(point) ? ends_.slides_on[model_.points.column[point]] : -1;
  }
  /// Returns whether a bone that the point is not supported by moves past it as it would past bone
  /// that holds the point: where bones overlap, contact would fight a support.
  bool held_against(int64_t point, int32_t bone) const {
    constexpr double held = 1;  // stiffness, in the middle of the band
    const int64_t column = model_.points.column[point];
    return (is_deepest(point) || ends_.supported_whole[column]) && ends_.support[column] >= 0 &&
           ends_.support[column] != bone && ends_.support_stiffness[column] >= held;
  }

  const ColumnEnds& ends_;
  Model& model_;
  std::vector<surface::TriangleTree> trees_;
  std::vector<double> reach_;  // [bones] mm
  bool touching_;              // tissue and bones
};

/// mm, the 2nd percentile of the thickness of bone that is near the deep end of a column, along the
/// way from there into the bone; `maximum` if that is larger.
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
    thickness.push_back(exit ? start + *exit : maximum);
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

void add_contact(const scene::Scene& scene, const SkinMesh& mesh, const ColumnEnds& ends,
                 Model& model) {
  const std::vector<double> area = point_areas(mesh, model);
  ContactAdder adder(scene, ends, model);
  for (size_t p = 0; p < area.size(); ++p)
    if (model.points.set[p] == PointSet::soft_tissue)
      adder.add_point(static_cast<int64_t>(p), area[p]);
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
