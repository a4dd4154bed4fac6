#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "repose/base/geometry.h"
#include "repose/surface/surface.h"

/// Registration: the rigid or similarity transform that takes a moving shape to a fixed one.
namespace repose::tools::registration {

using surface::Surface;

using base::Similarity;

/// Least breadth of landmarks (base::breadth); below it, the turn about their line is noise.
constexpr double min_breadth = 0.01;

/// Largest ratio of distances between landmarks of one mesh to those of the other, either way, that
/// a rigid fit takes; below that of cm to mm, and above that of any two heads.
constexpr double max_size_ratio = 5;

struct LandmarkFit {
  Similarity transform;           ///< from the landmarks that were not left out
  std::vector<double> residual;   ///< of each landmark, left out or not, mm
  std::vector<double> predicted;  ///< of each, by the fit of the others used (leave-one-out), mm;
                                  ///< NaN where those are fewer than three or on a line
  std::vector<bool> left_out;
  double rms = 0;               ///< of the residuals of those used, mm
  double rms_all = 0;           ///< of the fit to all landmarks, none left out, mm
  double rms_mirrored = 0;      ///< of the best fit to all with a reflection, mm
  bool can_be_checked = false;  ///< enough landmarks that one bad one would show
};

/// Fits landmarks, and leaves out bad ones one by one: the one that the fit of the others predicts
/// worst, where its error is too large for the scatter of the others, at a level of 0.1 % over all
/// landmarks (an F test on the prediction variance of the rigid fit, to first order). At most a
/// third of them is left out, and at least four remain, but of four one may go. Three cannot be
/// checked. Throws InputError for fewer than three, or a set on a line (min_breadth), and without a
/// scale for sets of different size (max_size_ratio), of which one is in another unit.
LandmarkFit fit_landmarks(const std::vector<Vec3>& moving, const std::vector<Vec3>& fixed,
                          bool with_scale);

/// One-line remark where a landmark lies more than 15 mm farther from its mesh than its partner
/// from the other, or half of the landmarks of a mesh lie more than 15 mm from it; else empty. All
/// lengths of the moving mesh are times `scale`.
std::string remark_on_distance(const std::vector<std::string>& names,
                               const std::vector<Vec3>& on_moving, const Surface& moving,
                               const std::vector<Vec3>& on_fixed, const Surface& fixed,
                               double scale);

struct IcpOptions {
  double trim = 0.8;  ///< share of the pairs, the nearest, that counts, (0, 1]
  int max_steps = 100;
  int64_t samples = 20000;  ///< vertices of the moving surface that are used, evenly
  double tolerance = 1e-5;  ///< converged when a step moves no point by more, × extent
};

struct IcpResult {
  Similarity transform;
  int steps = 0;
  bool converged = false;
  double rms_plane = 0;  ///< of the pairs that count, to the fixed surface's planes, mm
  double rms = 0;        ///< of the same, point to point, mm
  double median = 0;     ///< distance of all samples to the fixed surface, mm
  int64_t pairs = 0;     ///< that count
};

/// Refines `start` by iterated closest points (Chen and Medioni, 1992: point to plane; Chetverikov
/// et al., 2005: trimmed). Each step pairs samples of the moving surface with their closest points
/// on the fixed one, drops pairs on the fixed surface's border and those whose normals differ by
/// over 60°, keeps the nearest share, and turns and shifts (never scales) by the linearized least
/// squares. A step that does not lower the trimmed error is halved. Throws InputError where fewer
/// than six pairs remain, or nearly all are of triangles that face opposite ways.
IcpResult refine_by_icp(const Surface& moving, const Surface& fixed, const Similarity& start,
                        const IcpOptions& options);

/// The surface with every point moved; triangles are kept.
Surface moved(const Surface& surface, const Similarity& transform);

}  // namespace repose::tools::registration
