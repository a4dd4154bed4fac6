#include <Eigen/Geometry>
#include <unordered_map>

#include "repose/model/model.h"

namespace repose::model {

std::vector<Vec3> outward_normals(const Model& model) {
  const Points& points = model.points;
  std::unordered_map<int64_t, Vec3> of_column;
  for (const Triangle& t : model.skin) {
    const Vec3& a = points.position[t[0]];
    const Vec3 area = (points.position[t[1]] - a).cross(points.position[t[2]] - a);
    for (const int64_t corner : t)
      of_column.try_emplace(points.column[corner], Vec3::Zero()).first->second += area;
  }
  std::vector<Vec3> normals(points.position.size(), Vec3::Zero());
  for (size_t i = 0; i < normals.size(); ++i)
    if (const auto found = of_column.find(points.column[i]); found != of_column.end())
      normals[i] = found->second.normalized();
  return normals;
}

}  // namespace repose::model
