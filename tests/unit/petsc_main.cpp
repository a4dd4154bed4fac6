#include <gtest/gtest.h>

#include "repose/base/petsc.h"

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  repose::base::Session session(argc, argv);
  return RUN_ALL_TESTS();
}
