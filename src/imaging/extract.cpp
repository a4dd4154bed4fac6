#include "repose/imaging/extract.h"

#include "repose/base/error.h"
#include "repose/imaging/taubin.h"
#include "repose/imaging/volume_filter.h"
#include "repose/surface/component.h"

namespace repose::imaging {
using namespace surface;
namespace {

Watch watch_step(const StepWatch& watch, const char* step) {
  if (!watch) return {};
  return [&watch, step](double done) { watch(step, done); };
}

std::string size_text(const Volume& volume) {
  return fmt::format("{} × {} × {} voxels of {:.3g} × {:.3g} × {:.3g} mm", volume.size[0],
                     volume.size[1], volume.size[2], volume.spacing(0), volume.spacing(1),
                     volume.spacing(2));
}

/// Returns the input of the isosurface: the volume itself if it is unchanged, else `changed`.
const Volume& prepare(const Volume& volume, const Extraction& requested, const StepWatch& watch,
                      Volume& changed, std::vector<std::string>& remarks) {
  const Volume* field = &volume;
  const auto become = [&](Volume next) {
    changed = std::move(next);
    field = &changed;
  };
  if (requested.box) become(crop(*field, (*requested.box)[0], (*requested.box)[1]));
  if (requested.box) remarks.push_back("cropped to " + size_text(*field));
  if (requested.core) {
    become(keep_core(*field, *requested.core, core_reach));
    remarks.push_back(fmt::format("kept within {:g} mm of the largest part from {:g} on",
                                  core_reach, *requested.core));
  }
  if (requested.label) become(label_field(*field, *requested.label, label_smoothing));
  if (requested.close_holes > 0) {
    become(close_gaps(*field, requested.close_holes, watch_step(watch, "closing holes")));
    remarks.push_back(fmt::format("holes closed up to {:g} mm wide", 2 * requested.close_holes));
  }
  if (requested.voxel > 0) {
    become(coarsen(*field, requested.voxel));
    remarks.push_back("averaged to " + size_text(*field));
  }
  if (!requested.box) return *field;
  if (const int64_t outside = leave_out((*requested.box)[0], (*requested.box)[1], changed))
    remarks.push_back(fmt::format("{} of these {} voxels lie outside the box and are left out",
                                  outside, changed.values.size()));
  return *field;
}

void choose_components(Surface& surface, const Extraction& requested,
                       std::vector<std::string>& remarks) {
  if (!requested.largest && requested.components_above == 0) return;
  const size_t all = surface.triangles.size();
  surface = requested.largest ? largest_component(surface)
                              : components_above(surface, requested.components_above);
  remarks.push_back(fmt::format(
      "{} kept: {} of {} triangles",
      requested.largest ? "largest component"
                        : fmt::format("components ≥ {:g} mm³", requested.components_above),
      surface.triangles.size(), all));
}

void smooth(Surface& surface, int64_t rounds, const StepWatch& watch,
            std::vector<std::string>& remarks) {
  if (rounds == 0) return;
  const double volume = volume_of(surface);
  const double moved = smooth_taubin(surface, rounds, watch_step(watch, "smoothing"));
  remarks.push_back(
      fmt::format("smoothed by {} rounds: points moved by {:.3g} mm at most, volume by {:+.3g} %",
                  rounds, moved, 100 * (volume_of(surface) / volume - 1)));
}

}  // namespace

Extracted extract(const Volume& volume, const Extraction& requested, const StepWatch& watch) {
  if (int{requested.level.has_value()} + int{requested.otsu} + int{requested.label.has_value()} !=
      1)
    base::refuse("{}: what the surface is must be said in one way: a level, Otsu's, or a label",
                 volume.name);
  Extracted result{{}, 0, volume.remarks};
  Volume changed;
  const Volume& field = prepare(volume, requested, watch, changed, result.remarks);
  if (requested.level) result.level = *requested.level;
  if (requested.otsu) result.level = otsu_level(field);
  result.surface =
      isosurface(field, result.level, requested.border, watch_step(watch, "isosurface"));
  choose_components(result.surface, requested, result.remarks);
  smooth(result.surface, requested.smooth, watch, result.remarks);
  return result;
}

}  // namespace repose::imaging
