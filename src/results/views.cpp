#include "views.h"

#include <fmt/format.h>

#include <set>

namespace repose::results {

namespace {

constexpr const char* small_integer = "NumberType=\"Char\" Precision=\"1\"";
constexpr const char* long_integer = "NumberType=\"Int\" Precision=\"8\"";
constexpr const char* short_integer = "NumberType=\"Int\" Precision=\"4\"";

constexpr XdmfCell wedge{"TopologyType=\"Wedge\"", 13, 6},
    line{"TopologyType=\"Polyline\" NodesPerElement=\"2\"", 3, 2},
    triangle{"TopologyType=\"Triangle\"", 5, 3};

std::vector<std::string> moving_points(size_t steps) {
  std::vector<std::string> paths;
  for (size_t step = 0; step < steps; ++step)
    paths.push_back(fmt::format("/step/{:04}/point/position", step));
  return paths;
}

XdmfArray point_vector(const char* name, const char* path) {
  return {.name = name, .path = path, .at_points = true, .vector = true};
}

XdmfArray point_integer(const char* name, const char* path, const char* type) {
  return {.name = name, .path = path, .at_points = true, .type = type};
}

void add_fields(const std::vector<OptionalField>& fields, XdmfBlock& block) {
  for (const OptionalField& field : fields)
    block.arrays.push_back({.name = field.name,
                            .path = "step/point/" + field.name,
                            .at_points = true,
                            .vector = field.vector,
                            .in_steps = field.in_step});
}

/// Unit of a field of a result; MPa is N/mm², in a name without a slash.
std::string unit_of(const std::string& name) {
  if (name.starts_with("tangent_young_")) return "mm";
  if (name.starts_with("tangent_"))
    return name[name.size() - 2] == 't' ? "mm per mm" : "mm per degree";
  static const std::vector<std::pair<const char*, std::set<std::string>>> units = {
      {"mm",
       {"displacement", "initial_position", "advance", "discretisation_error", "contact_gap",
        "elongation", "other_rest_displacement", "rest_length"}},
      {"N", {"residual_force", "contact_force", "tension"}},
      {"MPa", {"contact_pressure", "pressure", "von_mises"}}};
  for (const auto& [unit, fields] : units)
    if (fields.contains(name)) return unit;
  return "";
}

XdmfBlock tissue(const FileCounts& counts, size_t steps) {
  XdmfBlock block{"tissue",
                  wedge,
                  "/model/prism/points",
                  counts.points,
                  counts.prisms,
                  moving_points(steps),
                  {point_vector("displacement", "step/point/displacement"),
                   point_vector("residual_force", "step/point/residual_force"),
                   point_vector("initial_position", "/model/point/position"),
                   point_integer("set", "/model/point/set", small_integer),
                   point_integer("layer", "/model/point/layer", short_integer),
                   point_integer("column", "/model/point/column", long_integer),
                   {"volume_ratio", "step/prism/volume_ratio"}}};
  if (counts.solid) {
    block.arrays.push_back({"pressure", "step/prism/pressure"});
    block.arrays.push_back({"von_mises", "step/prism/von_mises"});
    block.arrays.push_back(
        {.name = "principal_stretch", .path = "step/prism/principal_stretch", .vector = true});
  }
  return block;
}

XdmfBlock springs(const FileCounts& counts, size_t steps) {
  return {"springs",
          line,
          "/model/spring/points",
          counts.points,
          counts.springs,
          moving_points(steps),
          {{"elongation", "step/spring/elongation"},
           {"tension", "step/spring/tension"},
           {"rest_length", "/model/spring/rest_length"},
           {.name = "set", .path = "/model/spring/set", .type = short_integer}}};
}

XdmfBlock skin(const FileCounts& counts, size_t steps) {
  return {"skin",
          triangle,
          "/model/skin/points",
          counts.points,
          counts.skin,
          moving_points(steps),
          {point_vector("displacement", "step/point/displacement"),
           point_vector("initial_position", "/model/point/position")}};
}

XdmfBlock bones(const FileCounts& counts, const std::vector<bool>& moved) {
  XdmfBlock block{"bones",
                  triangle,
                  "/model/bone_surfaces/triangles",
                  counts.bone_points,
                  counts.bone_triangles,
                  {},
                  {{.name = "bone", .path = "/model/bone_surfaces/bone", .type = short_integer},
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
  for (XdmfBlock& block : all)
    for (XdmfArray& array : block.arrays) array.unit = unit_of(array.name);
  return all;
}

std::vector<XdmfBlock> named_blocks(const std::vector<XdmfBlock>& views,
                                    const std::vector<NamedBone>& bones) {
  std::vector<XdmfBlock> blocks;
  for (const XdmfBlock& view : views) {
    if (view.cells == 0) continue;
    blocks.push_back(view);
    if (view.name != "bones") continue;
    const XdmfBlock all = std::move(blocks.back());
    blocks.pop_back();
    for (size_t b = 0; b < bones.size(); ++b) {
      if (bones[b].triangles == 0) continue;
      XdmfBlock& bone = blocks.emplace_back(all);
      bone.name = bones[b].name;
      bone.connectivity = fmt::format("/model/bone_surface/{}/triangles", b);
      bone.points = bones[b].points;
      bone.cells = bones[b].triangles;
      bone.first = bones[b].first_point;
      bone.merged = all.points;
      std::erase_if(bone.arrays, [](const XdmfArray& array) { return !array.at_points; });
    }
  }
  return blocks;
}

}  // namespace repose::results
