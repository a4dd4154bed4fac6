#pragma once
#include <filesystem>

#include "repose/scene/rigid_motion.h"

namespace repose::scene {

/// Reads the motion of a bone from an ITK transform, as 3D Slicer and ITK's registration programs
/// save it: text (.tfm, .txt; "#Insight Transform File V1.0") or HDF5 (.h5), told by content.
///
/// Direction: an ITK transform maps points of the fixed space to the moving space, y = A (x − c) +
/// t + c, because it is made for resampling. A bone goes the other way, from where it is (moving)
/// to its planned place (fixed): the motion returned is the *inverse* of the stored one. A linear
/// transform that moves the bone to its place in 3D Slicer's scene and is saved from there as .tfm
/// therefore moves it to the same place here.
///
/// Frame: the coordinates are LPS, mm; so must be the scene's meshes (3D Slicer's default).
///
/// Kinds: AffineTransform, MatrixOffsetTransformBase (if rigid), Euler3DTransform,
/// VersorRigid3DTransform, TranslationTransform, each in double or float, 3 to 3 dimensions; one in
/// a text file; in HDF5 one, or a CompositeTransform of several. Euler3D: R = Rz Rx Ry, or Rz Ry Rx
/// where a fourth fixed parameter is not 0. Throws InputError that begins with file:line.
RigidMotion read_transform(const std::filesystem::path& file);

/// Writes `motion`, an invertible affine map of points in LPS, mm, that takes something (moving) to
/// its new place (fixed), as an AffineTransform_double_3_3 with all its digits: stored is the
/// inverse, see above, so that 3D Slicer, resampling with ITK and read_transform (if rigid) all
/// move it as `motion` does. Complete or not at all. Throws InputError naming the file.
void write_transform(const std::filesystem::path& file, const Mat4& motion);

}  // namespace repose::scene
