#include "repose/adapt/ladder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "repose/adapt/transfer.h"
#include "repose/base/agreement.h"
#include "repose/base/deal_out.h"
#include "repose/base/error.h"
#include "repose/base/scoped_option.h"
#include "repose/discrete/gather.h"
#include "repose/model/motion.h"
#include "repose/surface/remesh.h"

namespace repose::adapt {

namespace {

using model::Model;

constexpr double loosest_guide = 0.1;  // mm, accuracy of a rung that only leads on
constexpr double search_share = 0.2;   // of what is enough, for the search of a rung that may be it
// A rung is this many times as far from the scene's own model as from the rung before: errors that
// shrink with the first power of the edge give 1, those that shrink with the second 1/3.
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

class Climber {
 public:
  Climber(MPI_Comm comm, const model::Anatomy& anatomy, const Model& fine, const Climb& wanted)
      : comm_(comm), anatomy_(anatomy), fine_(fine), wanted_(wanted) {}

  Ladder run() {
    const base::ScopedOption method("-tao_type", "ntr");
    for (const Resolution& resolution : wanted_.rungs) {
      bool done = false;
      try {
        done = step_up(resolution);
      } catch (const base::InputError& refusal) {
        ladder_.refusal = refusal.what();
      }
      if (!done || ladder_.near_enough) break;
    }
    return std::move(ladder_);
  }

 private:
  /// Solves the model of one resolution; returns whether it came to rest.
  bool step_up(const Resolution& resolution) {
    Rung rung;
    rung.resolution = resolution;
    const double begin = MPI_Wtime();
    model::BuiltModel built;
    base::on_first_rank(comm_, [&] { built = coarse_model(anatomy_, fine_, resolution); });
    if (wanted_.recording) solve::prestress(comm_, built.model, *wanted_.recording);
    base::Stages unused(comm_);
    std::vector<Vec3> position;
    const solve::Settings settings = settings_for(built.model);
    const solve::Summary summary =
        solve::find_repose(comm_, built.model, settings, start_for(built.model), unused,
                           [&](const model::StepNumbers&, const model::StepRows& rows) {
                             position = discrete::gather_points(comm_, rows.position);
                           });
    if (!summary.path.complete()) {
      ladder_.refusal = fmt::format("a coarse model did not come to rest: {}", summary.last.reason);
      return false;
    }
    rung.unknowns = summary.unknowns;
    rung.evaluations = summary.evaluations;
    rung.assemblies = summary.assemblies;
    base::on_first_rank(comm_, [&] { take(std::move(built), std::move(position), rung); });
    MPI_Bcast(&rung.discretisation_error, 1, MPI_DOUBLE, 0, comm_);
    rung.seconds = MPI_Wtime() - begin;
    ladder_.rungs.push_back(rung);
    ladder_.last_settings = settings;
    const double error = rung.discretisation_error + summary.last.displacement_error;
    ladder_.near_enough = wanted_.enough > 0 && error <= wanted_.enough;
    return true;
  }

  solve::Settings settings_for(const Model& model) const {
    solve::Settings settings = wanted_.settings;
    settings.path.accuracy = wanted_.enough > 0 ? search_share * wanted_.enough
                                                : std::max(settings.path.accuracy, loosest_guide);
    settings.path.hasty = true;
    settings.monitor = settings.stability = false;
    double volume_ratio = 1;  // f_v of a strain grows with the volume of the prisms
    if (base::rank(comm_) == 0 && settings.weights.volume == mechanics::VolumeTerm::paper)
      volume_ratio = mean_volume(fine_) / mean_volume(model);
    MPI_Bcast(&volume_ratio, 1, MPI_DOUBLE, 0, comm_);
    settings.weights.volume_weight *= volume_ratio;
    return settings;
  }

  solve::Start start_for(const Model& model) const {
    if (ladder_.rungs.empty()) return {};
    std::vector<Vec3> all;
    if (base::rank(comm_) == 0) {
      const Model& before = ladder_.last.model;
      const auto moved = sum(ladder_.last_position, before.points.position, -1);
      all = sum(model.points.position, Transfer(before, model).carry(moved), 1);
    }
    return {base::deal_out(comm_, all), true};
  }

  /// Carries the answer of a rung to the scene's points. On rank 0.
  void take(model::BuiltModel&& built, std::vector<Vec3>&& position, Rung& rung) {
    rung.points = static_cast<int64_t>(position.size());
    if (rung.resolution.edge == 0) rung.resolution.edge = surface::even_edge(anatomy_.skin);
    const auto moved = sum(position, built.model.points.position, -1);
    std::vector<Vec3> carried =
        sum(fine_.points.position, Transfer(built.model, fine_).carry(moved), 1);
    rung.skin_change = ladder_.rungs.empty() ? infinity : 0;
    for (size_t i = 0; i < ladder_.position.size(); ++i)
      if (fine_.points.layer[i] == 0)
        rung.skin_change = std::max(rung.skin_change, (carried[i] - ladder_.position[i]).norm());
    rung.discretisation_error = safety * rung.skin_change;
    ladder_.last = std::move(built);
    ladder_.last_position = std::move(position);
    ladder_.before = std::exchange(ladder_.position, std::move(carried));
  }

  MPI_Comm comm_;
  const model::Anatomy& anatomy_;
  const Model& fine_;
  const Climb& wanted_;
  Ladder ladder_;
};

/// Resolutions with edges `coarsening` times as long from rung to rung, down to `fewest` columns,
/// and, where the scene lets them be any number, one layer fewer.
std::vector<Resolution> rungs_by(double coarsening, double fewest, const model::Anatomy& anatomy) {
  const scene::Tissue& tissue = anatomy.scene.tissue;
  const int fewest_layers = std::min(3, tissue.layers);  // two are too stiff across to lead
  const bool free = layers_are_free(tissue);
  auto columns = static_cast<double>(anatomy.skin.points.size());
  Resolution resolution{surface::even_edge(anatomy.skin), tissue.layers};
  std::vector<Resolution> rungs;
  while ((columns /= coarsening * coarsening) >= fewest) {
    resolution.edge *= coarsening;
    if (free) resolution.layers = std::max(fewest_layers, resolution.layers - 1);
    rungs.push_back(resolution);
  }
  std::reverse(rungs.begin(), rungs.end());
  return rungs;
}

}  // namespace

std::vector<Resolution> guiding_rungs(const model::Anatomy& anatomy) {
  return rungs_by(3, 300, anatomy);
}

bool guides_pay(const model::Anatomy& anatomy, const Model& fine) {
  constexpr size_t fine_columns = 10000;
  const double short_way = anatomy.skin.points.size() < fine_columns
                               ? solve::PathSettings{}.longest_stride
                               : 2 * solve::LoadPath::short_stride;  // mm
  return model::PrescribedMotion(fine).largest_travel(fine) > short_way;
}

std::vector<Resolution> compared_rungs(const model::Anatomy& anatomy, int64_t most_columns) {
  std::vector<Resolution> rungs = rungs_by(2, 150, anatomy);
  const double finest =
      surface::even_edge(anatomy.skin) * std::sqrt(static_cast<double>(anatomy.skin.points.size()) /
                                                   static_cast<double>(most_columns));
  std::erase_if(rungs, [&](const Resolution& r) { return r.edge < finest; });
  return rungs;
}

Ladder climb(MPI_Comm comm, const model::Anatomy& anatomy, const Model& fine, const Climb& wanted) {
  return Climber(comm, anatomy, fine, wanted).run();
}

}  // namespace repose::adapt
