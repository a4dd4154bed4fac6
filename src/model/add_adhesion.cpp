#include "add_adhesion.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <optional>

#include "repose/surface/triangle_tree.h"

namespace repose::model {
namespace {

constexpr double crown = 11;   // mm, of an incisor, from its edge
constexpr double rough = 0.6;  // mm, by which mucosa may end farther from teeth than the gap
constexpr double range = 6;    // mm, from which the film is open

/// Three columns that end in a bone, far from one line; none where there are no such.
std::optional<std::array<int64_t, 3>> frame_of(const ColumnLayout& layout, int32_t bone) {
  constexpr double smallest = 1;  // mm², of the triangle, twice
  const std::vector<Vec3>& x = layout.columns.deep;
  std::vector<int64_t> held;
  for (size_t c = 0; c < x.size(); ++c)
    if (!layout.rim[c] && layout.attachment.bone[c] == bone)
      held.push_back(static_cast<int64_t>(c));
  if (held.size() < 3) return {};
  const int64_t a = held.front();
  const auto along = [&](int64_t c) { return Vec3(x[c] - x[a]); };
  const int64_t b =
      *std::ranges::max_element(held, {}, [&](int64_t c) { return along(c).squaredNorm(); });
  const auto area = [&](int64_t c) { return along(b).cross(along(c)).norm(); };
  const int64_t c = *std::ranges::max_element(held, {}, area);
  if (!(area(c) > smallest)) return {};
  return std::array{a, b, c};
}

/// z of the line between the lips at x: through stomion and the corners of the mouth.
double lip_line(const scene::Landmarks& landmarks, double x) {
  const Vec3& middle = landmarks.at("stomion");
  const Vec3& corner = landmarks.at(x < middle.x() ? "mouth_right" : "mouth_left");
  const double share = std::clamp((x - middle.x()) / (corner.x() - middle.x()), 0.0, 1.0);
  return middle.z() + share * (corner.z() - middle.z());
}

const Vec3& incisor_edge(const scene::AnatomyPlan& plan, bool upper) {
  return plan.landmarks.at(upper ? "upper_incisor_edge" : "lower_incisor_edge");
}

/// Elements of one jaw.
class JawAdhesion {
 public:
  JawAdhesion(const scene::AnatomyPlan& plan, const AdheringJaw& jaw, const surface::Surface& bone,
              int64_t layers)
      : plan_(plan),
        jaw_(jaw),
        edge_(incisor_edge(plan, jaw.upper)),
        sides_(scene::vestibule_sides(plan)),
        tree_(bone) {
    for (int k = 0; k < 3; ++k) frame_[k] = jaw.frame[k] * layers + layers - 1;
  }

  /// Adds the element of a pair, if the point is in the vestibule at the teeth of its own jaw.
  void add(size_t pair, const Vec3& skin, const Model& model, TermElements& elements) const {
    const ContactPairs& pairs = model.contact.pairs;
    if (pairs.body[pair] != jaw_.bone) return;
    const int64_t point = pairs.point[pair];
    const auto& x = model.points.position;
    if ((skin.z() > lip_line(plan_.landmarks, skin.x())) != jaw_.upper) return;
    if (std::abs(x[point].z() - edge_.z()) > crown) return;
    if (const Eigen::Vector2d at = x[point].head<2>();
        (at.array() < sides_[0].array()).any() || (at.array() > sides_[1].array()).any())
      return;
    const double farthest = (jaw_.upper ? plan_.gap : scene::gap_of_lower_teeth(plan_)) + rough;
    const auto tooth = tree_.nearest(x[point], farthest * farthest);
    if (tooth.triangle < 0 || !(tooth.squared > 0)) return;
    const Vec3 normal = (x[point] - tooth.point).normalized();
    const Vec3 first = x[frame_[1]] - x[frame_[0]], second = x[frame_[2]] - x[frame_[0]];
    Mat3 axes;
    axes << first, second, first.cross(second);
    const Vec3 parts = axes.inverse() * normal;
    elements.points.insert(elements.points.end(), {point, frame_[0], frame_[1], frame_[2]});
    elements.numbers.insert(elements.numbers.end(),
                            {parts.x(), parts.y(), parts.z(), normal.dot(x[point] - x[frame_[0]]),
                             plan_.adhesion * pairs.area[pair], range});
  }

 private:
  const scene::AnatomyPlan& plan_;
  AdheringJaw jaw_;
  Vec3 edge_;
  std::array<Eigen::Vector2d, 2> sides_;  // of the vestibule
  surface::TriangleTree tree_;
  std::array<int64_t, 3> frame_;  // points
};

}  // namespace

std::vector<AdheringJaw> adhering_jaws(const scene::AnatomyPlan& plan, const ColumnLayout& layout) {
  std::vector<AdheringJaw> jaws;
  for (const bool upper : {true, false}) {
    const int32_t bone = layout.field.nearest(incisor_edge(plan, upper)).bone;
    if (const auto frame = frame_of(layout, bone)) jaws.push_back({upper, bone, *frame});
  }
  return jaws;
}

void add_adhesion(const scene::AnatomyPlan& plan, const std::vector<surface::Surface>& bones,
                  const Piece& piece, Model& model) {
  TermElements elements{"adhesion", 4, 6, {}, {}};
  const auto layers = static_cast<int64_t>(model.points.position.size() / piece.column.size());
  std::vector<JawAdhesion> jaws;
  for (const AdheringJaw& jaw : piece.jaws) jaws.emplace_back(plan, jaw, bones[jaw.bone], layers);
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
  for (const TermElements& elements : model.elements) points += elements.size();
  return fmt::format(
      "adhesion by landmarks: {} points of the lips adhere to teeth with up to {:g} N/mm²", points,
      scene.anatomy->adhesion);
}

}  // namespace repose::model
