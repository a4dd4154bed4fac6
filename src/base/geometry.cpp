#include "repose/base/geometry.h"

#include <Eigen/Dense>
#include <cmath>

namespace repose::base {

Vec3 mean(std::span<const Vec3> points) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& point : points) sum += point;
  return sum / static_cast<double>(points.size());
}

Mat4 Similarity::matrix() const {
  Mat4 matrix = Mat4::Identity();
  matrix.topLeftCorner<3, 3>() = scale * rotation;
  matrix.topRightCorner<3, 1>() = translation;
  return matrix;
}

Similarity Similarity::after(const Similarity& first) const {
  return {scale * first.scale, rotation * first.rotation, apply(first.translation)};
}

Similarity fit_similarity(const std::vector<Vec3>& moving, const std::vector<Vec3>& fixed,
                          bool with_scale, Handedness handedness) {
  const Vec3 from = mean(moving), to = mean(fixed);
  Mat3 covariance = Mat3::Zero();
  double extent = 0;
  for (size_t i = 0; i < moving.size(); ++i) {
    covariance += (fixed[i] - to) * (moving[i] - from).transpose();
    extent += (moving[i] - from).squaredNorm();
  }
  const Eigen::JacobiSVD<Mat3> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vec3 sign = Vec3::Ones();
  const bool reflects = svd.matrixU().determinant() * svd.matrixV().determinant() < 0;
  if (reflects != (handedness == Handedness::mirrored)) sign[2] = -1;
  Similarity fit;
  fit.rotation = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  if (with_scale) fit.scale = svd.singularValues().dot(sign) / extent;
  fit.translation = to - fit.scale * (fit.rotation * from);
  return fit;
}

double breadth(std::span<const Vec3> points) {
  if (points.size() < 3) return 0;
  const Vec3 center = mean(points);
  Mat3 scatter = Mat3::Zero();
  for (const Vec3& p : points) scatter += (p - center) * (p - center).transpose();
  if (!scatter.allFinite()) return 0;
  const Vec3 squares = Eigen::JacobiSVD<Mat3>(scatter).singularValues();
  return squares[0] > 0 ? std::sqrt(squares[1] / squares[0]) : 0;
}

}  // namespace repose::base
