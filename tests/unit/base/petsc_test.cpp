#include "repose/base/petsc.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace {

using repose::base::check;
using repose::base::run_callback;

TEST(Callbacks, CheckThrowsWhatAFunctionThrewThatPetscCalled) {
  const PetscErrorCode code = run_callback([] { throw std::out_of_range("row 7"); });
  EXPECT_NE(code, 0);
  try {
    check(code);
    ADD_FAILURE() << "no error";
  } catch (const std::out_of_range& error) {
    EXPECT_STREQ(error.what(), "row 7");
  }
  EXPECT_THROW(check(code), repose::base::PetscError) << "thrown once";
  EXPECT_NO_THROW(check(run_callback([] {})));
}

}  // namespace
