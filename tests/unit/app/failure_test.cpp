#include <gtest/gtest.h>

#include "app/report.h"

namespace repose::app {
namespace failure_test {

TEST(Failure, NamesAdhesionWhereLoadStepsFailedWithIt) {
  solve::Summary summary;
  summary.path.last.stopped = true;
  const auto names = [&](bool adheres) {
    return describe_failure(summary, false, adheres).find("anatomy.adhesion: 0") !=
           std::string::npos;
  };
  EXPECT_FALSE(names(true)) << "stopped on its way";
  summary.path.halvings.failed = 2;
  EXPECT_TRUE(names(true));
  EXPECT_FALSE(names(false));
}

}  // namespace failure_test
}  // namespace repose::app
