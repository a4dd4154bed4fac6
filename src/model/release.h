#pragma once
#include <span>
#include <vector>

#include "attachment.h"
#include "motion_range.h"

namespace repose::model {

/// Release of tissue from bone.
struct Release {
  double distance;    ///< mm, at most; 0: nowhere
  scene::Attach how;  ///< what it does then
  double band;  ///< on both sides of a release distance, over it, where support is elastic; 0:
                ///< columns are held or released
  std::vector<double> pedicle =
      {};  ///< [bones] least share of the tissue that stays attached; or empty
  std::span<const double> area = {};  ///< [V] mm², of the columns; needed with `pedicle`
};

/// Releases the deepest points near a bone piece whose displacement there differs from that of
/// their own bone (docs/theory/load_path.md: real tissue slides there). How near grows with the
/// difference, from 0 to the whole distance where it is 4 mm, so that the attachment follows the
/// plan without a jump where two pieces move alike. Distances are at the initial position. Of a
/// scene with a plan the difference is the largest in its box. Of the columns on each bone, those
/// nearest to other pieces are released, with no more than the share 1 − pedicle of their area.
/// Returns the release distance of each bone, mm [bones]: release.distance, or less where the
/// pedicle limits it (0: nothing is released).
std::vector<double> release_near_other_pieces(const std::vector<Vec3>& deep, const BoneField& bones,
                                              const MotionRange& range, const Release& release,
                                              Attachment& attachment);

/// Lets go by the same rule of deepest points near that of a rim column (`rim` [V], 1 or 0): the
/// rim stays where it is, so to bones that move it is another piece. Columns that are
/// supported_whole are rim as far as they are held.
void release_near_rim(const std::vector<Vec3>& deep, const std::vector<char>& rim,
                      const MotionRange& range, const Release& release, Attachment& attachment);

}  // namespace repose::model
