#pragma once
#include <string>

#include "repose/imaging/volume.h"

/// From one volume to another, or to a number, before a surface is taken from it.
namespace repose::imaging {

/// Least and greatest finite value.
std::array<float, 2> value_range(const Volume& volume);

/// Describes the range of values for a message; where they fit in 8 bits, also the range that
/// Hounsfield units have.
std::string describe_values(const Volume& volume);

/// The threshold that parts the values into two classes of greatest between-class variance (Otsu,
/// 1979), from a histogram of 1024 bins. Voxels of beyond_volume do not count. Throws InputError
/// where all values are equal.
double otsu_level(const Volume& volume);

/// The voxels from `begin` to before `end` along each axis.
Volume block(const Volume& volume, const std::array<int64_t, 3>& begin,
             const std::array<int64_t, 3>& end);

/// The smallest block of voxels that holds the box from `low` to `high` (mm, LPS). Throws
/// InputError where box and volume do not overlap in at least two voxels along each axis.
Volume crop(const Volume& volume, const Vec3& low, const Vec3& high);

/// Sets voxels to beyond_volume whose centers lie outside the box in x, y or z, where rows of
/// voxels are oblique to that axis. Where they are along it, crop() is all. Returns how many.
/// Throws InputError where no voxel is left.
int64_t leave_out(const Vec3& low, const Vec3& high, Volume& volume);

/// Fewer, larger voxels, each the mean over its part of the volume; `spacing` mm along each axis,
/// rounded so that they fill the volume; an axis that is coarser already is kept.
Volume coarsen(const Volume& volume, double spacing);

/// Grey-level closing (dilation, then erosion) by a ball of `radius` mm: gaps and holes in what is
/// bright close where they are narrower than twice the radius; all else stays. The border of the
/// volume takes no part. O(voxels · voxels of the ball).
Volume close_gaps(const Volume& volume, double radius, const Watch& watch = {});

/// Removes faint things that touch a body, such as the foam of a headrest: sets to the volume's
/// least value each voxel farther than `reach` mm, along each axis in turn, from the largest
/// connected component of {value ≥ core}. Throws InputError where no value reaches the core's.
Volume keep_core(const Volume& volume, double core, double reach);

/// The labels of a label map in rising order, 0 (background) left out. Throws InputError where the
/// values are no labels: not whole, negative, or more than 1000 different ones.
std::vector<int64_t> labels_of(const Volume& volume);

/// A field that is 0 on the smoothed border of one label, positive inside: w_L − max over other
/// labels (background too) of w, where w_M is label M's indicator under a Gaussian of `sigma`
/// voxels. Two labels' fields are opposite where they touch, so their surfaces cannot overlap by
/// more than the grid resolves. Of the label's bounding box only. InputError where there is none.
Volume label_field(const Volume& labels, int64_t label, double sigma);

}  // namespace repose::imaging
