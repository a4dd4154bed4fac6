#include "repose/solve/sliding.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "repose/base/agreement.h"
#include "repose/solve/reaction.h"

namespace repose::solve {
namespace {

constexpr int most_rounds = 100;
constexpr double longest_step = 2;  // mm

/// Rest positions of a model, one after the other, each from the one before.
class Rests {
 public:
  Rests(MPI_Comm comm, const Settings& settings, const std::vector<Vec3>& start)
      : comm_(comm), settings_(settings) {
    rows_.position = start;
  }

  void find(const model::Model& model) {
    base::Stages unused(comm_);
    const Start start{rows_.position};
    outcome_ = find_repose(comm_, model, settings_, start, unused,
                           [&](const model::StepNumbers& numbers, const model::StepRows& rows) {
                             numbers_ = numbers;
                             rows_ = rows;
                           })
                   .path;
    settings_.path.start_load = 1;
    settings_.extent = Extent::whole;
  }
  std::vector<Vec3> forces(const model::Model& model,
                           const std::vector<std::vector<int64_t>>& points) const {
    return reactions(comm_, model, points, numbers_, rows_);
  }
  const PathOutcome& outcome() const { return outcome_; }
  const std::vector<Vec3>& position() const { return rows_.position; }

 private:
  MPI_Comm comm_;
  Settings settings_;
  PathOutcome outcome_;
  model::StepNumbers numbers_;
  model::StepRows rows_;
};

/// The steps of the points along their surfaces, on rank 0.
class Steps {
 public:
  Steps(model::Model& model, const std::vector<model::Slider>& sliders)
      : target_(model.points.target) {
    for (const model::Slider& slider : sliders)
      for (const int64_t point : slider.points) {
        points_.push_back({point});
        shapes_.push_back(&slider.shape);
      }
    std::vector<char> slides(model.points.position.size(), 0);
    for (const auto& point : points_) slides[point[0]] = 1;
    for (size_t s = 0; s < model.springs.points.size(); ++s)
      for (const int64_t end : model.springs.points[s])
        if (slides[end]) stiffness_ = std::max(stiffness_, model.springs.stiffness[s]);
  }
  const std::vector<std::vector<int64_t>>& points() const { return points_; }

  /// Takes one, by the forces on the points; returns the longest, mm.
  double take(const std::vector<Vec3>& forces) {
    std::vector<Vec3> pull, place;
    for (size_t k = 0; k < points_.size(); ++k) {
      place.push_back(target_[points_[k][0]]);
      const Vec3 normal = shapes_[k]->nearest(place[k]).normal;
      pull.push_back(forces[k] - forces[k].dot(normal) * normal);
    }
    const double length = step_length(place, pull);
    double longest = 0;
    for (size_t k = 0; k < points_.size(); ++k) {
      Vec3 step = length * pull[k];
      if (step.norm() > longest_step) step *= longest_step / step.norm();
      target_[points_[k][0]] = shapes_[k]->nearest(place[k] + step).point;
      longest = std::max(longest, step.norm());
    }
    place_ = std::move(place);
    pull_ = std::move(pull);
    return longest;
  }

 private:
  /// s·s / s·y for the last step s and what it took from the pull, y.
  double step_length(const std::vector<Vec3>& place, const std::vector<Vec3>& pull) {
    double ss = 0, sy = 0;
    for (size_t k = 0; k < place_.size(); ++k) {
      const Vec3 s = place[k] - place_[k];
      ss += s.squaredNorm();
      sy += s.dot(pull_[k] - pull[k]);
    }
    if (place_.empty())
      length_ = 0.25 / std::max(stiffness_, 1e-300);
    else
      length_ = sy > 0 ? ss / sy : 1.5 * length_;
    return length_;
  }

  std::vector<Vec3>& target_;
  std::vector<std::vector<int64_t>> points_;  // each in a group of its own
  std::vector<const model::PushedShape*> shapes_;
  std::vector<Vec3> place_, pull_;  // of the last round
  double stiffness_ = 0, length_ = 0;
};

}  // namespace

Sliding slide(MPI_Comm comm, model::Model& model, const std::vector<model::Slider>& sliders,
              const Settings& settings, const std::vector<Vec3>& start) {
  auto wanted = static_cast<int64_t>(sliders.size());
  MPI_Bcast(&wanted, 1, MPI_INT64_T, 0, comm);
  Sliding result;
  if (wanted == 0) return result;
  Rests rests(comm, settings, start);
  Steps steps(model, sliders);
  result.to_go = std::numeric_limits<double>::infinity();
  for (result.settled = false; result.rounds < most_rounds && !result.settled;) {
    rests.find(model);
    ++result.rounds;
    result.stopped = rests.outcome().last.stopped;
    if (result.stopped || !rests.outcome().complete()) break;
    const std::vector<Vec3> forces = rests.forces(model, steps.points());
    if (base::rank(comm) == 0) result.to_go = steps.take(forces);
    MPI_Bcast(&result.to_go, 1, MPI_DOUBLE, 0, comm);
    result.settled = result.to_go <= settings.path.accuracy / 2;
  }
  result.load = rests.outcome().load;
  result.position = rests.position();
  return result;
}

}  // namespace repose::solve
