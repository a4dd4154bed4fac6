#include <cmath>
#include <string_view>

#include "repose/base/error.h"
#include "repose/base/whole_file.h"
#include "repose/surface/read.h"
#include "repose/tools/phantom/phantom.h"

namespace repose::tools::phantom {
using namespace surface;
namespace {

std::string coordinates(const Vec3& point) {
  // Adding 0 turns −0, which some readers print, into 0; so does rounding to the last digit shown.
  const auto tidy = [](double x) { return std::round(x * 1e4) / 1e4 + 0.0; };
  return fmt::format("{:.4f}, {:.4f}, {:.4f}", tidy(point.x()), tidy(point.y()), tidy(point.z()));
}

std::string landmarks_json(const std::vector<Landmark>& landmarks) {
  std::string text = "{\n";
  for (const Landmark& landmark : landmarks)
    text += fmt::format("  \"{}\": [{}],\n", landmark.name, coordinates(landmark.position));
  text +=
      "  \"condyle_axis\": {\n"
      "    \"point\": [0.0, 0.0, 0.0],\n"
      "    \"direction_right_to_left\": [1.0, 0.0, 0.0]\n"
      "  }\n}\n";
  return text;
}

/// A list of fiducials as 3D Slicer's Markups module reads it.
std::string fiducials_json(const std::vector<Landmark>& landmarks) {
  std::string points;
  for (size_t i = 0; i < landmarks.size(); ++i)
    points += fmt::format(
        "        {{\"id\": \"{}\", \"label\": \"{}\", \"position\": [{}], "
        "\"positionStatus\": \"defined\"}}{}\n",
        i + 1, landmarks[i].name, coordinates(landmarks[i].position),
        i + 1 < landmarks.size() ? "," : "");
  return "{\n"
         "  \"@schema\": \"https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/"
         "Markups/Resources/Schema/markups-schema-v1.0.3.json#\",\n"
         "  \"markups\": [\n    {\n      \"type\": \"Fiducial\",\n"
         "      \"coordinateSystem\": \"LPS\",\n      \"coordinateUnits\": \"mm\",\n"
         "      \"controlPoints\": [\n" +
         points + "      ]\n    }\n  ]\n}\n";
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

std::vector<std::filesystem::path> write_phantom(const std::filesystem::path& prefix,
                                                 const Phantom& phantom, PhantomTissue kind) {
  const TissueText& tissue = kind == PhantomTissue::springs ? springs : solid;
  std::vector<std::filesystem::path> written;
  const auto named = [&](std::string_view ending) {
    return written.emplace_back(prefix.string() + std::string(ending));
  };
  write_ply(named("_skin.ply"), phantom.skin);
  write_ply(named("_skull.ply"), phantom.skull);
  write_ply(named("_mandible.ply"), phantom.mandible);
  base::write_whole_file(named("_landmarks.json"), landmarks_json(phantom.landmarks));
  base::write_whole_file(named(".mrk.json"), fiducials_json(phantom.landmarks));
  const std::string stem = prefix.filename().string();
  base::write_whole_file(named("_jaw_opening.yaml"), scene_yaml(opening, tissue, stem));
  base::write_whole_file(named("_jaw_advance.yaml"), scene_yaml(advance, tissue, stem));
  return written;
}

}  // namespace repose::tools::phantom
