#include "carrying_bone.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "repose/base/text.h"

namespace repose::scene {
namespace {

constexpr std::array<std::string_view, 4> upper{"nasion_bone", "nasal_spine", "a_point",
                                                "upper_incisor_edge"};
constexpr std::array<std::string_view, 4> front_of_lower{"lower_incisor_edge", "b_point",
                                                         "pogonion_bone", "menton_bone"};

template <size_t n>
bool is_among(const std::array<std::string_view, n>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool is_of_rami(std::string_view name) {
  return name.starts_with("condyle_") || name.starts_with("gonion_");
}

/// Rows of bones that are no piece.
std::vector<std::size_t> whole_bones(const Scene& scene) {
  std::vector<std::size_t> rows;
  for (std::size_t b = 0; b < scene.bones.size(); ++b)
    if (std::none_of(scene.osteotomies.begin(), scene.osteotomies.end(),
                     [&](const Osteotomy& cut) { return cut.piece == b; }))
      rows.push_back(b);
  return rows;
}

std::optional<std::size_t> called(const Scene& scene, const std::vector<std::size_t>& rows,
                                  std::string_view name) {
  for (const std::size_t b : rows)
    if (base::lower(scene.bones[b].name) == name) return b;
  return std::nullopt;
}

std::optional<std::size_t> whole_bone_of(const Scene& scene, const std::string& landmark) {
  const std::vector<std::size_t> rows = whole_bones(scene);
  const auto mandible = called(scene, rows, "mandible");
  if (is_among(front_of_lower, landmark) || is_of_rami(landmark)) return mandible;
  if (!is_among(upper, landmark)) return std::nullopt;
  for (const char* name : {"maxilla", "skull"})
    if (const auto row = called(scene, rows, name)) return row;
  if (!mandible || rows.size() != 2) return std::nullopt;
  return rows[0] == *mandible ? rows[1] : rows[0];
}

/// Returns whether the piece of a cut holds a landmark; nothing where that is open.
std::optional<bool> holds(const Osteotomy& cut, const std::string& landmark, const Vec3* place) {
  if (cut.made_by == OsteotomyTemplate::sagittal_split) return !is_of_rami(landmark);
  const bool plain = !cut.surface && !cut.seed &&
                     std::none_of(cut.planes.begin(), cut.planes.end(),
                                  [](const CutPlane& plane) { return plane.radius.has_value(); });
  if (!place || !plain) return std::nullopt;
  return std::all_of(cut.planes.begin(), cut.planes.end(), [&](const CutPlane& plane) {
    return (*place - plane.point).dot(plane.normal) > 0;
  });
}

}  // namespace

std::optional<std::size_t> carrying_bone(const Scene& scene, const std::string& landmark) {
  auto row = whole_bone_of(scene, landmark);
  const Vec3* place = scene.anatomy ? find(scene.anatomy->landmarks, landmark.c_str()) : nullptr;
  for (const Osteotomy& cut : scene.osteotomies) {
    if (row != cut.bone) continue;
    const auto held = holds(cut, landmark, place);
    if (!held) return std::nullopt;
    if (*held) row = cut.piece;
  }
  return row;
}

}  // namespace repose::scene
