/// repose-osteotomy BONE: cuts a closed bone surface into closed, named pieces.
///
///     repose-osteotomy mandible.ply -point 0 0 343 -normal 0 0 -1 -piece chin -kerf 0.8
///     repose-osteotomy mandible.ply -surface split.ply -seed 0 -290 350 -piece jaw
///     repose-osteotomy scene.yaml -output plan
///
/// Makes all osteotomies of a scene, where one is given. Writes NAME_PIECE.ply for every part, the
/// rest under the bone's own name, and with -moved NAME_PIECE_moved.ply. Exit status: 0 done, 1 bad
/// input (nothing written), 3 internal error.
#include <cstdio>

#include "repose/base/program.h"
#include "repose/base/text.h"
#include "repose/base/whole_file.h"
#include "repose/meshtools/osteotomy.h"
#include "repose/model/build.h"
#include "repose/scene/bone_name.h"
#include "repose/surface/component.h"
#include "repose/surface/read.h"

namespace {

using namespace repose;
using base::OptionKind;

std::vector<base::Option> option_table() {
  const auto triple = [](const char* name, const char* help) {
    return base::Option{name, OptionKind::number, "", help, {-1e7, 1e7}, "mm", {}, {}, 3};
  };
  return {triple("point", "A point of the cutting plane."),
          triple("normal", "Normal of the plane, towards the piece."),
          {.name = "radius",
           .kind = OptionKind::number,
           .default_text = "",
           .help = "The plane cuts only this near to its point.",
           .range = {1e-6, 1e6},
           .unit = "mm"},
          {"surface", OptionKind::path, "",
           "A cutting surface (PLY, STL, OBJ, OFF) in place of the plane."},
          {.name = "kerf",
           .kind = OptionKind::number,
           .default_text = "0",
           .help = "Thickness of the saw blade.",
           .range = {0, 20},
           .unit = "mm"},
          triple("seed", "A point inside the piece, which then chooses it."),
          {"piece", OptionKind::text, "piece", "Name of the piece."},
          {"moved", OptionKind::flag, "",
           "Also writes each bone of a scene that moves where its moves take it, to "
           "NAME_PIECE_moved.ply; the scene may have no osteotomies."},
          {.name = "output",
           .kind = OptionKind::path,
           .default_text = "",
           .help = "Path of the files without _PIECE.ply; .ply, where it ends so, is left out.",
           .default_note = "the input's name, here",
           .endings = {".ply"}}};
}

Vec3 vector(const base::Options& options, const char* name) {
  const std::vector<std::string> words = options.texts(name);
  Vec3 result;
  for (int axis = 0; axis < 3; ++axis) result[axis] = *base::parse_number(words[axis]);
  return result;
}

meshtools::Osteotomy plan_of(const base::Options& options) {
  meshtools::Osteotomy plan{options.text("piece"), {}, {}, options.number("kerf"), {}};
  if (options.has("point") != options.has("normal"))
    base::refuse("a plane needs both -point X Y Z and -normal X Y Z");
  if (options.has("point"))
    plan.planes.push_back({vector(options, "point"), vector(options, "normal")});
  if (options.has("radius")) {
    if (plan.planes.empty()) base::refuse("-radius bounds a plane; give -point and -normal too");
    plan.planes[0].radius = options.number("radius");
  }
  if (options.has("surface")) plan.surface = meshtools::load_cutter(options.text("surface"));
  if (options.has("seed")) plan.seed = vector(options, "seed");
  if (plan.planes.empty() && !plan.surface)
    base::refuse("no cut is given; give -point and -normal, or -surface");
  return plan;
}

struct Parts {
  std::vector<surface::Surface> surfaces;
  std::vector<std::string> names, remarks;
  std::vector<scene::RigidMotion> moves;  ///< of each surface, or none
};

Parts parts_of_scene(const base::Options& options, const std::filesystem::path& input) {
  for (const char* name : {"point", "normal", "radius", "surface", "kerf", "seed", "piece"})
    if (options.has(name))
      base::refuse("-{} does not go with a scene, whose osteotomies say how to cut", name);
  const scene::Scene scene = scene::read_scene(input);
  const bool moved = options.flag("moved");
  if (scene.osteotomies.empty() && !moved)
    base::refuse("{}: has no osteotomies to make", input.string());
  model::Bones bones = model::read_bones(scene);
  Parts parts{std::move(bones.surfaces), {}, std::move(bones.remarks), {}};
  for (const auto& lines : {scene.remarks, bones.warnings, scene.warnings})
    parts.remarks.insert(parts.remarks.end(), lines.begin(), lines.end());
  if (moved) parts.moves = scene.moves;
  for (const scene::BoneEntry& bone : scene.bones) parts.names.push_back(bone.name);
  return parts;
}

Parts parts_of_bone(const base::Options& options, const std::filesystem::path& input) {
  if (options.flag("moved")) base::refuse("-moved needs a scene, whose moves it makes");
  const std::string piece = options.text("piece");
  if (!scene::is_bone_name(piece) || piece == "rest")
    base::refuse(
        "-piece {} must be 1 to 64 printable ASCII characters without '/', and not rest, the name "
        "of the bone's other part",
        base::quote(piece));
  const meshtools::Osteotomy plan = plan_of(options);
  meshtools::Pieces pieces =
      meshtools::cut_bone(surface::load_surface(input, surface::Role::bone), plan);
  std::vector<std::string> remarks = pieces.remarks;
  if (plan.kerf > 0) remarks.push_back(fmt::format("the saw takes {:.1f} mm³", pieces.kerf_volume));
  return {{pieces.rest, pieces.piece}, {"rest", plan.piece}, remarks, {}};
}

void write(const std::string& file, const surface::Surface& surface) {
  surface::write_ply(file, surface);
  std::printf("  wrote %s: %zu triangles, %.1f mm³\n", file.c_str(), surface.triangles.size(),
              surface::volume_of(surface));
}

void write_moved(const std::string& file, surface::Surface surface,
                 const scene::RigidMotion& motion) {
  if (motion.is_identity()) return;
  for (Vec3& point : surface.points) point = motion.apply(point);
  write(file, surface);
}

void cut(const base::Options& options) {
  const std::filesystem::path input = options.arguments()[0];
  if (options.has("output")) base::require_writable(options.text("output") + ".ply");
  const std::string ending = base::lower(input.extension().string());
  const bool is_scene = ending == ".yaml" || ending == ".yml";
  const Parts parts = is_scene ? parts_of_scene(options, input) : parts_of_bone(options, input);
  const std::string name = options.has("output") ? options.text("output") : input.stem().string();
  for (const std::string& remark : parts.remarks) std::printf("  %s\n", remark.c_str());
  for (size_t k = 0; k < parts.surfaces.size(); ++k) {
    const std::string file = fmt::format("{}_{}", name, parts.names[k]);
    write(file + ".ply", parts.surfaces[k]);
    if (!parts.moves.empty()) write_moved(file + "_moved.ply", parts.surfaces[k], parts.moves[k]);
  }
}

}  // namespace

int main(int argc, char** argv) {
  base::Options options(
      argc, argv, "Cuts a closed bone surface into closed, named pieces.",
      {{"BONE", "a closed surface (PLY, STL, OBJ, OFF), or a scene (.yaml) with osteotomies"}},
      option_table());
  return base::run_serial_program(options, cut);
}
