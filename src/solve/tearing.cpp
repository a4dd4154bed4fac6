#include "repose/solve/tearing.h"

#include <algorithm>

#include "repose/base/agreement.h"
#include "repose/base/collective.h"
#include "repose/base/error.h"
#include "repose/model/cut.h"

namespace repose::solve {
namespace {

constexpr int max_rounds = 100;

/// The springs that may tear and those that have, on rank 0.
class Rupture {
 public:
  Rupture(model::Model& model, Tearing& result) : model_(model), result_(result) {
    for (const Vec3& force : model.points.external_force) loaded_.push_back(force.norm() > 0);
  }

  /// Removes what is above the limit; returns whether anything was.
  bool tear(const std::vector<double>& tension) {
    const model::Springs& springs = model_.springs;
    std::vector<char> torn(springs.points.size(), 0);
    std::vector<int64_t> ends;
    result_.largest = 0;
    for (size_t j = 0; j < torn.size(); ++j) {
      const auto [p, q] = springs.points[j];
      if (!loaded_[p] && !loaded_[q]) continue;
      result_.largest = std::max(result_.largest, tension[j]);
      if (!(tension[j] > *result_.limit)) continue;
      torn[j] = 1;
      ends.insert(ends.end(), {p, q});
      middles_.push_back((model_.points.position[p] + model_.points.position[q]) / 2);
    }
    if (ends.empty()) return false;
    for (const int64_t end : ends) loaded_[end] = 1;
    const model::Tear gone = model::remove_springs(
        torn, fmt::format("tearing at {:g} N, round {}", *result_.limit, result_.rounds), model_);
    result_.prisms += gone.prisms;
    result_.triangles += gone.triangles;
    return true;
  }

  /// Where the tear is and how long.
  void measure() {
    result_.springs = static_cast<int64_t>(middles_.size());
    for (const Vec3& one : middles_) {
      result_.middle += one / static_cast<double>(middles_.size());
      for (const Vec3& other : middles_)
        result_.length = std::max(result_.length, (one - other).norm());
    }
  }

 private:
  model::Model& model_;
  Tearing& result_;
  std::vector<char> loaded_;   // [N]
  std::vector<Vec3> middles_;  // of the torn springs, mm
};

}  // namespace

Tearing tear(MPI_Comm comm, model::Model& model, const std::optional<double>& limit,
             const Settings& settings, const std::vector<Vec3>& start) {
  double newtons = limit.value_or(0);
  base::broadcast(comm, newtons);
  Tearing result;
  if (newtons == 0) return result;
  result.limit = newtons;
  Rupture rupture(model, result);
  Settings search = settings;
  search.stages = nullptr;
  std::vector<Vec3> position = start;
  bool more = true;
  for (result.settled = false; more && result.rounds < max_rounds;) {
    std::vector<double> tension;
    const Summary rest = find_repose(comm, model, search, {position},
                                     [&](const model::StepNumbers&, const model::StepRows& rows) {
                                       position = rows.position;
                                       tension = rows.tension;
                                     });
    ++result.rounds;
    result.stopped = rest.path.last.stopped;
    if (result.stopped || !rest.path.complete()) break;
    tension = base::gather(comm, tension);
    base::on_root(comm, [&] { more = rupture.tear(tension); });
    base::broadcast(comm, more);
    if (more) {
      result.torn = true;
      result.position = position;
    }
    search.path.start_load = 1;
    result.settled = !more;
  }
  if (base::rank(comm) == 0) rupture.measure();
  return result;
}

}  // namespace repose::solve
