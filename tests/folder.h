#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "repose/base/error.h"

namespace repose::test {

/// A folder of a test's own, removed at the end.
class Folder {
 public:
  Folder() {
    static int made = 0;
    const std::string name =
        "repose_test_" + std::to_string(getpid()) + "_" + std::to_string(made++);
    path_ = std::filesystem::temp_directory_path() / name;
    std::filesystem::create_directories(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::filesystem::path path(const std::string& name) const { return path_ / name; }
  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name), std::ios::binary) << text;
    return path(name);
  }
  /// Names of what is in it, sorted, separated by spaces.
  std::string content() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(path_))
      names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : " ") + name;
    return text;
  }

 private:
  std::filesystem::path path_;
};

/// Returns the message of a call's refusal, "accepted" if it does not refuse; any other exception
/// passes.
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

}  // namespace repose::test
