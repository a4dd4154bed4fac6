#include <gtest/gtest.h>

#include "app/report.h"
#include "repose/mechanics/loops.h"

namespace repose::app {
namespace failure_test {

TEST(Failure, NamesAdhesionWhereLoadStepsFailedWithIt) {
  solve::Summary summary;
  summary.path.last.stopped = true;
  const auto names = [&](bool adheres) {
    return describe_failure(summary, false, adheres, "").find("anatomy.adhesion: 0") !=
           std::string::npos;
  };
  EXPECT_FALSE(names(true)) << "stopped on its way";
  summary.path.halvings.failed = 2;
  EXPECT_TRUE(names(true));
  EXPECT_FALSE(names(false));
}

TEST(Failure, NamesOptionsThatMayStopTheSearchShort) {
  solve::Summary summary;
  const auto names = [&](const std::string& options) {
    return describe_failure(summary, false, false, options)
               .find("). Leave out -ksp_max_it 1 first") != std::string::npos;
  };
  EXPECT_TRUE(names("-ksp_max_it 1"));
  EXPECT_FALSE(names(""));
  summary.path.last.stopped = true;
  EXPECT_FALSE(names("-ksp_max_it 1")) << "a time limit";
}

TEST(Failure, CountsOneColumnInTheSingular) {
  solve::Summary summary;
  const auto text = [&](int64_t columns) {
    summary.pierced.columns = summary.pierced_by_instrument.columns = columns;
    summary.pierced.body = summary.pierced_by_instrument.body = 0;
    return describe_pierced({"mandible"}, summary);
  };
  EXPECT_EQ(text(1).find("columns"), std::string::npos) << text(1);
  EXPECT_NE(text(1).find(" 1 column, "), std::string::npos) << text(1);
  EXPECT_NE(text(2).find(" 2 columns, "), std::string::npos) << text(2);
}

/// Advice about springs is given to springs only: in the remark on a hard path, and where the rest
/// position depends on it.
TEST(Advice, IsOfTheTissueOfTheScene) {
  const auto names_springs = [](const std::string& text) {
    EXPECT_NE(text.find("move"), std::string::npos) << text;
    return text.find("springs") != std::string::npos;
  };
  solve::Summary hard;
  hard.path.halvings.failed = 9;
  solve::Settings springs, solid;
  solid.weights = mechanics::solid_weights;
  const base::Stages none(MPI_COMM_SELF);
  EXPECT_TRUE(names_springs(describe_run(hard, springs, 1, none)));
  EXPECT_FALSE(names_springs(describe_run(hard, solid, 1, none)));
  hard.path.halvings.folded = 99;
  EXPECT_TRUE(names_springs(describe_run(hard, springs, 1, none)));
  EXPECT_FALSE(names_springs(describe_run(hard, solid, 1, none)));

  PathCheck check;
  check.steps = 2;
  check.again.path.load = 1;
  check.again.path.last.converged = true;
  check.largest = 3;
  EXPECT_FALSE(names_springs(describe_path(check)));
  check.springs = true;
  EXPECT_NE(describe_path(check).find("springs buckle"), std::string::npos);
}

}  // namespace failure_test
}  // namespace repose::app
