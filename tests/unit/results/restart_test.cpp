#include "repose/results/restart.h"

#include "files.h"
#include "repose/results/model_file.h"

namespace repose::results {
namespace {

struct Told {
  double load;
  bool converged;
};

/// What a file with such steps lets a run go on from.
Restart restart_of(const std::vector<Told>& steps) {
  const Folder folder;
  const model::Model m = small_model();
  ResultFile file(MPI_COMM_SELF, folder.path("a"), m, Kind::checkpoint);
  for (const Told& told : steps) {
    model::StepNumbers numbers = small_numbers(told.load);
    numbers.converged = told.converged;
    file.append(numbers, small_rows(m, told.load));
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

TEST(Restart, IsByAGuessWhereOnlyASearchAtTheEndWasUnderWay) {
  for (const std::vector<Told>& steps : {std::vector<Told>{{0, true}, {1, false}}, {{1, false}}}) {
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

TEST(Restart, IsRefusedWhereNothingWasReached) {
  EXPECT_NE(refusal([] {
              restart_of({{0.5, false}});
            }).find("no converged step"),
            std::string::npos);
  EXPECT_NE(refusal([] { restart_of({}); }).find("no converged step"), std::string::npos);
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

}  // namespace
}  // namespace repose::results
