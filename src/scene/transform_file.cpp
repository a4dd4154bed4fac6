#include "repose/scene/transform_file.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "repose/base/error.h"
#include "repose/base/hdf5.h"
#include "repose/base/text.h"
#include "repose/base/whole_file.h"

namespace repose::scene {

namespace {

/// The kind, the parameters or the fixed parameters of a transform as ITK stores it.
struct Line {
  std::string place;  ///< for messages, file:line
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

/// y = A (x − c) + t + c as a homogeneous matrix, mm. Kind and parameters are there. Throws
/// InputError naming the place where there are too few or too many numbers.
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

/// Throws InputError naming the place for a kind that is not linear and rigid in three dimensions.
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

void read_numbers(Line& line) {
  std::istringstream words(line.value);
  for (std::string word; words >> word;) {
    const auto number = base::parse_number(word);
    if (!number) base::refuse("{}: {} is not a finite number", line.place, base::quote(word));
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
                 base::quote(text));
  }
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

base::StoredArray open_array(hid_t file, const std::string& path, const std::string& place) {
  constexpr int64_t maximum = 1 << 20;
  base::StoredArray array(base::Hdf5Dataset(H5Dopen2(file, path.c_str(), H5P_DEFAULT)), place);
  if (array.size() > maximum) throw base::Hdf5Error(path + " holds too much");
  return array;
}

std::string read_kind(hid_t file, const std::string& group, const std::string& place) {
  const std::string path = group + "/TransformType";
  const std::vector<std::string> kind = open_array(file, path, place).strings();
  if (kind.size() != 1) throw base::Hdf5Error(path + " holds no single text");
  return kind[0];
}

/// ITK once misspelled its own names, and still reads both.
Line read_numbers(hid_t file, const std::string& group, const std::string& place, const char* name,
                  const char* misspelled) {
  for (const char* spelling : {name, misspelled}) {
    const std::string path = group + "/" + spelling;
    if (base::hdf5_has(file, path)) return {place, "", open_array(file, path, place).numbers()};
  }
  base::refuse("{}: holds no {}; save the transform again", place, name);
}

Stored read_group(hid_t file, const std::string& group, const std::string& name) {
  const std::string place = name + ":" + group;
  Stored stored;
  stored.kind = Line{place, read_kind(file, group, place), {}};
  check_kind(*stored.kind);
  stored.parameters = read_numbers(file, group, place, "TransformParameters", "TranformParameters");
  stored.fixed =
      read_numbers(file, group, place, "TransformFixedParameters", "TranformFixedParameters");
  return stored;
}

std::string group_of(int number) { return fmt::format("/TransformGroup/{}", number); }

Mat4 read_open(hid_t file, const std::string& name) {
  if (!base::hdf5_has(file, "/TransformGroup") || !base::hdf5_has(file, group_of(0)))
    base::refuse("{}: holds no ITK transform (no /TransformGroup/0); save it as .h5 or .tfm", name);
  const std::string kind = read_kind(file, group_of(0), name);
  const bool composite = kind.starts_with("CompositeTransform_");
  if (!composite && base::hdf5_has(file, group_of(1)))
    base::refuse("{}: the file holds more than one transform; save one alone", name);
  if (!composite) return matrix_of(read_group(file, group_of(0), name));
  Mat4 whole = Mat4::Identity();
  int part = 1;
  for (; base::hdf5_has(file, group_of(part)); ++part)
    whole = whole * matrix_of(read_group(file, group_of(part), name));
  if (part == 1) base::refuse("{}: a composite transform without parts; save it again", name);
  return whole;
}

/// The matrix of ITK's transform in an HDF5 file, from planned to present place: a linear one, or a
/// composite of linear ones, of which the last is applied first. Throws InputError naming the file.
Mat4 read_hdf5_transform(const std::filesystem::path& file) {
  const std::string name = file.string();
  try {
    return read_open(base::open_hdf5(file), name);
  } catch (const base::Hdf5Error& error) {
    base::refuse("{}: cannot be read as an ITK transform in HDF5: {}", name, error.what());
  }
}

RigidMotion inverse_motion(const Mat4& matrix, const std::string& place) {
  try {
    return RigidMotion::from_matrix(matrix).inverse();
  } catch (const base::InputError& refusal) {
    base::refuse("{}: {}", place, refusal.what());
  }
}

}  // namespace

RigidMotion read_transform(const std::filesystem::path& file) {
  const std::string name = file.string();
  if (base::is_hdf5(file)) {
    base::record_input(file);
    return inverse_motion(read_hdf5_transform(file), name);
  }
  std::istringstream stream(base::read_text_input(
      file, {1, "an ITK text transform", "give an ITK transform (.tfm or .h5)"}));
  const Stored stored = read_stored(name, stream);
  if (!stored.kind) base::refuse("{}: holds no transform (no line 'Transform:')", name);
  check_kind(*stored.kind);
  if (!stored.parameters) base::refuse("{}: holds no line 'Parameters:'", name);
  return inverse_motion(matrix_of(stored), stored.parameters->place);
}

void write_transform(const std::filesystem::path& file, const Mat4& motion) {
  const Mat3 linear = motion.topLeftCorner<3, 3>().inverse();
  const Vec3 translation = -(linear * motion.topRightCorner<3, 1>());
  std::string parameters;
  for (int i = 0; i < 9; ++i) parameters += fmt::format("{} ", linear(i / 3, i % 3));
  parameters += fmt::format("{} {} {}", translation.x(), translation.y(), translation.z());
  base::write_whole_file(file, fmt::format("#Insight Transform File V1.0\n"
                                           "#Transform 0\n"
                                           "Transform: AffineTransform_double_3_3\n"
                                           "Parameters: {}\n"
                                           "FixedParameters: 0 0 0\n",
                                           parameters));
}

}  // namespace repose::scene
