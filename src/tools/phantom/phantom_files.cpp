#include <string_view>

#include "repose/base/error.h"
#include "repose/base/whole_file.h"
#include "repose/scene/landmarks.h"
#include "repose/surface/read.h"
#include "repose/tools/phantom/phantom.h"

namespace repose::tools::phantom {
using namespace surface;
namespace {

using Landmarks = std::map<std::string, Vec3>;

/// Rounds positions to the digits that files hold. Adding 0 turns −0, which some readers print,
/// into 0.
Landmarks rounded(Landmarks landmarks) {
  for (auto& [name, at] : landmarks) at = (at.array() * 1e4).round() / 1e4 + 0.0;
  return landmarks;
}

std::string landmarks_json(const Landmarks& landmarks) {
  std::string text = "{\n";
  for (const auto& [name, at] : landmarks)
    text += fmt::format("  \"{}\": [{:.4f}, {:.4f}, {:.4f}],\n", name, at.x(), at.y(), at.z());
  text +=
      "  \"condyle_axis\": {\n"
      "    \"point\": [0.0, 0.0, 0.0],\n"
      "    \"direction_right_to_left\": [1.0, 0.0, 0.0]\n"
      "  }\n}\n";
  return text;
}

struct SceneText {
  const char *title, *move;
};

constexpr SceneText opening{
    "# The synthetic head opens its mouth: the jaw turns about the hinge axis through its "
    "condyles,\n"
    "# chin down and back.\n",
    "  # positive about +x (patient left) opens the mouth\n"
    "  - {bone: mandible, rotate: {axis: [1, 0, 0], center: [0, 0, 0], angle: 8}}\n"};

constexpr SceneText advance{
    "# The synthetic head after surgery that brings the lower jaw forward.\n",
    "  - {bone: mandible, translate: [0, -6, 0]}   # forward is −y\n"};

struct TissueText {
  const char *kind, *solve;
};

constexpr TissueText solid{
    "  material: {preset: face}   # a neo-Hookean solid, docs/guide/materials.md\n", ""};

constexpr TissueText springs{
    "  springs:\n"
    "    default: {stiffness: 1.0, law: quartic, reference: 1.0}   # N/mm, mm\n"
    "boundary: {rim: fixed}     # the border of the patch stays where it is, as in the paper\n",
    "solve:\n"
    "  volume: {form: penalty, poisson: 0.4967}   # the tissue keeps its volume, nearly\n"};

std::string scene_yaml(const SceneText& scene, const TissueText& tissue, std::string_view stem) {
  return fmt::format(
      "{0}"
      "# Axes LPS, mm: +x patient left, +y posterior (the face looks to −y), +z up.\n"
      "skin: {1}_skin.ply\n"
      "bones:\n"
      "  - {{name: skull, file: {1}_skull.ply}}\n"
      "  - {{name: mandible, file: {1}_mandible.ply}}\n"
      "tissue:\n"
      "  layers: 4                  # skin and deepest included\n"
      "{3}"
      "moves:\n"
      "{2}"
      "{4}",
      scene.title, stem, scene.move, tissue.kind, tissue.solve);
}

}  // namespace

std::vector<std::filesystem::path> phantom_files(const std::filesystem::path& prefix) {
  std::vector<std::filesystem::path> files;
  for (const char* ending : {"_skin.ply", "_skull.ply", "_mandible.ply", "_landmarks.json",
                             ".mrk.json", "_jaw_opening.yaml", "_jaw_advance.yaml"})
    files.push_back(prefix.string() + ending);
  return files;
}

std::vector<std::filesystem::path> write_phantom(const std::filesystem::path& prefix,
                                                 const Phantom& phantom, PhantomTissue kind) {
  const TissueText& tissue = kind == PhantomTissue::springs ? springs : solid;
  const std::vector<std::filesystem::path> files = phantom_files(prefix);
  write_ply(files[0], phantom.skin);
  write_ply(files[1], phantom.skull);
  write_ply(files[2], phantom.mandible);
  const Landmarks landmarks = rounded(phantom.landmarks);
  base::write_whole_file(files[3], landmarks_json(landmarks));
  base::write_whole_file(files[4], scene::markups_text(landmarks));
  const std::string stem = prefix.filename().string();
  base::write_whole_file(files[5], scene_yaml(opening, tissue, stem));
  base::write_whole_file(files[6], scene_yaml(advance, tissue, stem));
  return files;
}

}  // namespace repose::tools::phantom
