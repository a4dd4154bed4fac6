#include "add_adhesion.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>

#include "repose/surface/triangle_tree.h"

namespace repose::model {
namespace {

constexpr double crown = 11;       // mm, of an incisor, from its edge
constexpr double rough = 0.6;      // mm, by which mucosa may end farther from teeth than the gap
constexpr double on_tooth = 1e-6;  // mm: nearer points have no direction off the tooth
constexpr double range = 2;        // mm off the plane, for 1/√2 of the largest tension

/// z of the line between the lips at x, along the head's axes: through stomion and the corners of
/// the mouth.
double lip_line(const AdhesionRule& rule, double x) {
  const auto& [right, middle, left] = rule.lip_line;
  const Vec3& corner = x < middle.x() ? right : left;
  const double share = std::clamp((x - middle.x()) / (corner.x() - middle.x()), 0.0, 1.0);
  return middle.z() + share * (corner.z() - middle.z());
}

Vec3 incisor_edge(const scene::AnatomyPlan& plan, bool upper) {
  return plan.landmarks.at(upper ? "upper_incisor_edge" : "lower_incisor_edge");
}

/// Elements of one jaw.
class JawAdhesion {
 public:
  JawAdhesion(const AdhesionRule& rule, size_t jaw, const surface::Surface& bone)
      : rule_(rule), jaw_(rule.jaws[jaw]), tree_(bone) {}

  /// Adds the element of a pair, if the point is in the vestibule at the teeth of its own jaw.
  void add(size_t pair, const Vec3& skin, const Model& model, TermElements& elements) const {
    const ContactPairs& pairs = model.contact.pairs;
    if (pairs.body[pair] != jaw_.bone) return;
    const int64_t point = pairs.point[pair];
    const auto& x = model.points.position;
    const Vec3 above = rule_.axes * skin, at = rule_.axes * x[point];
    if ((above.z() > lip_line(rule_, above.x())) != jaw_.upper) return;
    if ((at.array() < jaw_.low.array()).any() || (at.array() > jaw_.high.array()).any()) return;
    const auto tooth = tree_.nearest(x[point], jaw_.reach * jaw_.reach);
    if (tooth.triangle < 0 || tooth.squared <= on_tooth * on_tooth) return;
    const Vec3 normal = (x[point] - tooth.point).normalized();
    elements.add(
        std::array{point},
        std::array{normal.x(), normal.y(), normal.z(), normal.dot(x[point]),
                   rule_.tension * pairs.area[pair], rule_.range, static_cast<double>(jaw_.bone)});
  }

 private:
  const AdhesionRule& rule_;
  const AdhesionRule::Jaw& jaw_;
  surface::TriangleTree tree_;
};

}  // namespace

std::vector<AdheringJaw> adhering_jaws(const scene::AnatomyPlan& plan, const ColumnLayout& layout) {
  std::vector<AdheringJaw> jaws;
  for (const bool upper : {true, false})
    jaws.push_back({upper, layout.field.nearest(incisor_edge(plan, upper)).bone});
  return jaws;
}

AdhesionRule adhesion_rule(const scene::AnatomyPlan& plan, const std::vector<AdheringJaw>& jaws) {
  const auto [front_right, back_left] = scene::vestibule_sides(plan);
  const scene::Landmarks& marks = plan.landmarks;
  AdhesionRule rule{plan.adhesion,
                    range,
                    plan.axes,
                    {plan.axes * marks.at("mouth_right"), plan.axes * marks.at("stomion"),
                     plan.axes * marks.at("mouth_left")},
                    {},
                    {}};
  for (const AdheringJaw& jaw : jaws) {
    const double z = plan.axes.row(2).dot(incisor_edge(plan, jaw.upper));
    const double gap = jaw.upper ? plan.gap : scene::gap_of_lower_teeth(plan);
    rule.jaws.push_back({jaw.bone,
                         jaw.upper,
                         {front_right.x(), front_right.y(), z - crown},
                         {back_left.x(), back_left.y(), z + crown},
                         gap + rough});
  }
  return rule;
}

void add_adhesion(const scene::AnatomyPlan& plan, const std::vector<surface::Surface>& bones,
                  const Piece& piece, Model& model) {
  TermElements elements{"adhesion", 1, 7, {}, {}, 6};
  const auto layers = static_cast<int64_t>(model.points.position.size() / piece.column.size());
  const AdhesionRule rule = adhesion_rule(plan, piece.jaws);
  std::vector<JawAdhesion> jaws;
  for (size_t k = 0; k < piece.jaws.size(); ++k)
    jaws.emplace_back(rule, k, bones[piece.jaws[k].bone]);
  const ContactPairs& pairs = model.contact.pairs;
  for (size_t c = 0; c < pairs.point.size(); ++c) {
    const int64_t column = pairs.point[c] / layers;
    const bool deepest = pairs.point[c] % layers == layers - 1;
    if (!deepest || pairs.binding[c] != Binding::touches || piece.parted[column]) continue;
    for (const JawAdhesion& jaw : jaws)
      jaw.add(c, model.points.position[column * layers], model, elements);
  }
  model.elements.push_back(std::move(elements));
}

std::string remark_on_adhesion(const scene::Scene& scene, const Model& model) {
  if (!adheres(scene)) return "";
  size_t points = 0;
  for (const TermElements& elements : model.elements)
    if (elements.term == "adhesion") points += elements.size();
  return fmt::format(
      "adhesion by landmarks: {} points of the lips adhere to teeth with up to {:g} N/mm²", points,
      scene.anatomy->adhesion);
}

}  // namespace repose::model
