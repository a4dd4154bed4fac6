#include "repose/results/name_lock.h"

#include <csignal>
#include <cstdlib>
#include <fstream>

#include "files.h"

namespace repose::results {
namespace name_lock_test {

void make(const std::filesystem::path& file) { std::ofstream(file) << "x"; }

TEST(NameLock, IsOneRunsAtATime) {
  const Folder folder;
  {
    const NameLock first(folder.path("a"));
    const std::string text = refusal([&] { NameLock(folder.path("a")); });
    EXPECT_NE(text.find("a.h5: process " + std::to_string(getpid()) + " on "), std::string::npos);
    EXPECT_NE(text.find("choose another -output"), std::string::npos) << text;
    EXPECT_EQ(refusal([&] { NameLock(folder.path("b")); }), "accepted");
    EXPECT_EQ(folder.content(), "a.lock");
  }
  EXPECT_EQ(folder.content(), "");
  EXPECT_EQ(refusal([&] { NameLock(folder.path("a")); }), "accepted");
}

// In a process of its own, which the signal ends.
TEST(NameLockDeathTest, ASignalThatEndsTheProcessRemovesTheFile) {
  const Folder folder;
  for (const int signal : {SIGTERM, SIGINT, SIGHUP, SIGUSR1}) {
    const auto begin_and_end = [&] {
      std::signal(signal, SIG_DFL);
      const NameLock lock(folder.path("a"));
      std::raise(signal);
    };
    EXPECT_EXIT(begin_and_end(), ::testing::KilledBySignal(signal), "");
    EXPECT_EQ(folder.content(), "") << signal;
  }
}

TEST(NameLockDeathTest, ASecondSignalDuringASearchRemovesTheFile) {
  const Folder folder;
  const auto begin_and_end = [&] {
    std::signal(SIGTERM, SIG_DFL);
    const NameLock lock(folder.path("a"));
    base::Interrupt interrupt(MPI_COMM_SELF, 1e9, true);
    std::raise(SIGTERM);
    if (!interrupt.requested()) std::_Exit(1);
    std::raise(SIGTERM);
  };
  EXPECT_EXIT(begin_and_end(), ::testing::KilledBySignal(SIGTERM), "");
  EXPECT_EQ(folder.content(), "");
}

TEST(NameLockDeathTest, AnIgnoredSignalStaysIgnored) {
  const Folder folder;
  const auto go_on = [&] {
    std::signal(SIGHUP, SIG_IGN);
    const NameLock lock(folder.path("a"));
    std::raise(SIGHUP);
    std::_Exit(folder.content() == "a.lock" ? 0 : 1);
  };
  EXPECT_EXIT(go_on(), ::testing::ExitedWithCode(0), "");
}

TEST(NameLock, WhatAKilledRunLeftGoesAndNothingElse) {
  const Folder folder;
  for (const std::string left :
       {"a.lock", "a.h5.77.part", "a_checkpoint.h5.77.part", "a_skin.xdmf.78.part",
        "a_checkpoint_skin.xdmf.9.part", "a_tissue.xdmf.1.part", "a_springs.xdmf.1.part",
        "a_bones.xdmf.1.part", "a_blocks.xdmf.8.part", "a_given_skin.vtp.8.part"})
    make(folder.path(left));
  const std::string others = "a.h5 a.h5.x.part a_2.h5.77.part a_2_skin.xdmf.77.part ba.h5.77.part";
  std::istringstream names(others);
  for (std::string name; names >> name;) make(folder.path(name));
  { const NameLock lock(folder.path("a")); }
  EXPECT_EQ(folder.content(), others);
}

TEST(NameLock, NamesAProcessThatMayLiveOrHasEnded) {
  const Folder folder;
  const NameLock lock(folder.path("a"));
  std::string mine;
  std::getline(std::ifstream(folder.path("a.lock")), mine);
  EXPECT_TRUE(may_be_running(mine)) << mine;
  EXPECT_FALSE(may_be_running(mine + "0")) << "its number was given to another process";
  const auto host = mine.find(" on ");
  EXPECT_FALSE(may_be_running("process 99999999" + mine.substr(host)));
  EXPECT_TRUE(may_be_running("process 99999999 on another-host since tick 1"));
  EXPECT_TRUE(may_be_running("process 99999999 on a host of an earlier version"));
}

TEST(NameLock, AMissingFolderIsRefused) {
  const Folder folder;
  const std::string text = refusal([&] { NameLock(folder.path("none/a")); });
  EXPECT_NE(text.find("none/a.h5: cannot be written: there is no folder"), std::string::npos);
}

}  // namespace name_lock_test
}  // namespace repose::results
