#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "repose/base/error.h"

namespace repose::scene {

/// A folder of a test's own with files in it, removed at the end.
class Folder {
 public:
  Folder() {
    static int made = 0;
    const std::string name =
        "scene_test_" + std::to_string(getpid()) + "_" + std::to_string(made++);
    path_ = std::filesystem::temp_directory_path() / name;
    std::filesystem::create_directories(path_ / "sub");
    for (const char* file : {"face.ply", "skull.ply", "mandible.ply"}) write(file, "ply\n");
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::filesystem::path path(const std::string& name) const { return path_ / name; }
  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name), std::ios::binary) << text;
    return path(name);
  }

 private:
  std::filesystem::path path_;
};

/// What a call refuses with, "accepted" if it does not; any other exception passes.
template <class Call>
std::string refusal(const Call& call) {
  try {
    call();
  } catch (const base::InputError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos)
        << "one line: " << error.what();
    return error.what();
  }
  return "accepted";
}

}  // namespace repose::scene
