#include "repose/solve/load_path.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../discrete/moved_block.h"

namespace repose {
namespace load_path_test {

using base::check;

/// A slab of tissue on bone that goes aside by 1 mm.
model::Model slab_on_moving_bone() {
  model::Model slab = testing::block(5, 4, 3, 2, [](int, int, int a) {
    return a == 2 ? model::PointSet::bone : model::PointSet::soft_tissue;
  });
  testing::aim(slab, [](const Vec3& at) { return Vec3(at + Vec3(0, 1, 0)); });
  return slab;
}

/// A search that ends where a test says: `move(step)` is how far from its start all tissue goes,
/// mm, and `fails(step)` whether it does not converge, by the part of the load since the last step.
class Scripted : public solve::RestSearch {
 public:
  std::function<Vec3(double step)> move = [](double) { return Vec3::Zero(); };
  std::function<bool(double step)> fails = [](double) { return false; };
  int evaluations_of_failures = 0;
  double accepted = 0;
  int rejected = 0;

  explicit Scripted(solve::Problem& problem)
      : problem_(problem), positions_(problem.objective().positions()) {}
  solve::Outcome run(Vec displacement, double) override {
    const double step = positions_.load() - accepted;
    const base::VecHandle increment = positions_.make_vector();
    positions_.restrict_to_owned(std::vector<Vec3>(positions_.local().size(), move(step)),
                                 increment);
    check(VecAXPY(displacement, 1, increment));
    solve::Outcome outcome;
    outcome.converged = !fails(step);
    for (int k = 0; k < evaluations_of_failures && !outcome.converged; ++k)
      problem_.function().evaluate(displacement, increment);
    return outcome;
  }
  void set_pressures(const discrete::ContactPressures&) override { ++rejected; }

 private:
  solve::Problem& problem_;
  const discrete::Positions& positions_;
};

struct Path : testing::MovedBlock {
  solve::Problem problem{positions, {1, mechanics::VolumeTerm::penalty, 0.4}, false};
  Scripted search{problem};
  solve::PathSettings settings{.accuracy = 1e-3, .load_steps = 4};
  base::VecHandle displacement = positions.make_vector();
  std::vector<double> loads;

  Path() : MovedBlock(slab_on_moving_bone()) {}
  solve::PathOutcome run(Vec guess = nullptr) {
    solve::LoadPath path(problem, search, settings);
    return path.run(displacement, guess, [&](const solve::Outcome&, double load, double) {
      loads.push_back(search.accepted = load);
    });
  }
  /// All tissue lies deeper by so much, mm.
  base::VecHandle lowered(double depth) const {
    base::VecHandle v = positions.make_vector();
    positions.restrict_to_owned(std::vector<Vec3>(positions.local().size(), Vec3(0, 0, -depth)), v);
    return v;
  }
};

TEST(LoadPath, TakesStepsThatGoAsPredicted) {
  Path path;
  const solve::PathOutcome result = path.run();
  EXPECT_TRUE(result.complete());
  EXPECT_EQ(result.halvings.count(), 0);
  EXPECT_EQ(path.loads, (std::vector<double>{0, 0.25, 0.5, 0.75, 1}));
  EXPECT_NEAR(discrete::largest_block(path.displacement), 1, 1e-6);  // with its bone
}

/// Tissue goes by 1 mm in every step, so that the number of steps shows.
solve::PathOutcome run_with_contact(Path& path) {
  path.part.contact = true;
  path.search.move = [](double step) { return Vec3(0, 0, step > 0 ? 1 : 0); };
  return path.run();
}

double depth(const Path& path) {
  PetscReal deepest = 0;
  check(VecNorm(path.displacement, NORM_INFINITY, &deepest));
  return deepest;
}

TEST(LoadPath, EndsWithContactInAutomaticStepsFromTheStart) {
  Path path;
  const solve::PathOutcome result = run_with_contact(path);
  EXPECT_TRUE(result.complete());
  EXPECT_EQ(result.steps, 4);
  EXPECT_EQ(path.loads, (std::vector<double>{0, 0.25, 0.5, 0.75, 1}));
  EXPECT_LT(depth(path), 2.5) << "one automatic step";
}

TEST(LoadPath, ARestartOnTheWayEndsWithContactInAutomaticStepsFromTheStart) {
  Path path;
  path.settings.load_steps = 0;
  path.settings.start_load = 0.75;
  path.displacement = path.lowered(-3);
  const solve::PathOutcome result = run_with_contact(path);
  EXPECT_TRUE(result.complete());
  EXPECT_EQ(path.loads, (std::vector<double>{0.75, 1}));
  EXPECT_LT(depth(path), 2.5) << "one automatic step";
}

TEST(LoadPath, EndsWithContactAlongItsStepsWhereThatIsRequested) {
  Path path;
  path.settings.ends_along = true;
  EXPECT_TRUE(run_with_contact(path).complete());
  EXPECT_GT(depth(path), 3.5) << "four steps";
}

TEST(LoadPath, ContinuesAlongItsStepsWhereAutomaticOnesFail) {
  Path path;
  int automatic = 0;  // the start, then one step, halved five times
  path.search.fails = [&](double) {
    return path.loads.size() == 4 && ++automatic > 1 && automatic <= 7;
  };
  const solve::PathOutcome result = run_with_contact(path);
  EXPECT_TRUE(result.complete());
  EXPECT_EQ(result.steps, 4);
  EXPECT_GT(depth(path), 3.5) << "four steps";
}

TEST(LoadPath, HalvesAStepThatFails) {
  Path path;
  path.search.fails = [](double step) { return step > 0.1; };
  const solve::PathOutcome result = path.run();
  EXPECT_TRUE(result.complete());
  EXPECT_GE(result.halvings.failed, 2);
  EXPECT_EQ(result.halvings.failed, result.halvings.count());
  EXPECT_EQ(path.search.rejected, result.halvings.count());
  for (size_t i = 1; i < path.loads.size(); ++i) EXPECT_LE(path.loads[i] - path.loads[i - 1], 0.1);
}

TEST(LoadPath, EndsWhereEveryStepFails) {
  Path path;
  path.search.fails = [](double step) { return step > 0; };
  const solve::PathOutcome result = path.run();
  EXPECT_FALSE(result.complete());
  EXPECT_EQ(result.halvings.failed, 5);
  EXPECT_EQ(result.load, 0.25 / 32);
}

TEST(LoadPath, EndsWhereMostEvaluationsAreInVain) {
  Path path;
  path.search.fails = [](double step) { return step > 1.0 / 64; };  // it could go on for long
  path.search.evaluations_of_failures = 1000;
  const solve::PathOutcome outcome = path.run();
  EXPECT_FALSE(outcome.last.converged);
  EXPECT_EQ(outcome.halvings.failed, 3);
  EXPECT_NE(outcome.last.reason.find("3 load steps have been halved, which took 3000"),
            std::string::npos);
}

TEST(LoadPath, HalvesAStepThatFoldsTissue) {
  Path path;
  path.settings.accuracy = 1e3;  // any end is as predicted
  path.search.move = [](double step) { return Vec3(0, 0, step > 0.2 ? -50 : 0); };
  const solve::PathOutcome result = path.run();
  EXPECT_TRUE(result.complete());
  EXPECT_GE(result.halvings.folded, 2);
  EXPECT_EQ(result.halvings.folded, result.halvings.count());
  EXPECT_LT(discrete::largest_block(path.displacement), 2);
}

TEST(LoadPath, HalvesAStepThatEndsFarFromThePrediction) {
  Path path;
  path.search.move = [](double step) { return Vec3(4 * step * step, 0, 0); };
  const solve::PathOutcome result = path.run();
  EXPECT_TRUE(result.complete());
  EXPECT_GE(result.halvings.off_prediction, 1);
  EXPECT_EQ(result.halvings.off_prediction, result.halvings.count());
  for (size_t i = 1; i < path.loads.size(); ++i)
    EXPECT_NEAR(path.loads[i] - path.loads[i - 1], 0.125, 1e-12);
}

TEST(LoadPath, TakesAJumpThatHalvingDoesNotShrink) {
  Path path;
  path.search.move = [](double step) { return Vec3(step > 0 ? 0.2 : 0, 0, 0); };
  const solve::PathOutcome result = path.run();
  EXPECT_TRUE(result.complete());
  EXPECT_GT(result.halvings.off_prediction, 0);
  for (size_t i = 1; i < path.loads.size(); ++i)
    EXPECT_GE(path.loads[i] - path.loads[i - 1], 0.124);
}

TEST(LoadPath, LeapsToAGuessThatIsNotFolded) {
  Path path;
  EXPECT_TRUE(path.run(path.lowered(0.5)).leapt);
  EXPECT_EQ(path.loads, (std::vector<double>{0, 1}));
}

TEST(LoadPath, LeavesAGuessThatIsFolded) {
  Path path;
  const solve::PathOutcome result = path.run(path.lowered(50));
  EXPECT_TRUE(result.complete());
  EXPECT_FALSE(result.leapt);
  EXPECT_EQ(path.loads.size(), 5u);
}

}  // namespace load_path_test
}  // namespace repose
