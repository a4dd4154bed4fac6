#include "add_adhesion.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <optional>
#include <set>

#include "repose/surface/triangle_tree.h"

namespace repose::model {
namespace {

constexpr double crown = 11;   // mm, of an incisor, from its edge
constexpr double rough = 0.6;  // mm, by which mucosa may end farther from teeth than the gap
constexpr double range = 6;    // mm, from which the film is open

using Frame = std::array<int64_t, 3>;

/// Three points of a bone that are far from one line; none where there are no such.
std::optional<Frame> frame_of(const Model& model, int32_t bone) {
  constexpr double smallest = 1;  // mm², of the triangle, twice
  const auto& x = model.points.position;
  std::vector<int64_t> held;
  for (size_t p = 0; p < x.size(); ++p)
    if (model.points.set[p] == PointSet::bone && model.points.bone[p] == bone)
      held.push_back(static_cast<int64_t>(p));
  if (held.size() < 3) return {};
  const int64_t a = held.front();
  const auto along = [&](int64_t p) { return Vec3(x[p] - x[a]); };
  const int64_t b =
      *std::ranges::max_element(held, {}, [&](int64_t p) { return along(p).squaredNorm(); });
  const auto area = [&](int64_t p) { return along(b).cross(along(p)).norm(); };
  const int64_t c = *std::ranges::max_element(held, {}, area);
  if (!(area(c) > smallest)) return {};
  return Frame{a, b, c};
}

/// z of the line between the lips at x: through stomion and the corners of the mouth.
double lip_line(const scene::Landmarks& landmarks, double x) {
  const Vec3& middle = landmarks.at("stomion");
  const Vec3& corner = landmarks.at(x < middle.x() ? "mouth_right" : "mouth_left");
  const double share = std::clamp((x - middle.x()) / (corner.x() - middle.x()), 0.0, 1.0);
  return middle.z() + share * (corner.z() - middle.z());
}

const char* incisor_edge(bool upper) { return upper ? "upper_incisor_edge" : "lower_incisor_edge"; }

/// Elements of one jaw.
class JawAdhesion {
 public:
  JawAdhesion(const scene::AnatomyPlan& plan, bool upper, const surface::TriangleTree& bone,
              const Frame& frame)
      : plan_(plan),
        upper_(upper),
        edge_(plan.landmarks.at(incisor_edge(upper))),
        tree_(bone),
        frame_(frame) {}

  /// Adds the element of a pair, if the point is at the teeth of its own jaw.
  void add(size_t pair, const Vec3& skin, const Model& model, TermElements& elements) const {
    const int64_t point = model.contact.pairs.point[pair];
    const auto& x = model.points.position;
    if ((skin.z() > lip_line(plan_.landmarks, skin.x())) != upper_) return;
    if (std::abs(x[point].z() - edge_.z()) > crown) return;
    const double farthest = plan_.gap + rough;
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
                             plan_.adhesion * model.contact.pairs.area[pair], range});
  }

 private:
  const scene::AnatomyPlan& plan_;
  bool upper_;
  Vec3 edge_;
  const surface::TriangleTree& tree_;
  Frame frame_;
};

/// The bone nearest to a place.
int32_t bone_at(const Vec3& place, const std::vector<surface::TriangleTree>& bones) {
  std::vector<double> squared;
  for (const surface::TriangleTree& bone : bones) squared.push_back(bone.nearest(place).squared);
  return static_cast<int32_t>(std::ranges::min_element(squared) - squared.begin());
}

}  // namespace

void add_adhesion(const scene::AnatomyPlan& plan, const std::vector<surface::Surface>& bones,
                  const std::vector<Cut>& cuts, Model& model, std::vector<std::string>& remarks) {
  TermElements elements{"adhesion", 4, 6, {}, {}};
  const int32_t layers = *std::ranges::max_element(model.points.layer) + 1;
  std::set<int64_t> parted;
  for (const Cut& cut : cuts) parted.insert(cut.columns.begin(), cut.columns.end());
  const ContactPairs& pairs = model.contact.pairs;
  const std::vector<surface::TriangleTree> trees(bones.begin(), bones.end());
  for (const bool upper : {true, false}) {
    const int32_t bone = bone_at(plan.landmarks.at(incisor_edge(upper)), trees);
    const auto frame = frame_of(model, bone);
    if (!frame) continue;
    const JawAdhesion jaw(plan, upper, trees[bone], *frame);
    for (size_t c = 0; c < pairs.point.size(); ++c) {
      const int64_t column = model.points.column[pairs.point[c]];
      if (pairs.body[c] == bone && pairs.binding[c] == Binding::touches &&
          model.points.layer[pairs.point[c]] == layers - 1 && !parted.contains(column))
        jaw.add(c, model.points.position[column * layers], model, elements);
    }
  }
  remarks.push_back(
      fmt::format("adhesion by landmarks: {} points of the lips adhere to teeth with "
                  "up to {:g} N/mm²",
                  elements.size(), plan.adhesion));
  if (elements.size() > 0) model.elements.push_back(std::move(elements));
}

}  // namespace repose::model
