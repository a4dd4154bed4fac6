#include "views.h"

#include <fmt/format.h>

namespace repose::results {

namespace {

constexpr const char* small_integer = "NumberType=\"Char\" Precision=\"1\"";
constexpr const char* long_integer = "NumberType=\"Int\" Precision=\"8\"";
constexpr const char* short_integer = "NumberType=\"Int\" Precision=\"4\"";

std::vector<std::string> moving_points(size_t steps) {
  std::vector<std::string> paths;
  for (size_t step = 0; step < steps; ++step)
    paths.push_back(fmt::format("/step/{:04}/point/position", step));
  return paths;
}

XdmfArray point_vector(const char* name, const char* path) {
  return {.name = name, .path = path, .at_points = true, .vector = true};
}

void add_fields(const std::vector<OptionalField>& fields, XdmfBlock& block) {
  for (const OptionalField& field : fields)
    block.arrays.push_back({.name = field.name,
                            .path = "step/point/" + field.name,
                            .at_points = true,
                            .vector = field.vector,
                            .in_steps = field.in_step});
}

XdmfBlock tissue(const FileCounts& counts, size_t steps) {
  XdmfBlock block{
      .name = "tissue",
      .topology = "TopologyType=\"Wedge\"",
      .vtk_cell = 13,
      .corners = 6,
      .connectivity = "/model/prism/points",
      .points = counts.points,
      .cells = counts.prisms,
      .geometry = moving_points(steps),
      .arrays = {
          point_vector("displacement", "step/point/displacement"),
          point_vector("residual_force", "step/point/residual_force"),
          point_vector("initial_position", "/model/point/position"),
          {.name = "set", .path = "/model/point/set", .at_points = true, .type = small_integer},
          {.name = "layer", .path = "/model/point/layer", .at_points = true, .type = short_integer},
          {.name = "column",
           .path = "/model/point/column",
           .at_points = true,
           .type = long_integer},
          {"volume_ratio", "step/prism/volume_ratio"}}};
  if (counts.pressure) block.arrays.push_back({"pressure", "step/prism/pressure"});
  if (counts.stress) {
    block.arrays.push_back({"von_mises", "step/prism/von_mises"});
    block.arrays.push_back(
        {.name = "principal_stretch", .path = "step/prism/principal_stretch", .vector = true});
  }
  return block;
}

XdmfBlock springs(const FileCounts& counts, size_t steps) {
  return {.name = "springs",
          .topology = "TopologyType=\"Polyline\" NodesPerElement=\"2\"",
          .vtk_cell = 3,
          .corners = 2,
          .connectivity = "/model/spring/points",
          .points = counts.points,
          .cells = counts.springs,
          .geometry = moving_points(steps),
          .arrays = {{"elongation", "step/spring/elongation"},
                     {"tension", "step/spring/tension"},
                     {"rest_length", "/model/spring/rest_length"},
                     {.name = "set", .path = "/model/spring/set", .type = short_integer}}};
}

XdmfBlock skin(const FileCounts& counts, size_t steps) {
  return {.name = "skin",
          .topology = "TopologyType=\"Triangle\"",
          .vtk_cell = 5,
          .corners = 3,
          .connectivity = "/model/skin/points",
          .points = counts.points,
          .cells = counts.skin,
          .geometry = moving_points(steps),
          .arrays = {point_vector("displacement", "step/point/displacement"),
                     point_vector("initial_position", "/model/point/position")}};
}

XdmfBlock bones(const FileCounts& counts, const std::vector<bool>& moved) {
  XdmfBlock block{
      .name = "bones",
      .topology = "TopologyType=\"Triangle\"",
      .vtk_cell = 5,
      .corners = 3,
      .connectivity = "/model/bone_surfaces/triangles",
      .points = counts.bone_points,
      .cells = counts.bone_triangles,
      .geometry = {},
      .arrays = {{.name = "bone", .path = "/model/bone_surfaces/bone", .type = short_integer},
                 point_vector("displacement", "step/bone_surface/displacement"),
                 point_vector("initial_position", "/model/bone_surfaces/points")}};
  for (size_t step = 0; step < moved.size(); ++step)
    block.geometry.push_back(moved[step] ? fmt::format("/step/{:04}/bone_surface/points", step)
                                         : "/model/bone_surfaces/points");
  return block;
}

}  // namespace

std::vector<XdmfBlock> views(const FileCounts& counts, const std::vector<OptionalField>& fields,
                             const std::vector<bool>& bones_moved) {
  const size_t steps = bones_moved.size();
  std::vector<XdmfBlock> all = {tissue(counts, steps), springs(counts, steps), skin(counts, steps),
                                bones(counts, bones_moved)};
  for (const size_t block : {0, 2}) add_fields(fields, all[block]);
  return all;
}

}  // namespace repose::results
