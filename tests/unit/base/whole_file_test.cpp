#include "repose/base/whole_file.h"

#include <gtest/gtest.h>

#include "../../folder.h"

namespace repose::base {
namespace whole_file_test {

TEST(WholeFile, DoesNotReplaceAnInput) {
  const test::Folder folder;
  folder.write("a", "input");
  std::filesystem::create_symlink("a", folder.path("link"));
  record_input(folder.path("link"));
  for (const char* name : {"a", "link"}) {
    EXPECT_NE(test::refusal([&] {
                write_whole_file(folder.path(name), "output");
              }).find("is an input of this run"),
              std::string::npos);
    EXPECT_NE(test::refusal([&] { require_writable(folder.path(name)); }), "accepted");
  }
  EXPECT_EQ(folder.content(), "a link");
}

TEST(WholeFile, AReservedOutputIsNoInput) {
  const test::Folder folder;
  folder.write("c", "input");
  std::filesystem::create_symlink("c", folder.path("link"));
  reserve_output(folder.path("c"));
  for (const char* name : {"c", "link"})
    EXPECT_NE(test::refusal([&] {
                record_input(folder.path(name));
              }).find("is an input of this run and would be replaced"),
              std::string::npos);
  write_whole_file(folder.path("c"), "output");
  EXPECT_EQ(test::refusal([&] { record_input(folder.path("c")); }), "accepted") << "its own";
}

TEST(WholeFile, WritesAgainWhatItHasWritten) {
  const test::Folder folder;
  write_whole_file(folder.path("b"), "first");
  record_input(folder.path("b"));
  EXPECT_EQ(test::refusal([&] { write_whole_file(folder.path("b"), "second"); }), "accepted");
}

TEST(WholeFile, ReadsTextAsWindowsSavesIt) {
  const test::Folder folder;
  const auto read = [&](const std::string& content) {
    return read_text_input(folder.write("a.txt", content), {1, "a list", "give a list"});
  };
  EXPECT_EQ(read("\xEF\xBB\xBFskin: a\r\n"), "skin: a\r\n");
  for (const char* mark : {"\xFF\xFE", "\xFE\xFF"})
    EXPECT_NE(test::refusal([&] {
                read(mark + std::string("s\0", 2));
              }).find("a.txt: is text in UTF-16; save it as UTF-8"),
              std::string::npos);
}

TEST(WholeFile, ANameHasALastPartAndNoControlCharacters) {
  for (const char* name : {"", "/", "folder/", ".", "..", "folder/..", "a\nb", "\x7f"})
    EXPECT_NE(test::refusal([&] { require_name(name); }), "accepted") << name;
  EXPECT_NE(test::refusal([&] { require_name(std::string("a\0b", 3)); }), "accepted");
  for (const char* name : {"a", "folder/a.b", "../a", ".hidden", "Kopf größer"})
    EXPECT_EQ(test::refusal([&] { require_name(name); }), "accepted") << name;
}

}  // namespace whole_file_test
}  // namespace repose::base
