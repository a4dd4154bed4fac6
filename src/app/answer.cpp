#include "answer.h"

#include <algorithm>
#include <limits>

#include "movement.h"
#include "report.h"
#include "repose/base/collective.h"
#include "repose/scene/landmark_names.h"
#include "repose/solve/supported.h"
#include "skin_checks.h"

namespace repose::app {

std::string describe_answer(const Job& job, const SolvedSkin& skin, const std::vector<Vec3>& now,
                            const solve::Summary& summary, double discretization) {
  std::vector<model::FacePlace> places;
  scene::Landmarks landmarks;
  if (job.anatomy) {
    places = model::face_places(*job.anatomy);
    landmarks = job.anatomy->scene.landmarks;
  }
  const surface::Surface& before = skin.initial();
  const Mat3 axes = scene::head_axes(landmarks);
  return describe_movement(places, axes, before, now) + " " +
         describe_lips(landmarks, axes.row(2), before, now) +
         describe_trust(summary, discretization) + "\n" + describe_warnings(job);
}

std::string describe_warnings(const Job& job) {
  return describe_warnings(job.warnings) +
         (job.anatomy ? describe_warnings(job.anatomy->move_warnings) : "");
}

std::string describe_folds(MPI_Comm comm, const discrete::Part& part, int64_t folded,
                           const std::vector<double>& volume_ratio) {
  if (folded == 0) return "";
  const auto least = std::ranges::min_element(volume_ratio);
  int64_t row = base::count_before(comm, volume_ratio.size()) + (least - volume_ratio.begin());
  base::max_over_ranks_with(
      comm, volume_ratio.empty() ? -std::numeric_limits<double>::infinity() : -*least, row);
  const auto worst = std::ranges::find(part.prism_row, row);
  const bool here = worst != part.prism_row.end();
  Vec3 place = Vec3::Zero();
  if (here) {
    const auto& prism = part.model.prisms.points[worst - part.prism_row.begin()];
    place = part.model.points.position[prism[0]];
  }
  base::max_over_ranks_with(comm, here, place);
  return fmt::format(
      "FOLDED: {} prisms of tissue are inside out, the worst one about {:.1f} mm: release more of "
      "it there (tissue.release, tissue.unattached), let the rim be auto, or move less; "
      "-allow_folded takes it as it is.\n",
      folded, place);
}

std::string describe_touching(const Job& job, const SolvedSkin& skin, const std::vector<Vec3>& now,
                              const solve::Summary& summary) {
  std::string text = describe_contact(job.bodies, summary) + describe_pierced(job.bodies, summary);
  if (!summary.path.complete()) return text;
  text += describe_bone_through_skin(skin.initial(), now, job.local_model.global_metadata);
  if (job.anatomy) text += describe_moving_border(skin.initial(), now);
  return text + skin.describe_self_contact(now);
}

std::string describe_failure(const Job& job, const solve::Summary& summary) {
  return describe_failure(summary, job.reference_state.has_value(),
                          job.local_model.global_metadata.adhesion.has_value(),
                          solve::given_search_options());
}

}  // namespace repose::app
