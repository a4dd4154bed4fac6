#include "load_entry.h"

#include "repose/base/error.h"
#include "repose/imaging/extract.h"

namespace repose::model {
namespace {

imaging::Extraction extraction_of(const scene::VolumeEntry& entry) {
  imaging::Extraction requested;
  requested.level = entry.level;
  if (entry.label) requested.label = *entry.label;
  requested.otsu = !entry.level && !entry.label;
  requested.box = entry.box;
  requested.border = entry.open ? imaging::VolumeBorder::open : imaging::VolumeBorder::closed;
  requested.voxel = entry.voxel;
  requested.close_holes = entry.close_holes;
  requested.smooth = entry.smooth;
  requested.largest = true;
  return requested;
}

std::string name_of(const scene::SurfaceEntry& entry, double level) {
  const std::string file = entry.file.string();
  return entry.volume->label ? fmt::format("{} (label {})", file, *entry.volume->label)
                             : fmt::format("{} (level {:g})", file, level);
}

}  // namespace

surface::Surface load_entry(const scene::SurfaceEntry& entry, surface::Role role) {
  if (!entry.volume) return surface::load_surface(entry.file, role);
  auto [surface, level, remarks] =
      imaging::extract(imaging::read_volume(entry.file), extraction_of(*entry.volume));
  surface.name = name_of(entry, level);
  return surface::accept_surface(surface, role);
}

}  // namespace repose::model
