#pragma once
#include <string>
#include <vector>

#include "repose/scene/scene.h"
#include "repose/surface/surface.h"

namespace repose::model {

/// The surfaces of a scene's bones at their initial position, named as in the scene.
struct Bones {
  std::vector<surface::Surface> surfaces;  ///< [scene.bones], pieces cut off, kerfs taken out
  std::vector<std::string> remarks;        ///< lines for a person: what was cut
};

/// Reads the files of the scene's bones and makes its osteotomies in their order. Throws
/// InputError naming the scene and the osteotomy where one cannot be made.
Bones read_bones(const scene::Scene& scene);

}  // namespace repose::model
