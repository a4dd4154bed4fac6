#include "repose/scene/transform_file.h"

#include <Eigen/LU>
#include <sstream>
#include <string>
#include <vector>

#include "repose/base/error.h"
#include "repose/base/hdf5.h"
#include "repose/base/text.h"
#include "repose/base/whole_file.h"
#include "stored_transform.h"
#include "transform_hdf5.h"

namespace repose::scene {

namespace {

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
