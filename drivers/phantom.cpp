/// repose-phantom: writes a synthetic head of any resolution, with scenes to solve.
///
///     repose-phantom -skin_vertices 477 -springs -output paper
///     repose-phantom -skin_vertices 20000 -bone_edge 2 -output fine
///
/// Writes NAME_skin.ply, NAME_skull.ply, NAME_mandible.ply, NAME_landmarks.json, NAME.mrk.json
/// (3D Slicer) and the scenes NAME_jaw_opening.yaml and NAME_jaw_advance.yaml. Exit status: 0 done,
/// 1 bad input (nothing written), 3 internal error.
#include <cstdio>

#include "repose/base/program.h"
#include "repose/base/whole_file.h"
#include "repose/tools/phantom/phantom.h"

namespace {

using namespace repose;
using base::OptionKind;

std::vector<base::Option> option_table() {
  return {{"skin_vertices", OptionKind::integer, "2000",
           "Vertices of the skin; 477 is the paper's mesh.",
           base::Range::between(tools::phantom::phantom_vertices_min,
                                tools::phantom::phantom_vertices_max)},
          {.name = "bone_edge",
           .kind = OptionKind::number,
           .default_text = "auto",
           .help = "Edges of the bones at the face; auto: as the skin's, between 1 and 5.",
           .range = {tools::phantom::phantom_bone_edge_min, tools::phantom::phantom_bone_edge_max},
           .unit = "mm",
           .choices = {"auto"}},
          {"springs", OptionKind::flag, "", "Scenes of springs, as the paper's, not of a solid."},
          {.name = "output",
           .kind = OptionKind::path,
           .default_text = "head",
           .help = "Path of the files; .yaml or .ply, where it ends so, is left out.",
           .endings = {".yaml", ".ply"}}};
}

void write_head(const base::Options& options) {
  tools::phantom::PhantomOptions requested;
  requested.skin_vertices = options.integer("skin_vertices");
  if (options.text("bone_edge") != "auto") requested.bone_edge = options.number("bone_edge");
  for (const auto& file : tools::phantom::phantom_files(options.text("output")))
    base::require_writable(file);
  std::printf("  writes %s*: meshes, landmarks and scenes of a synthetic head (-help)\n",
              options.text("output").c_str());
  std::fflush(stdout);
  const tools::phantom::Phantom head = tools::phantom::make_phantom(requested);
  for (const surface::Surface* part : {&head.skin, &head.skull, &head.mandible})
    std::printf("  %-17s %7zu vertices, %7zu triangles\n", part->name.c_str(), part->points.size(),
                part->triangles.size());
  const auto tissue = options.flag("springs") ? tools::phantom::PhantomTissue::springs
                                              : tools::phantom::PhantomTissue::solid;
  for (const auto& file : tools::phantom::write_phantom(options.text("output"), head, tissue))
    std::printf("  wrote %s\n", file.c_str());
}

}  // namespace

int main(int argc, char** argv) {
  base::Options options(argc, argv, "Writes a synthetic head: skin, skull, mandible and scenes.",
                        {}, option_table());
  return base::run_serial_program(options, write_head);
}
