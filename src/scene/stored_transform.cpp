#include "stored_transform.h"

#include <Eigen/Geometry>
#include <cmath>

#include "repose/base/error.h"
#include "repose/base/text.h"

namespace repose::scene {
namespace {

void need(const Line& line, const char* what, std::size_t minimum, std::size_t maximum) {
  if (line.numbers.size() < minimum || line.numbers.size() > maximum)
    base::refuse("{}: {} needs {} numbers, it has {}", line.place, what, minimum,
                 line.numbers.size());
}

Mat3 about(const Vec3& axis, double angle) {
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

Mat3 affine_matrix(const Line& parameters) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(parameters.numbers.data());
}

Mat3 euler_matrix(const Line& parameters, bool zyx) {
  const Mat3 x = about(Vec3::UnitX(), parameters[0]), y = about(Vec3::UnitY(), parameters[1]),
             z = about(Vec3::UnitZ(), parameters[2]);
  return zyx ? z * y * x : z * x * y;
}

Mat3 versor_matrix(const Line& parameters) {
  const Vec3 v = parameters.vector(0);
  if (v.squaredNorm() > 1 + 1e-9)
    base::refuse("{}: the versor is longer than 1 ({:g})", parameters.place, v.norm());
  const double w = std::sqrt(std::max(0.0, 1 - v.squaredNorm()));
  return Eigen::Quaterniond(w, v[0], v[1], v[2]).normalized().toRotationMatrix();
}

/// y = A (x − c) + t + c as a matrix.
Mat4 centered(const Mat3& a, const Vec3& translation, const Vec3& center) {
  Mat4 result = Mat4::Identity();
  result.topLeftCorner<3, 3>() = a;
  result.topRightCorner<3, 1>() = translation + center - a * center;
  return result;
}

}  // namespace

Mat4 matrix_of(const Stored& stored) {
  const Line &kind = *stored.kind, &parameters = *stored.parameters;
  const auto is = [&](const char* name) { return kind.value.starts_with(name); };
  if (is("TranslationTransform_")) {
    need(parameters, "a TranslationTransform", 3, 3);
    return centered(Mat3::Identity(), parameters.vector(0), Vec3::Zero());
  }
  Vec3 center = Vec3::Zero();
  if (stored.fixed && !stored.fixed->numbers.empty()) {
    need(*stored.fixed, "FixedParameters (the center)", 3, 4);
    center = stored.fixed->vector(0);
  }
  if (is("AffineTransform_") || is("MatrixOffsetTransformBase_")) {
    need(parameters, "an AffineTransform", 12, 12);
    return centered(affine_matrix(parameters), parameters.vector(9), center);
  }
  need(parameters, "a rigid transform", 6, 6);
  if (is("VersorRigid3DTransform_"))
    return centered(versor_matrix(parameters), parameters.vector(3), center);
  const bool zyx = stored.fixed && stored.fixed->numbers.size() == 4 && (*stored.fixed)[3] != 0;
  return centered(euler_matrix(parameters, zyx), parameters.vector(3), center);
}

void check_kind(const Line& kind) {
  for (const char* base_name :
       {"AffineTransform_", "MatrixOffsetTransformBase_", "Euler3DTransform_",
        "VersorRigid3DTransform_", "TranslationTransform_"})
    for (const char* scalar : {"double_3_3", "float_3_3"})
      if (kind.value == std::string(base_name) + scalar) return;
  base::refuse(
      "{}: a transform {} is not supported; save a linear rigid one (AffineTransform_double_3_3, "
      "Euler3DTransform_double_3_3 or VersorRigid3DTransform_double_3_3)",
      kind.place, base::quote(kind.value));
}

}  // namespace repose::scene
