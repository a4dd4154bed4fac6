/// repose-scan RANGE.ply: a laser scanner's range grid (Cyberware / Stanford PLY) as a triangle
/// mesh.
///
///     repose-scan bun000.ply -output face.ply
///     repose-scan head.ply -cylinder -max_edge 4 -output head.vtp
///
/// Cuts steps in depth, keeps colors, says how many holes are left. The mesh is in mm; a scan less
/// than 5 units across is taken to be in meters, one of 45 or more in mm, and another is refused
/// without -unit. Exit status: 0 done, 1 bad input (nothing written), 3 internal error.
#include <algorithm>
#include <cstdio>
#include <map>

#include "repose/base/error.h"
#include "repose/base/program.h"
#include "repose/base/whole_file.h"
#include "repose/surface/component.h"
#include "repose/surface/defects.h"
#include "repose/surface/write.h"
#include "repose/tools/range_scan/range_scan.h"

namespace {

using namespace repose;
using base::OptionKind;

constexpr double largest_in_m = 5, smallest_in_mm = 45;  // units across; cm or inches between

std::vector<base::Option> option_table() {
  return {{.name = "unit",
           .kind = OptionKind::choice,
           .default_text = "auto",
           .help = "Unit of the file; auto: mm or m, by its size.",
           .choices = {"auto", "mm", "cm", "in", "m"}},
          {.name = "max_edge",
           .kind = OptionKind::number,
           .default_text = "auto",
           .help = "Longest edge; longer ones cross a step. auto: 4 × the grid's median step.",
           .range = {1e-3, 1000},
           .unit = "MM",
           .choices = {"auto"}},
          {"max_angle", OptionKind::number, "80", "Steepest triangle against the scanner's view.",
           base::Range::between(1, 90), "DEGREES"},
          {"cylinder", OptionKind::flag, "", "The scanner went round the y axis (head scanners)."},
          {"largest", OptionKind::flag, "", "Keep the component of the most triangles only."},
          {"output", OptionKind::path, "scan.ply", "The mesh: .ply, .stl, .obj or .vtp."}};
}

/// The diagonal of the box between the 1st and 99th percentiles of the coordinates: a few stray
/// points do not change it. 0 for a grid without points.
double extent_of(const std::vector<Vec3>& points) {
  if (points.empty()) return 0;
  Vec3 size;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> along;
    for (const Vec3& point : points) along.push_back(point[axis]);
    std::sort(along.begin(), along.end());
    const size_t cut = along.size() / 100;
    size[axis] = along[along.size() - 1 - cut] - along[cut];
  }
  return size.norm();
}

/// mm per unit of the file.
double scale_of(const base::Options& options, const tools::range_scan::RangeGrid& grid) {
  static const std::map<std::string, double> scales = {
      {"mm", 1}, {"cm", 10}, {"in", 25.4}, {"m", 1000}};
  const std::string unit = options.text("unit");
  if (unit != "auto") return scales.at(unit);
  const double size = extent_of(grid.points);
  if (size >= largest_in_m && size < smallest_in_mm)
    base::refuse(
        "{}: {:.3g} units across, expected {:g} or more in mm or less than {:g} in m; give its "
        "unit by -unit cm, in, mm or m",
        grid.name, size, smallest_in_mm, largest_in_m);
  const std::string taken = size < largest_in_m ? "m" : "mm";
  std::printf("  %.3g units across: taken as %s (-unit says otherwise)\n", size, taken.c_str());
  return scales.at(taken);
}

void print_mesh(const std::string& file, const tools::range_scan::ScanMesh& mesh) {
  const auto count = [](size_t number) { return static_cast<long long>(number); };
  std::printf("  steps cut: %lld triangles with an edge > %.3g mm, %lld more too steep\n",
              static_cast<long long>(mesh.cut_long), mesh.longest_edge,
              static_cast<long long>(mesh.cut_steep));
  if (mesh.dropped > 0)
    std::printf("  smaller components left out: %lld triangles\n",
                static_cast<long long>(mesh.dropped));
  std::printf("  points: %lld in no triangle left out, %lld doubled where sheets met in a point\n",
              static_cast<long long>(mesh.unused), static_cast<long long>(mesh.split));
  const auto holes = tools::range_scan::hole_lengths(mesh.surface);
  std::printf("  holes: %lld", count(holes.size()));
  if (!holes.empty()) std::printf(", the longest %.3g mm around", holes.front());
  std::printf("\n%s: %lld vertices, %lld triangles, area %.6g mm²%s\n", file.c_str(),
              count(mesh.surface.points.size()), count(mesh.surface.triangles.size()),
              surface::area_of(mesh.surface), mesh.data.colors.empty() ? "" : ", with colors");
  std::printf("  %s\n", surface::describe(surface::inspect(mesh.surface, false)).c_str());
}

void run(const base::Options& options) {
  const std::string output = options.text("output");
  surface::check_surface_ending(output);
  base::reserve_output(output);
  const tools::range_scan::RangeGrid grid =
      tools::range_scan::read_range_grid(options.arguments()[0]);
  const auto filled =
      grid.cell.size() - static_cast<size_t>(std::count(grid.cell.begin(), grid.cell.end(), -1));
  std::printf("%s: %lld × %lld cells, %zu of them with a point\n", grid.name.c_str(),
              static_cast<long long>(grid.columns), static_cast<long long>(grid.rows), filled);
  tools::range_scan::ScanOptions requested;
  requested.scale = scale_of(options, grid);
  if (options.text("max_edge") != "auto") requested.longest_edge = options.number("max_edge");
  requested.steepest = options.number("max_angle");
  requested.cylinder = options.flag("cylinder");
  requested.largest = options.flag("largest");
  const tools::range_scan::ScanMesh mesh = tools::range_scan::mesh_of(grid, requested);
  surface::write_surface(output, mesh.surface, mesh.data);
  print_mesh(output, mesh);
}

}  // namespace

int main(int argc, char** argv) {
  base::Options options(argc, argv, "A laser scanner's range grid as a triangle mesh.",
                        {{"RANGE.ply", "a Cyberware or Stanford range-grid PLY"}}, option_table());
  return base::run_serial_program(options, run);
}
