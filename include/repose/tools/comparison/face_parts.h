#pragma once
#include <map>
#include <string>

#include "repose/base/geometry.h"

namespace repose::tools::comparison {

/// The parts of a face that a scorecard speaks of, told by landmarks of the midline. Coordinates
/// are LPS of an upright head: +x patient left, −y forward, +z up.
class FaceParts {
 public:
  /// Takes pronasale, subnasale, upper_lip, lower_lip and pogonion_soft, and menton_soft and
  /// nasion_soft where they are there. InputError naming `file` and the first that is missing, or
  /// where they do not follow each other downwards.
  FaceParts(const std::map<std::string, Vec3>& landmarks, const std::string& file);

  /// Returns the name of the part that a point (mm) lies in, or an empty one. Parts are bounded by
  /// heights and by the distance from the midline: nose (nasion to subnasale, 20 mm), upper lip (to
  /// the middle between the lips, 30 mm), lower lip (to the middle between it and pogonion), chin
  /// (to 5 mm below menton); left and right cheek: beside the lips and the chin's upper half, from
  /// there to 15 mm above pronasale, at most 70 mm from the midline and behind pronasale.
  std::string at(const Vec3& point) const;
  /// Returns the height (z, mm) of subnasale: jaw surgery moves nothing above it but the nose.
  double upper_face() const { return subnasale_; }

 private:
  double middle_, tip_, depth_;  // x of the midline, z and y of pronasale
  double nasion_, subnasale_, between_lips_, under_lip_, pogonion_, menton_;  // z
};

}  // namespace repose::tools::comparison
