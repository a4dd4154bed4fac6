#pragma once
#include <optional>
#include <string>
#include <vector>

#include "repose/base/geometry.h"

/// A transform as ITK stores it: a kind, parameters and fixed parameters.
namespace repose::scene {

/// One of them.
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

/// Throws InputError naming the place for a kind that is not linear and rigid in three dimensions.
void check_kind(const Line& kind);

/// y = A (x − c) + t + c as a homogeneous matrix, mm. Kind and parameters are there. Throws
/// InputError naming the place where there are too few or too many numbers.
Mat4 matrix_of(const Stored& stored);

}  // namespace repose::scene
