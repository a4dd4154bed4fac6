#include "sensitivity.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <map>

#include "report.h"
#include "repose/base/agreement.h"
#include "repose/base/error.h"
#include "repose/discrete/natural_rows.h"
#include "repose/model/cut.h"
#include "repose/model/material.h"
#include "repose/solve/prestress.h"

namespace repose::app {

namespace {

constexpr double moves = 0.5;  // mm, of the skin that counts

/// Downwards: pressures of a change towards 0.5 are not of first order.
double lower(double poisson) { return poisson < 0.47 ? poisson - 0.05 : 0.45; }

void soften(scene::Material& material) {
  material.deep.poisson = lower(material.deep.poisson);
  for (scene::Stratum& stratum : material.strata)
    stratum.elasticity.poisson = lower(stratum.elasticity.poisson);
  for (scene::MaterialRegion& region : material.regions)
    region.elasticity.poisson = lower(region.elasticity.poisson);
}

/// mm, of the skin of a material without strata; that of the preset skin_on_fat.
constexpr double usual_skin = 1.5;

double skin_thickness(const scene::Material& material) {
  return material.strata.empty() ? usual_skin : material.strata.front().thickness;
}

void stiffen_skin(scene::Material& material) {
  constexpr double times = 5;  // of the moduli, as in the preset skin_on_fat
  if (material.strata.empty()) material.strata.push_back({usual_skin, material.deep});
  material.strata.front().elasticity.young *= times;
}

/// The model of a scene in place of the job's own, as read_job would make it. Collective.
model::Model model_of(MPI_Comm comm, const Job& job, const scene::Scene& scene) {
  model::BuiltModel built;
  base::on_root(comm,
                [&] { built = model::build_model(scene, job.anatomy->skin, job.anatomy->bones); });
  base::on_root(comm, [&] { model::make_cuts(built.cuts, true, built.model); });
  if (job.reference_state) solve::prestress(comm, built.model, *job.reference_state);
  base::on_root(comm, [&] {
    model::make_cuts(built.cuts, false, built.model);
    model::add_tone(scene, built.model);
  });
  return std::move(built.model);
}

/// Returns the state `rest` of `model` on the points of `other`, which has the same columns and
/// layers. Cuts double only soft tissue: a point that `other` alone doubles is at rest where the
/// single one is.
solve::RestState on_points_of(const model::Points& other, const model::Points& model,
                              const solve::RestState& rest) {
  using ColumnLayer = std::array<int64_t, 2>;
  std::map<ColumnLayer, std::vector<size_t>> rows;
  for (size_t i = 0; i < model.column.size(); ++i)
    rows[{model.column[i], model.layer[i]}].push_back(i);
  std::map<ColumnLayer, size_t> used;
  solve::RestState found;
  for (size_t i = 0; i < other.column.size(); ++i) {
    const ColumnLayer place = {other.column[i], other.layer[i]};
    const std::vector<size_t>& same = rows.at(place);
    const size_t row = same[std::min(used[place]++, same.size() - 1)];
    found.position.push_back(rest.position[row]);
    if (!rest.pressure.empty()) found.pressure.push_back(rest.pressure[row]);
  }
  return found;
}

Sensitivity over_skin(const model::Model& model, const std::vector<Vec3>& position,
                      const std::vector<Vec3>& change) {
  Sensitivity found;
  std::vector<double> lengths;
  for (size_t i = 0; i < change.size(); ++i) {
    const Vec3& initial = model.points.position[i];
    if (model.points.layer[i] > 0 || (position[i] - initial).norm() < moves) continue;
    lengths.push_back(change[i].norm());
    if (lengths.back() <= found.largest) continue;
    found.largest = lengths.back();
    found.where = initial;
  }
  found.known = !change.empty();
  found.counted = !lengths.empty();
  if (!found.counted) return found;
  std::sort(lengths.begin(), lengths.end());
  found.median = lengths[(lengths.size() - 1) / 2];
  found.percentile_95 = lengths[(lengths.size() - 1) * 95 / 100];
  return found;
}

}  // namespace

std::vector<Variation> variations(const scene::Scene& scene) {
  constexpr double more = 1.5;
  std::vector<Variation> all;
  const auto vary = [&](const std::string& name, bool applies, auto&& change) {
    if (!applies) return;
    all.push_back({name, scene});
    change(all.back().scene);
  };
  using scene::Rim;
  using scene::Scene;
  vary("a free rim", scene.rim != Rim::free, [](Scene& s) { s.rim = Rim::free; });
  vary("a rim held all round", scene.rim != Rim::fixed, [](Scene& s) { s.rim = Rim::fixed; });
  if (const std::optional<scene::Material>& material = scene.tissue.material) {
    const double poisson = material->deep.poisson;
    vary(fmt::format("a lower Poisson's ratio ({:.2f} for {:.2f})", lower(poisson), poisson), true,
         [](Scene& s) { soften(*s.tissue.material); });
    vary(fmt::format("a skin of {:g} mm, five times as stiff", skin_thickness(*material)), true,
         [](Scene& s) { stiffen_skin(*s.tissue.material); });
  }
  const bool moved = std::any_of(scene.moves.begin(), scene.moves.end(),
                                 [](const auto& move) { return !move.is_identity(); });
  vary("tissue.release half as large again", moved && scene.tissue.release > 0,
       [](Scene& s) { s.tissue.release *= more; });
  return all;
}

std::vector<Sensitivity> sensitivities(MPI_Comm comm, const Job& job,
                                       const mechanics::Weights& weights,
                                       const solve::RestState& rest,
                                       const std::function<void(double)>& watch) {
  std::vector<Variation> all;
  if (job.anatomy) all = variations(job.anatomy->scene);
  auto count = all.size();
  base::broadcast(comm, count);
  all.resize(count);
  const model::Points points = discrete::gather_model(comm, job.local_model).points;
  std::vector<Sensitivity> found;
  for (const Variation& variation : all) {
    Sensitivity one;
    try {
      const model::Model other = model_of(comm, job, variation.scene);
      solve::RestState state;
      base::on_root(comm, [&] { state = on_points_of(other.points, points, rest); });
      one =
          over_skin(other, state.position, solve::first_order_change(comm, other, weights, state));
    } catch (const base::InputError&) {
      // no tissue fits so: nothing is known of it
    }
    one.name = variation.name;
    found.push_back(one);
    watch(static_cast<double>(found.size()) / static_cast<double>(all.size()));
  }
  std::sort(found.begin(), found.end(),
            [](const auto& a, const auto& b) { return a.percentile_95 > b.percentile_95; });
  return found;
}

std::string describe_sensitivities(const std::vector<Sensitivity>& found) {
  const auto describe = [](const Sensitivity& s) {
    if (!s.known) return fmt::format("{}: not known to first order", s.name);
    if (!s.counted)
      return fmt::format("{}: no skin counts, as none moves by {:g} mm", s.name, moves);
    return fmt::format(
        "{} moves half of the skin by less than {:.2g} mm, 95 % by {:.2g} mm, all by {:.2g} mm, "
        "the most near {:.0f}",
        s.name, s.median, s.percentile_95, s.largest, s.where);
  };
  std::string text;
  for (const Sensitivity& s : found) text += report_row("sensitivity", describe(s));
  return text;
}

}  // namespace repose::app
