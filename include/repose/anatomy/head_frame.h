#pragma once
#include "repose/base/geometry.h"
#include "repose/surface/surface.h"

namespace repose::anatomy {

/// The frame of a head: its x axis points to the patient's left at right angles to the midsagittal
/// plane, y back, z up, as LPS does for a head without tilt. The origin is in that plane.
struct HeadFrame {
  Mat3 axes = Mat3::Identity();  ///< rows: left, back and up in the coordinates of the scan
  Vec3 origin = Vec3::Zero();    ///< mm

  Vec3 to_frame(const Vec3& point) const { return axes * (point - origin); }
  Vec3 to_scan(const Vec3& point) const { return axes.transpose() * point + origin; }
  /// The frame turned about its x axis so that the segment from `low` to `high` (mm, in the scan)
  /// is upright.
  HeadFrame upright(const Vec3& low, const Vec3& high) const;
};

/// Returns the unit normal, with x ≥ 0, of the plane in which the mirror image of bones lies
/// nearest to them, by robust distances, to which points without a partner hardly add.
Vec3 fit_midsagittal_normal(const surface::Surface& bones);

/// Fits the frame of a head by its bones alone, however it lies in the scan. The midsagittal plane
/// is that of the skull (docs/guide/landmarks.md). In it the way from the mandible's symphysis to
/// its rami leads back and rises by 22°, and the skull lies above. A mirrored head is taken for a
/// turned one. Throws InputError where the mandible does not cross the plane.
HeadFrame fit_head_frame(const surface::Surface& skull, const surface::Surface& mandible);

}  // namespace repose::anatomy
