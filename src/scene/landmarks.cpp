#include "repose/scene/landmarks.h"

#include <yaml-cpp/yaml.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <optional>

#include "repose/base/error.h"
#include "repose/base/text.h"

namespace repose::scene {
namespace {

std::optional<Vec3> position(const YAML::Node& node) {
  if (!node.IsSequence() || node.size() != 3) return {};
  Vec3 result;
  for (int axis = 0; axis < 3; ++axis) {
    const auto number =
        node[axis].IsScalar() ? base::parse_number(node[axis].Scalar()) : std::nullopt;
    if (!number) return {};
    result[axis] = *number;
  }
  return result;
}

/// 3D Slicer's markups: lists of control points, each in its own coordinate system.
void add_markups(const YAML::Node& markups, std::map<std::string, Vec3>& landmarks) {
  for (const YAML::Node& list : markups) {
    const YAML::Node system = list["coordinateSystem"];
    const std::string frame = system && system.IsScalar() ? system.Scalar() : "LPS";
    for (const YAML::Node& point : list["controlPoints"]) {
      const YAML::Node label = point["label"];
      auto at = position(point["position"]);
      if (!label || !label.IsScalar() || !at) continue;
      if (frame == "RAS" || frame == "0") at->head<2>() *= -1;
      landmarks[label.Scalar()] = *at;
    }
  }
}

/// The least turn that takes direction `from` to `to`, and the middle of one pair to the other's.
RigidMotion line_up(const std::vector<Vec3>& from, const std::vector<Vec3>& to) {
  const Vec3 a = from[1] - from[0], b = to[1] - to[0];
  if (!(a.norm() > 0) || !(b.norm() > 0))
    base::refuse("two landmarks in one place fix no turn; give two apart");
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(a, b);
  Mat4 matrix = Mat4::Identity();
  matrix.topLeftCorner<3, 3>() = turn.toRotationMatrix();
  matrix.topRightCorner<3, 1>() = (to[0] + to[1] - turn * (from[0] + from[1])) / 2;
  return RigidMotion::from_matrix(matrix);
}

}  // namespace

std::map<std::string, Vec3> read_landmarks(const std::filesystem::path& file) {
  std::map<std::string, Vec3> landmarks;
  try {
    const YAML::Node root = YAML::LoadFile(file.string());
    if (root.IsMap() && root["markups"] && root["markups"].IsSequence())
      add_markups(root["markups"], landmarks);
    else if (root.IsMap())
      for (const auto& entry : root)
        if (const auto at = position(entry.second)) landmarks[entry.first.Scalar()] = *at;
  } catch (const YAML::Exception& error) {
    base::refuse("{}:{}: not a landmark file: {}", file.string(), error.mark.line + 1,
                 base::shown(error.msg));
  }
  if (landmarks.empty())
    base::refuse("{}: holds no landmark; it must be JSON with \"name\": [x, y, z], or a .mrk.json",
                 file.string());
  return landmarks;
}

RigidFit fit_landmarks(const std::vector<Vec3>& from, const std::vector<Vec3>& to) {
  if (from.size() != to.size() || from.empty())
    throw base::InternalError("landmarks to fit are not in pairs");
  if (from.size() > 2) return fit_rigid_motion(from, to);
  RigidFit fit{from.size() == 1 ? RigidMotion::translation(to[0] - from[0]) : line_up(from, to), 0};
  for (std::size_t i = 0; i < from.size(); ++i)
    fit.residual = std::max(fit.residual, (fit.motion.apply(from[i]) - to[i]).norm());
  return fit;
}

}  // namespace repose::scene
