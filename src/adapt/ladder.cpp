#include "repose/adapt/ladder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "repose/adapt/transfer.h"
#include "repose/base/agreement.h"
#include "repose/base/deal_out.h"
#include "repose/base/error.h"
#include "repose/base/scoped_option.h"
#include "repose/solve/gather.h"
#include "repose/surface/remesh.h"

namespace repose::adapt {

namespace {

using model::Model;

constexpr double loosest_accuracy = 0.1;  // mm, of a rung
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
      if (!done) break;
    }
    return std::move(ladder_);
  }

 private:
  double elapsed() const { return MPI_Wtime() - begin_; }

  /// Solves the model of one resolution; returns whether it came to rest.
  bool step_up(const Resolution& resolution) {
    Rung rung;
    rung.resolution = resolution;
    const double begin = elapsed();
    Model model;
    base::on_first_rank(comm_, [&] { model = coarse_model(anatomy_, fine_, resolution); });
    if (wanted_.recording) solve::prestress(comm_, model, *wanted_.recording);
    base::Stages unused(comm_);
    std::vector<Vec3> position;
    const solve::Summary summary =
        solve::find_repose(comm_, model, settings_for(model), start_for(model), unused,
                           [&](const model::StepNumbers&, const model::StepRows& rows) {
                             position = solve::gather_points(comm_, rows.position);
                           });
    ladder_.stopped = summary.path.last.stopped;
    if (!summary.path.complete()) {
      ladder_.refusal = fmt::format("a coarse model did not come to rest: {}", summary.last.reason);
      return false;
    }
    rung.unknowns = summary.unknowns;
    rung.evaluations = summary.evaluations;
    rung.assemblies = summary.assemblies;
    base::on_first_rank(comm_, [&] { take(std::move(model), std::move(position), rung); });
    rung.seconds = elapsed() - begin;
    ladder_.rungs.push_back(rung);
    return true;
  }

  solve::Settings settings_for(const Model& model) const {
    solve::Settings settings = wanted_.settings;
    settings.path.accuracy = std::max(settings.path.accuracy, loosest_accuracy);
    settings.time_limit -= elapsed();
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
    if (base::rank(comm_) == 0)
      all = sum(model.points.position, Transfer(before_, model).carry(displacement_), 1);
    return {base::deal_out(comm_, all), true};
  }

  /// Carries the answer of a rung to the scene's points. On rank 0.
  void take(Model&& model, std::vector<Vec3>&& position, Rung& rung) {
    rung.points = static_cast<int64_t>(position.size());
    displacement_ = sum(position, model.points.position, -1);
    before_ = std::move(model);
    position = sum(fine_.points.position, Transfer(before_, fine_).carry(displacement_), 1);
    rung.change = rung.skin_change = ladder_.rungs.empty() ? infinity : 0;
    for (size_t i = 0; i < ladder_.position.size(); ++i) {
      const double change = (position[i] - ladder_.position[i]).norm();
      rung.change = std::max(rung.change, change);
      if (fine_.points.layer[i] == 0) rung.skin_change = std::max(rung.skin_change, change);
    }
    ladder_.position = std::move(position);
  }

  MPI_Comm comm_;
  const model::Anatomy& anatomy_;
  const Model& fine_;
  const Climb& wanted_;
  const double begin_ = MPI_Wtime();
  Ladder ladder_;
  Model before_;                    // of the last rung, on rank 0
  std::vector<Vec3> displacement_;  // of its points, on rank 0
};

}  // namespace

std::vector<Resolution> rungs_below(const scene::Scene& scene, const surface::Surface& skin) {
  constexpr double fewest_columns = 400, coarsening = 3;
  auto columns = static_cast<double>(skin.points.size());
  double edge = surface::mean_edge(skin);
  std::vector<Resolution> rungs;
  while ((columns /= coarsening * coarsening) >= fewest_columns)
    rungs.push_back({edge *= coarsening, scene.tissue.layers});
  std::reverse(rungs.begin(), rungs.end());
  return rungs;
}

Ladder climb(MPI_Comm comm, const model::Anatomy& anatomy, const Model& fine, const Climb& wanted) {
  return Climber(comm, anatomy, fine, wanted).run();
}

}  // namespace repose::adapt
