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
          {"radius", OptionKind::number, "", "The plane cuts only this near to its point.",
           base::Range::between(1e-6, 1e6), "mm"},
          {"surface", OptionKind::path, "",
           "A cutting surface (PLY, STL, OBJ, OFF), in place of the plane or with it: the piece is "
           "beyond both."},
          {"kerf", OptionKind::number, "0", "Thickness of the saw blade.",
           base::Range::between(0, 20), "mm"},
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

  bool is_moved(size_t part) const { return !moves.empty() && !moves[part].is_identity(); }
};

/// Returns the path of a part's file.
std::string file_of(const base::Options& options, const std::string& part) {
  const std::string stem = std::filesystem::path(options.arguments()[0]).stem().string();
  return fmt::format("{}_{}.ply", options.has("output") ? options.text("output") : stem, part);
}

/// Refuses files that cannot be written, before the bones are read.
void reserve_outputs(const base::Options& options, const Parts& parts) {
  for (size_t k = 0; k < parts.names.size(); ++k) {
    base::reserve_output(file_of(options, parts.names[k]));
    if (parts.is_moved(k)) base::reserve_output(file_of(options, parts.names[k] + "_moved"));
  }
}

Parts parts_of_scene(const base::Options& options, const std::filesystem::path& input) {
  for (const char* name : {"point", "normal", "radius", "surface", "kerf", "seed", "piece"})
    if (options.has(name))
      base::refuse("-{} does not go with a scene, whose osteotomies say how to cut", name);
  const scene::Scene scene = scene::read_scene(input);
  const bool moved = options.flag("moved");
  if (scene.osteotomies.empty() && !moved)
    base::refuse("{}: has no osteotomies to make", input.string());
  Parts parts;
  if (moved) parts.moves = scene.moves;
  for (const scene::BoneEntry& bone : scene.bones) parts.names.push_back(bone.name);
  reserve_outputs(options, parts);
  model::Bones bones = model::read_bones(scene);
  parts.surfaces = std::move(bones.surfaces);
  for (const auto& lines : {bones.remarks, scene.remarks, bones.warnings, scene.warnings})
    parts.remarks.insert(parts.remarks.end(), lines.begin(), lines.end());
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
  Parts parts{{}, {"rest", piece}, {}, {}};
  reserve_outputs(options, parts);
  const meshtools::Osteotomy plan = plan_of(options);
  const meshtools::Pieces pieces =
      meshtools::cut_bone(surface::load_surface(input, surface::Role::bone), plan);
  parts.surfaces = {pieces.rest, pieces.piece};
  parts.remarks = pieces.remarks;
  if (plan.kerf > 0)
    parts.remarks.push_back(fmt::format("the saw takes {:.1f} mm³", pieces.kerf_volume));
  return parts;
}

void write(const std::string& file, const surface::Surface& surface) {
  surface::write_ply(file, surface);
  std::printf("  wrote %s: %zu triangles, %.1f mm³\n", file.c_str(), surface.triangles.size(),
              surface::volume_of(surface));
}

void write_moved(const std::string& file, surface::Surface surface,
                 const scene::RigidMotion& motion) {
  for (Vec3& point : surface.points) point = motion.apply(point);
  write(file, surface);
}

void cut(const base::Options& options) {
  const std::filesystem::path input = options.arguments()[0];
  const std::string ending = base::lower(input.extension().string());
  const bool is_scene = ending == ".yaml" || ending == ".yml";
  const Parts parts = is_scene ? parts_of_scene(options, input) : parts_of_bone(options, input);
  for (const std::string& remark : parts.remarks) std::printf("  %s\n", remark.c_str());
  for (size_t k = 0; k < parts.surfaces.size(); ++k) {
    write(file_of(options, parts.names[k]), parts.surfaces[k]);
    if (parts.is_moved(k))
      write_moved(file_of(options, parts.names[k] + "_moved"), parts.surfaces[k], parts.moves[k]);
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
