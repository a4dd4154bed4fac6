#include "repose/scene/transform_file.h"

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "repose/base/error.h"
#include "repose/base/text.h"

namespace repose::scene {

namespace {

/// A line "Key: value" of the file, and the numbers of its value.
struct Line {
  std::string place;  ///< file:line
  std::string value;
  std::vector<double> numbers;

  double operator[](std::size_t i) const { return numbers[i]; }
  Vec3 vector(std::size_t first) const {
    return {numbers[first], numbers[first + 1], numbers[first + 2]};
  }
};

struct Stored {
  std::optional<Line> kind, parameters, fixed;
};

void read_numbers(Line& line) {
  std::istringstream words(line.value);
  for (std::string word; words >> word;) {
    const auto number = base::parse_number(word);
    if (!number) base::refuse("{}: {} is not a finite number", line.place, base::shown(word));
    line.numbers.push_back(*number);
  }
}

void store(std::optional<Line>& slot, Line line) {
  if (slot)
    base::refuse("{}: the file holds more than one transform; save one linear transform alone",
                 line.place);
  slot = std::move(line);
}

void read_line(const std::string& text, const std::string& place, Stored& stored) {
  const std::size_t colon = text.find(':');
  if (text.find_first_not_of(" \t\r") == std::string::npos || text[0] == '#') return;
  const std::string key = text.substr(0, colon);
  Line line{place, colon == std::string::npos ? "" : text.substr(colon + 1), {}};
  if (key == "Transform") {
    std::istringstream(line.value) >> line.value;
    store(stored.kind, std::move(line));
  } else if (key == "Parameters" || key == "FixedParameters") {
    read_numbers(line);
    store(key == "Parameters" ? stored.parameters : stored.fixed, std::move(line));
  } else {
    base::refuse("{}: expected Transform, Parameters or FixedParameters, got {}", place,
                 base::shown(text));
  }
}

void need(const Line& line, const char* what, std::size_t least, std::size_t most) {
  if (line.numbers.size() < least || line.numbers.size() > most)
    base::refuse("{}: {} needs {} numbers, it has {}", line.place, what, least,
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
      kind.place, base::shown(kind.value));
}

Stored read_stored(const std::string& name, std::istream& stream) {
  Stored stored;
  std::string text;
  for (std::size_t number = 1; std::getline(stream, text); ++number) {
    const std::string place = fmt::format("{}:{}", name, number);
    if (number == 1 && !text.starts_with("#Insight Transform File"))
      base::refuse(
          "{}: not an ITK text transform, which begins with '#Insight Transform File V1.0'; save "
          "the transform as .tfm",
          place);
    read_line(text, place, stored);
  }
  return stored;
}

}  // namespace

RigidMotion read_transform(const std::filesystem::path& file) {
  constexpr std::uintmax_t largest = 1 << 20;
  const std::string name = file.string();
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error))
    base::refuse("{}: no such file; give an ITK text transform (.tfm)", name);
  if (std::filesystem::file_size(file, error) > largest)
    base::refuse("{}: too large for an ITK text transform (1 MiB allowed)", name);
  std::ifstream stream(file);
  if (!stream) base::refuse("{}: cannot be read", name);
  const Stored stored = read_stored(name, stream);
  if (!stored.kind) base::refuse("{}: holds no transform (no line 'Transform:')", name);
  check_kind(*stored.kind);
  if (!stored.parameters) base::refuse("{}: holds no line 'Parameters:'", name);
  const Mat4 matrix = matrix_of(stored);
  try {
    return RigidMotion::from_matrix(matrix).inverse();
  } catch (const base::InputError& refusal) {
    base::refuse("{}: {}", stored.parameters->place, refusal.what());
  }
}

}  // namespace repose::scene
