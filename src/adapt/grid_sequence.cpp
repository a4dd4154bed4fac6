#include "repose/adapt/grid_sequence.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "repose/adapt/transfer.h"
#include "repose/base/agreement.h"
#include "repose/base/collective.h"
#include "repose/base/error.h"
#include "repose/base/options.h"
#include "repose/meshtools/remesh.h"
#include "repose/model/material.h"
#include "repose/model/motion.h"

namespace repose::adapt {

namespace {

using model::Model;

constexpr double loosest_guide = 0.1;  // mm, accuracy of a level that only leads on
constexpr double search_share = 0.2;  // of what is enough, for the search of a level that may be it
// A level is this many times as far from the scene's own model as from the level before: errors
// that shrink with the first power of the edge give 1, those that shrink with the second 1/3.
constexpr double safety = 1.5;
constexpr double infinity = std::numeric_limits<double>::infinity();

double mean_volume(const Model& model) {
  double sum = 0;
  for (const double v : model.prisms.rest_volume) sum += v;
  return sum / static_cast<double>(model.prisms.rest_volume.size());
}

std::vector<Vec3> sum(const std::vector<Vec3>& a, const std::vector<Vec3>& b, double sign) {
  std::vector<Vec3> result(a.size());
  for (size_t i = 0; i < a.size(); ++i) result[i] = a[i] + sign * b[i];
  return result;
}

class SequenceSolver {
 public:
  SequenceSolver(MPI_Comm comm, const model::Anatomy& anatomy, const Model& fine,
                 const SequencePlan& requested)
      : comm_(comm), anatomy_(anatomy), fine_(fine), requested_(requested) {
    sequence_.initial = fine.points.position;
    sequence_.layer = fine.points.layer;
  }

  GridSequence run() {
    const base::ScopedOption method("-tao_type", "ntr");
    for (const Resolution& resolution : requested_.levels) {
      bool done = false;
      try {
        done = step_up(resolution);
      } catch (const base::InputError& refusal) {
        sequence_.refusal = refusal.what();
      }
      if (!done || sequence_.near_enough) break;
    }
    return std::move(sequence_);
  }

 private:
  /// Solves the model of one resolution; returns whether it came to rest.
  bool step_up(const Resolution& resolution) {
    Level level;
    level.resolution = resolution;
    const double begin = MPI_Wtime();
    model::BuiltModel built;
    base::on_root(comm_, [&] { built = coarse_model(anatomy_, fine_, resolution); });
    if (requested_.reference_state)
      solve::prestress(comm_, built.model, *requested_.reference_state);
    base::on_root(comm_, [&] { model::add_tone(anatomy_.scene, built.model); });
    std::vector<Vec3> position;
    const solve::Settings settings = settings_for(built.model);
    const solve::Summary summary =
        solve::find_repose(comm_, built.model, settings, start_for(built.model),
                           [&](const model::StepNumbers&, const model::StepRows& rows) {
                             position = base::gather(comm_, rows.position);
                           });
    if (!summary.path.complete()) {
      sequence_.refusal =
          fmt::format("a coarse model did not come to rest: {}", summary.last.reason);
      return false;
    }
    level.evaluations = summary.evaluations;
    level.assemblies = summary.assemblies;
    base::on_root(comm_, [&] { store(std::move(built), std::move(position), level); });
    base::broadcast(comm_, level.discretization_error);
    level.seconds = MPI_Wtime() - begin;
    sequence_.levels.push_back(level);
    sequence_.last_settings = settings;
    const double error = level.discretization_error + summary.last.displacement_error;
    sequence_.near_enough = requested_.enough > 0 && error <= requested_.enough;
    return true;
  }

  solve::Settings settings_for(const Model& model) const {
    solve::Settings settings = requested_.settings;
    settings.path.accuracy = requested_.enough > 0
                                 ? search_share * requested_.enough
                                 : std::max(settings.path.accuracy, loosest_guide);
    settings.monitor = settings.stability = false;
    settings.stages = nullptr;
    double volume_ratio = 1;  // f_v of a strain grows with the volume of the prisms
    if (base::rank(comm_) == 0 && settings.weights.volume == mechanics::VolumeTerm::paper)
      volume_ratio = mean_volume(fine_) / mean_volume(model);
    base::broadcast(comm_, volume_ratio);
    settings.weights.volume_weight *= volume_ratio;
    return settings;
  }

  solve::Start start_for(const Model& model) const {
    if (sequence_.levels.empty()) return {};
    std::vector<Vec3> all;
    base::on_root(comm_, [&] {
      const Model& before = sequence_.last.model;
      const auto moved = sum(sequence_.last_position, before.points.position, -1);
      all = sum(model.points.position, transfer(before, model, moved), 1);
    });
    return {base::scatter(comm_, all), true};
  }

  /// Carries the answer of a level to the scene's points. On rank 0.
  void store(model::BuiltModel&& built, std::vector<Vec3>&& position, Level& level) {
    level.points = std::ssize(position);
    if (level.resolution.edge == 0) level.resolution.edge = meshtools::even_edge(anatomy_.skin);
    const auto moved = sum(position, built.model.points.position, -1);
    std::vector<Vec3> carried = sum(fine_.points.position, transfer(built.model, fine_, moved), 1);
    level.skin_change = sequence_.levels.empty() ? infinity : 0;
    for (size_t i = 0; i < sequence_.position.size(); ++i)
      if (fine_.points.layer[i] == 0)
        level.skin_change =
            std::max(level.skin_change, (carried[i] - sequence_.position[i]).norm());
    level.discretization_error = safety * level.skin_change;
    sequence_.last = std::move(built);
    sequence_.last_position = std::move(position);
    sequence_.before = std::exchange(sequence_.position, std::move(carried));
  }

  MPI_Comm comm_;
  const model::Anatomy& anatomy_;
  const Model& fine_;
  const SequencePlan& requested_;
  GridSequence sequence_;
};

}  // namespace

std::vector<Resolution> compared_resolutions(const model::Anatomy& anatomy, int64_t max_columns) {
  constexpr double fewest = 150;  // columns
  const scene::Tissue& tissue = anatomy.scene.tissue;
  const int fewest_layers = std::min(3, tissue.layers);  // two are too stiff across to lead
  const bool free = layers_are_free(tissue);
  auto columns = static_cast<double>(anatomy.skin.points.size());
  Resolution resolution{meshtools::even_edge(anatomy.skin), tissue.layers};
  const double finest = resolution.edge * std::sqrt(columns / static_cast<double>(max_columns));
  std::vector<Resolution> levels;
  while ((columns /= 4) >= fewest) {
    resolution.edge *= 2;
    if (free) resolution.layers = std::max(fewest_layers, resolution.layers - 1);
    if (resolution.edge >= finest) levels.push_back(resolution);
  }
  std::reverse(levels.begin(), levels.end());
  return levels;
}

GridSequence solve_sequence(MPI_Comm comm, const model::Anatomy& anatomy, const Model& fine,
                            const SequencePlan& requested) {
  return SequenceSolver(comm, anatomy, fine, requested).run();
}

}  // namespace repose::adapt
