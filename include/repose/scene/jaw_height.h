#pragma once

namespace repose::scene {

/// Least heights at the midline of jaws with teeth, mm: the anterior nasal spine above the edge of
/// the upper incisors, the edge of the lower incisors above menton. Lower jaws may be edentulous.
constexpr double upper_jaw_with_teeth = 18, lower_jaw_with_teeth = 34;

}  // namespace repose::scene
