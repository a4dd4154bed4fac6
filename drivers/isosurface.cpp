/// repose-isosurface VOLUME: triangle meshes from a CT or a label map, by marching cubes.
///
///     repose-isosurface ct.nii.gz -level -300 -largest -output skin.ply
///     repose-isosurface dicom_folder -level 300 -components_above 1000 -smooth 10 -output bone.stl
///     repose-isosurface labels.nii.gz -labels -largest -output bones.ply
///     repose-isosurface ct.mhd -level 226 -apart skull.mrk.json jaw.mrk.json -largest
///         -output bone.ply
///
/// Writes the mesh, with -labels one a label (bones_1.ply, bones_2.ply, …), with -apart one a bone,
/// in LPS and mm, and says what it did to the data. Exit status: 0 done, 1 bad input (nothing
/// written), 3 internal error.
#include <cstdio>

#include "repose/base/log.h"
#include "repose/base/program.h"
#include "repose/base/whole_file.h"
#include "repose/imaging/extract.h"
#include "repose/imaging/volume_filter.h"
#include "repose/scene/landmark_names.h"
#include "repose/scene/landmarks.h"
#include "repose/surface/component.h"
#include "repose/surface/defects.h"
#include "repose/surface/write.h"
#include "repose/tools/bone_separation/part_bones.h"
#include "repose/tools/bone_separation/propose_points.h"

namespace {

using namespace repose;
using base::OptionKind;

constexpr double largest_length = 1000;  // mm
constexpr int64_t rounds_for_labels = 10;

std::vector<base::Option> option_table() {
  const base::Range length{0, largest_length};
  return {
      {"level", OptionKind::number, "", "Surface where values cross this one.", base::Range{},
       "HU"},
      {"otsu", OptionKind::flag, "", "The level by Otsu's method, from the values."},
      {"label", OptionKind::integer, "", "Surface of one label of a label map.",
       base::Range::between(1, 100000)},
      {"labels", OptionKind::flag, "", "One mesh for every label: NAME_LABEL.ply."},
      {.name = "apart",
       .kind = OptionKind::path,
       .default_text = "",
       .help = "Points in one bone, and in another that touches it: NAME_1.ply, NAME_2.ply.",
       .values = 2},
      {"jaw", OptionKind::flag, "",
       "Skull and jaw of a head in LPS: points for -apart proposed, and written beside."},
      {.name = "box",
       .kind = OptionKind::number,
       .default_text = "",
       .help = "Lowest x y z and highest: only these voxels.",
       .unit = "MM",
       .values = 6},
      {"core", OptionKind::number, "",
       "Keep what lies within 3 mm of the largest part from this value on.", base::Range{}, "HU"},
      {"voxel", OptionKind::number, "0", "Average to voxels this large first; 0: none.", length,
       "MM"},
      {"close_holes", OptionKind::number, "0", "Close gaps up to twice as wide.", length, "MM"},
      {.name = "border",
       .kind = OptionKind::choice,
       .default_text = "closed",
       .help = "Where the volume ends: capped or cut off.",
       .choices = {"closed", "open"}},
      {"largest", OptionKind::flag, "", "Keep the largest component only."},
      {"components_above", OptionKind::number, "0", "Keep components this large.",
       base::Range::at_least(0), "MM3"},
      {.name = "smooth",
       .kind = OptionKind::integer,
       .default_text = "auto",
       .help = "Rounds of smoothing that does not shrink; auto: 10 for labels, else none.",
       .range = {0, 1000},
       .choices = {"auto"}},
      {"output", OptionKind::path, "mesh.ply", "The mesh: .ply, .stl, .obj or .vtp."}};
}

imaging::Extraction requested_of(const base::Options& options) {
  imaging::Extraction requested;
  if (options.has("level")) requested.level = options.number("level");
  requested.otsu = options.flag("otsu");
  if (options.has("label")) requested.label = options.integer("label");
  if (options.has("box")) {
    std::array<Vec3, 2> box;
    const auto numbers = options.texts("box");
    for (int i = 0; i < 6; ++i) box[i / 3][i % 3] = base::parse_number(numbers[i]).value();
    if (!(box[0].array() < box[1].array()).all())
      base::refuse("-box: {} must be the lowest x, y, z and then the highest",
                   fmt::join(numbers, " "));
    requested.box = box;
  }
  if (options.has("core")) requested.core = options.number("core");
  requested.voxel = options.number("voxel");
  requested.close_holes = options.number("close_holes");
  if (options.text("border") == "open") requested.border = imaging::VolumeBorder::open;
  requested.largest = options.flag("largest");
  requested.components_above = options.number("components_above");
  const bool labels = options.flag("labels") || requested.label;
  const bool chosen = options.text("smooth") != "auto";
  requested.smooth = chosen ? options.integer("smooth") : labels ? rounds_for_labels : 0;
  return requested;
}

void print_volume(const imaging::Volume& volume) {
  const auto range = imaging::value_range(volume);
  std::printf("%s: %lld × %lld × %lld voxels of %.4g × %.4g × %.4g mm, values %g … %g\n",
              volume.name.c_str(), static_cast<long long>(volume.size[0]),
              static_cast<long long>(volume.size[1]), static_cast<long long>(volume.size[2]),
              volume.spacing(0), volume.spacing(1), volume.spacing(2), range[0], range[1]);
}

std::string describe_surface(const surface::Surface& mesh) {
  const surface::Defects defects = surface::inspect(mesh, false);
  const bool manifold = defects.non_manifold_edges + defects.non_manifold_vertices == 0;
  return fmt::format(
      "{} vertices, {} triangles, area {:.6g} mm²{}\n  {}; {}", mesh.points.size(),
      mesh.triangles.size(), surface::area_of(mesh),
      defects.border_edges > 0 ? "" : fmt::format(", volume {:.6g} mm³", surface::volume_of(mesh)),
      manifold ? "manifold" : "not manifold", surface::describe(defects));
}

/// mesh.ply → mesh_2.ply
std::string numbered(const std::filesystem::path& file, int64_t label) {
  const std::string name = file.stem().string() + "_" + std::to_string(label);
  return (file.parent_path() / name).string() + file.extension().string();
}

void write_one(const imaging::Volume& volume, const imaging::Extraction& requested,
               const std::string& file) {
  base::Progress progress(MPI_COMM_WORLD);
  const auto result = imaging::extract(
      volume, requested, [&](const std::string& step, double done) { progress.show(step, done); });
  progress.show("checking and writing", -1);
  const std::string summary = describe_surface(result.surface);
  surface::write_surface(file, result.surface);
  progress.clear();
  for (const std::string& remark : result.remarks) std::printf("  %s\n", remark.c_str());
  if (requested.otsu) std::printf("  level by Otsu's method: %.6g\n", result.level);
  std::printf("%s: %s\n", file.c_str(), summary.c_str());
}

std::vector<Vec3> points_in(const std::string& file) {
  std::vector<Vec3> points;
  for (const scene::Landmark& landmark : scene::read_landmarks(file))
    points.push_back(landmark.position);
  return points;
}

/// Writes points proposed in skull and jaw beside the meshes, for correction.
void write_points(const std::array<std::vector<Vec3>, 2>& points, const std::string& output) {
  for (int part = 0; part < 2; ++part) {
    scene::Landmarks named;
    for (size_t n = 0; n < points[part].size(); ++n)
      named[fmt::format("{}-{:03}", part == 0 ? "skull" : "jaw", n + 1)] = points[part][n];
    const std::filesystem::path file =
        std::filesystem::path(numbered(output, part + 1)).replace_extension(".mrk.json");
    base::write_whole_file(file, scene::markups_text(named));
    std::printf("%s: %zu points proposed in the %s\n", file.c_str(), points[part].size(),
                part == 0 ? "skull" : "jaw");
  }
}

/// Notes that bones are hardly to be parted where voxels are as large as their joints.
void note_large_voxels(const imaging::Volume& volume) {
  constexpr double coarse = 3;  // mm
  for (int axis = 0; axis < 3; ++axis)
    if (const double mm = volume.spacing(axis); mm > coarse)
      std::printf(
          "  note: voxels are %.3g mm apart along %c: bone thinner than that may be lost, and "
          "condyles with it; check these, or export slices of at most %g mm\n",
          mm, "ijk"[axis], coarse);
}

/// A surface of each of two bones that touch; `files` of points may be empty.
void write_apart(const imaging::Volume& volume, imaging::Extraction requested,
                 const std::vector<std::string>& files, const std::string& output) {
  if (requested.otsu) requested.level = imaging::otsu_level(volume);
  requested.otsu = false;
  base::Progress progress(MPI_COMM_WORLD);
  note_large_voxels(volume);
  progress.show("parting the bones", -1);
  const auto points = files.empty()
                          ? tools::bone_separation::propose_points(volume, *requested.level)
                          : std::array{points_in(files[0]), points_in(files[1])};
  const auto bones = tools::bone_separation::part_bones(volume, *requested.level, points);
  progress.clear();
  if (files.empty()) write_points(points, output);
  std::printf("  parted where voxels share %.0f mm²\n", bones.cut_area);
  for (int part = 0; part < 2; ++part)
    write_one(bones.parts[part], requested, numbered(output, part + 1));
}

void run(const base::Options& options) {
  const std::string output = options.text("output");
  surface::check_surface_ending(output);
  base::require_writable(output);
  imaging::Extraction requested = requested_of(options);
  const bool all = options.flag("labels"), apart = options.has("apart") || options.flag("jaw");
  if (int{requested.level.has_value()} + requested.otsu + requested.label.has_value() + all != 1)
    base::refuse("repose-isosurface: give one of -level HU, -otsu, -label N and -labels");
  if (options.has("apart") && options.flag("jaw"))
    base::refuse("repose-isosurface: give one of -apart and -jaw");
  if (apart && (all || requested.label))
    base::refuse(
        "repose-isosurface: -apart and -jaw go with -level or -otsu: labels are apart already");
  if (requested.core && (all || requested.label))
    base::refuse("repose-isosurface: -core goes with -level or -otsu: labels hold no values");
  base::Progress progress(MPI_COMM_WORLD);
  progress.show("reading", -1);
  const imaging::Volume volume = imaging::read_volume(
      options.arguments()[0], [&](double done) { progress.show("reading slices", done); });
  progress.clear();
  print_volume(volume);
  if (apart)
    return write_apart(volume, requested,
                       options.flag("jaw") ? std::vector<std::string>{} : options.texts("apart"),
                       output);
  if (!all) return write_one(volume, requested, output);
  const auto labels = imaging::labels_of(volume);
  if (labels.empty()) base::refuse("{}: holds no label, only 0", volume.name);
  for (const int64_t label : labels) {
    requested.label = label;
    write_one(volume, requested, numbered(output, label));
  }
}

}  // namespace

int main(int argc, char** argv) {
  base::Options options(
      argc, argv, "Triangle meshes from a CT or a label map, by marching cubes.",
      {{"VOLUME", "a folder of DICOM slices, .nii, .nii.gz, .nrrd, .mha or .mhd"}}, option_table());
  return base::run_serial_program(options, run);
}
