#pragma once
#include <string>
#include <vector>

#include "repose/base/error.h"
#include "repose/model/skin_mesh.h"

namespace repose::model {

/// A skin that no tissue fits, with the triangles where it does not.
class RefusedPlaces : public base::InputError {
 public:
  RefusedPlaces(const std::string& message, surface::Surface places)
      : InputError(message), places_(std::move(places)) {}
  const surface::Surface& places() const { return places_; }

 private:
  surface::Surface places_;
};

/// Throws RefusedPlaces: one line with what is wrong at `vertices`, every place (a part of the skin
/// that they make up) by its first vertex, and the remedy.
[[noreturn]] void refuse_places(const std::string& skin_name, const SkinMesh& mesh,
                                const std::vector<int64_t>& vertices, const std::string& what,
                                const std::string& remedy);

}  // namespace repose::model
