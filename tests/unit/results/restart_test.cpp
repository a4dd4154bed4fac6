#include "repose/results/restart.h"

#include <functional>

#include "files.h"
#include "repose/results/model_file.h"

namespace repose::results {
namespace restart_test {

struct StepState {
  double load;
  bool converged;
};

/// Returns the state from which a run resumes a file with such steps.
Restart restart_of(const std::vector<StepState>& steps) {
  const Folder folder;
  const model::Model m = small_model();
  ResultFile file(MPI_COMM_SELF, folder.path("a"), m, model::all_rows(m), Kind::checkpoint);
  for (const StepState& step : steps) {
    model::StepNumbers numbers = small_numbers(step.load);
    numbers.converged = step.converged;
    file.append(numbers, small_rows(m, step.load));
  }
  file.commit();
  EXPECT_TRUE(is_checkpoint(folder.path("a.h5")));
  return read_restart(MPI_COMM_SELF, folder.path("a.h5"), m);
}

TEST(Restart, IsFromTheLastRestPosition) {
  const Restart restart = restart_of({{0, true}, {0.5, true}, {1, false}});
  EXPECT_EQ(restart.load, 0.5);
  EXPECT_FALSE(restart.guess);
  EXPECT_EQ(restart.position, small_rows(small_model(), 0.5).position);
}

TEST(Restart, IsFromTheLastStepOfARunThatWasStoppedOnItsWay) {
  const Folder folder;
  const model::Model m = small_model();
  ResultFile file(MPI_COMM_SELF, folder.path("a"), m, model::all_rows(m));
  for (const double load : {0.0, 0.5}) file.append(small_numbers(load), small_rows(m, load));
  file.commit();
  const model::StepNumbers last = read_step(folder.path("a.h5"), 1, m).numbers;
  EXPECT_FALSE(last.converged);
  EXPECT_EQ(last.reason, stopped_at_rest);
  EXPECT_EQ(read_restart(MPI_COMM_SELF, folder.path("a.h5"), m).load, 0.5);
}

TEST(Restart, IsByAGuessWhereOnlyASearchAtTheEndWasUnderWay) {
  for (const std::vector<StepState>& steps :
       {std::vector<StepState>{{0, true}, {1, false}}, {{1, false}}}) {
    const Restart restart = restart_of(steps);
    EXPECT_EQ(restart.load, 0);
    EXPECT_TRUE(restart.guess);
    EXPECT_EQ(restart.position, small_rows(small_model(), 1).position);
  }
}

TEST(Restart, IsFromTheStartWhereASearchOnTheWayWasUnderWay) {
  const Restart restart = restart_of({{0, true}, {0.5, false}});
  EXPECT_EQ(restart.load, 0);
  EXPECT_FALSE(restart.guess);
}

TEST(Restart, IsFromTheStartWhereNothingWasReached) {
  const Restart restart = restart_of({{0, false}});
  EXPECT_EQ(restart.load, 0);
  EXPECT_FALSE(restart.guess);
  EXPECT_NE(refusal([] { restart_of({}); }).find("no step to resume from"), std::string::npos);
}

/// Returns the state from which a run of `m` resumes a result with steps at rest at these loads.
Restart restart_of_result(const Folder& folder, const std::vector<double>& loads,
                          const model::Model& m) {
  const model::Model stored = small_model();
  ResultFile file(MPI_COMM_SELF, folder.path("a"), stored, model::all_rows(stored));
  for (const double load : loads) {
    model::StepNumbers numbers = small_numbers(load);
    numbers.converged = true;
    file.append(numbers, small_rows(stored, load));
  }
  file.commit();
  return read_restart(MPI_COMM_SELF, folder.path("a.h5"), m);
}

TEST(Restart, KnowsAFinishedResult) {
  const Folder folder;
  const Restart restart = restart_of_result(folder, {0, 0.5, 1}, small_model());
  EXPECT_EQ(restart.differing, "");
  ASSERT_TRUE(restart.end);
  EXPECT_EQ(restart.end->load, 1);
  EXPECT_EQ(restart.kept, 2);
}

TEST(Restart, KeepsTheStepsBefore) {
  const Folder folder;
  const Restart restart = restart_of_result(folder, {0, 0.25, 0.5}, small_model());
  EXPECT_FALSE(restart.end);
  EXPECT_EQ(restart.load, 0.5);
  EXPECT_EQ(restart.kept, 2);
}

TEST(Restart, OfAModelThatDiffersKeepsNothing) {
  const std::vector<std::pair<std::string, std::function<void(model::Model&)>>> changes = {
      {"point/target", [](model::Model& m) { m.points.target.back().z() += 1e-3; }},
      {"spring/stiffness", [](model::Model& m) { m.springs.stiffness[0] *= 1.01; }},
      {"prism/rest_volume", [](model::Model& m) { m.prisms.rest_volume[0] *= 1.01; }},
      {"gravity", [](model::Model& m) { m.gravity.z() = 0; }},
      {"bone_transform", [](model::Model& m) { m.bone_transform[1](2, 3) += 1; }}};
  for (const auto& [array, change] : changes) {
    const Folder folder;
    model::Model m = small_model();
    change(m);
    const Restart restart = restart_of_result(folder, {0, 1}, m);
    EXPECT_EQ(restart.differing, array);
    EXPECT_FALSE(restart.end);
    EXPECT_EQ(restart.kept, 0);
    EXPECT_EQ(restart.load, 1);
  }
}

/// Returns small_model() with a cut of 2 × 2 controls a side.
model::Model cut_model() {
  model::Model m = small_model();
  m.contact.stiffness = 0.1;
  m.contact.cut_faces = {{{2, 2}}, {0}, {}, std::vector<double>(8, 1.0), {0, 1, 0, 0}};
  for (int64_t c = 0; c < 8; ++c) {
    m.contact.cut_faces.point.push_back(c % static_cast<int64_t>(m.points.position.size()));
    m.contact.cut_faces.begin.push_back(c + 1);
  }
  return m;
}

TEST(Restart, OfOtherSidesOfCutsKeepsNothing) {
  const std::vector<std::pair<std::string, std::function<void(model::CutFaces&)>>> changes = {
      {"contact/point", [](model::CutFaces& faces) { faces = {}; }},
      {"contact/wall/point",
       [](model::CutFaces& faces) { std::swap(faces.point[0], faces.point[1]); }},
      {"contact/wall/area", [](model::CutFaces& faces) { faces.area[0] = 2; }}};
  for (const auto& [array, change] : changes) {
    const Folder folder;
    write_small_result(folder.path("a"), cut_model());
    model::Model m = cut_model();
    change(m.contact.cut_faces);
    const Restart restart = read_restart(MPI_COMM_SELF, folder.path("a.h5"), m);
    EXPECT_EQ(restart.differing, array);
    EXPECT_FALSE(restart.end);
  }
}

TEST(Restart, IsFromTheRestPositionAtWhichASignalEndedTheRun) {
  const Folder folder;
  const model::Model m = small_model();
  ResultFile file(MPI_COMM_SELF, folder.path("a"), m, model::all_rows(m));
  for (const double load : {0.0, 0.5}) {
    model::StepNumbers numbers = small_numbers(load);
    numbers.converged = true;
    file.append(numbers, small_rows(m, load));
  }
  EXPECT_TRUE(file.save());
  EXPECT_FALSE(read_step(folder.path("a.h5"), 1, m).numbers.converged);
  const Restart restart = read_restart(MPI_COMM_SELF, folder.path("a.h5"), m);
  EXPECT_EQ(restart.load, 0.5);
  EXPECT_EQ(restart.kept, 1);
}

TEST(Restart, IsRefusedForAnotherModel) {
  const Folder folder;
  model::Model m = small_model();
  write_small_result(folder.path("a"), m);
  m.points.position[1].z() += 1e-9;
  EXPECT_NE(refusal([&] {
              read_restart(MPI_COMM_SELF, folder.path("a.h5"), m);
            }).find("its points differ from the input's"),
            std::string::npos);
}

TEST(Restart, AResultIsNoCheckpoint) {
  const Folder folder;
  write_small_result(folder.path("a"), small_model());
  EXPECT_FALSE(is_checkpoint(folder.path("a.h5")));
}

}  // namespace restart_test
}  // namespace repose::results
