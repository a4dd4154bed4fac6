#include <fmt/format.h>
#include <gtest/gtest.h>

#include "../../fuzz/seeds.h"
#include "repose/imaging/volume.h"

/// Headers of volumes read from files written by hand.
namespace repose::imaging {
namespace volume_read_test {

std::string meta(const std::string& dimensions, const std::string& data = "LOCAL") {
  return fmt::format(
      "ObjectType = Image\nNDims = {}\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
      "ElementSpacing = 0.9 0.9 1.5\nDimSize = 3 3 3\nElementType = MET_SHORT\n"
      "ElementDataFile = {}\n{}",
      dimensions, data, std::string(2 * 3 * 3 * 3, '\7'));
}

TEST(VolumeRead, TakesAMetaImageWithSpacesBehindItsDimensions) {
  const test::Folder folder;
  for (const int width : {1, 2, 40}) {
    const Volume volume = read_volume(folder.write("a.mha", meta(fmt::format("{:<{}}", 3, width))));
    EXPECT_EQ(volume.size, (std::array<int64_t, 3>{3, 3, 3})) << width;
  }
}

TEST(VolumeRead, RefusesAMetaImageOfTooManyDimensions) {
  const test::Folder folder;
  for (const char* dimensions : {"4294967296", ": = 99", "three", ""})
    EXPECT_NE(test::refusal([&] {
                read_volume(folder.write("a.mha", meta(dimensions)));
              }).find("its NDims is "),
              std::string::npos)
        << dimensions;
}

TEST(VolumeRead, RefusesAMetaImageWhoseDataFileIsAFormat) {
  const test::Folder folder;
  for (const char* name : {"%n%s", "%s", "a%d%d.raw 1 3 1", "a%9999d.raw 1 3 1", "%", "%%",
                           "%5.raw", "a%*d.raw", "%d %n 1 3 1"})
    EXPECT_NE(test::refusal([&] {
                read_volume(folder.write("a.mha", meta("3", name)));
              }).find("its ElementDataFile is "),
              std::string::npos)
        << name;
  for (const int slice : {1, 2, 3})
    folder.write(fmt::format("a{:03}.raw", slice), std::string(2 * 3 * 3, '\7'));
  const Volume volume = read_volume(folder.write("a.mhd", meta("3", "a%03d.raw 1 3 1")));
  EXPECT_EQ(volume.size, (std::array<int64_t, 3>{3, 3, 3}));
}

/// A header of 3 × 3 × 3 voxels whose data are elsewhere.
std::string meta_beside(const std::string& data) {
  const std::string text = meta("3", data);
  return text.substr(0, text.find('\7'));
}

void write_slices(const test::Folder& folder, int count) {
  for (int slice = 0; slice < count; ++slice)
    folder.write(fmt::format("my s{}.raw", slice), std::string(2 * 3 * 3, '\7'));
}

const char *const all_listed = "LIST\nmy s0.raw\nmy s1.raw\nmy s2.raw", *const numbered =
                                                                            "my s%d.raw 0 2 1";

TEST(VolumeRead, ReadsAMetaImageOfSeveralFiles) {
  const test::Folder folder;
  write_slices(folder, 3);
  for (const char* data : {all_listed, numbered, "LIST 2\nmy s2.raw\nmy s1.raw\nmy s0.raw\n"}) {
    const Volume volume = read_volume(folder.write("a.mhd", meta_beside(data)));
    EXPECT_EQ(volume.values, std::vector<float>(27, 0x0707)) << data;
  }
}

TEST(VolumeRead, RefusesAMetaImageWithAMissingOrShortSlice) {
  const test::Folder folder;
  write_slices(folder, 2);
  const auto refusal = [&](const std::string& data) {
    return test::refusal([&] { read_volume(folder.write("a.mhd", meta_beside(data))); });
  };
  const auto says = [](const std::string& text, const std::string& words) {
    EXPECT_NE(text.find(words), std::string::npos) << text;
  };
  says(refusal(numbered), "my s2.raw, which is missing");
  says(refusal(all_listed), "my s2.raw, which is missing");
  says(refusal("LIST\nmy s0.raw\nmy s1.raw\n"), "names 2 files, its DimSize 3");
  says(refusal("LIST\nmy s0.raw\nmy s1.raw\nmy s1.raw\nmy s1.raw\n"), "names more than 3 files");
  says(refusal("my s%d.raw 0 1 1"), "names 2 files, its DimSize 3");
  says(refusal("my s%d.raw 0 8 1"), "names more than 3 files");
  says(refusal("s%d.raw 0 2"), "the first number, the last and the step");
  says(refusal("s%d.raw 0 2 0"), "the first number, the last and the step");
  folder.write("my s2.raw", std::string(17, '\7'));
  says(refusal(numbered), "truncated: 17 of the 18 bytes");
  says(refusal(all_listed), "truncated: 17 of the 18 bytes");
}

TEST(VolumeRead, TakesTheWholeLineAsTheNameOfAMetaImagesData) {
  const test::Folder folder;
  folder.write("my data.raw", std::string(54, '\7'));
  for (const char* line : {"ElementDataFile = my data.raw", "ElementDataFile=my data.raw",
                           "ElementDataFile : my data.raw \r"}) {
    std::string text = meta_beside("");
    text.replace(text.find("ElementDataFile"), std::string::npos, line);
    const Volume volume = read_volume(folder.write("a.mhd", text + "\n"));
    EXPECT_EQ(volume.values, std::vector<float>(27, 0x0707)) << line;
  }
}

TEST(VolumeRead, RefusesAMetaImageOfANegativeSize) {
  const test::Folder folder;
  std::string text = meta("3");
  text.replace(text.find("3 3 3"), 5, "-4 3 3");
  EXPECT_NE(test::refusal([&] {
              read_volume(folder.write("a.mha", text));
            }).find("its DimSize is '-4 3 3'; each number must be ≥ 1"),
            std::string::npos);
}

TEST(VolumeRead, RescalesANiftiFile) {
  const test::Folder folder;
  const std::string plain = fuzz::niftis()[1];
  std::string scaled = plain;
  scaled.replace(112, 8, surface::bytes_of(2.0f) + surface::bytes_of(-1024.0f));
  const Volume before = read_volume(folder.write("a.nii", plain)),
               volume = read_volume(folder.write("b.nii", scaled));
  for (size_t v = 0; v < volume.values.size(); ++v)
    EXPECT_EQ(volume.values[v], 2 * before.values[v] - 1024);
}

TEST(VolumeRead, CountsTheVoxelsOfANiftiFileBehindItsExtensions) {
  const test::Folder folder;
  std::string extended = fuzz::niftis()[1];
  extended.replace(108, 4, surface::bytes_of(352.0f + 16));
  extended[348] = 1;
  extended.insert(352, surface::bytes_of(int32_t{16}) + std::string(12, '\0'));
  EXPECT_FALSE(read_volume(folder.write("a.nii", extended)).values.empty());
  extended.pop_back();
  EXPECT_NE(test::refusal([&] { read_volume(folder.write("a.nii", extended)); }).find("truncated"),
            std::string::npos);
}

TEST(VolumeRead, RefusesANrrdFileWhoseSpaceItsLibraryTurns) {
  const test::Folder folder;
  const auto nrrd = [&](const std::string& space) {
    return folder.write("a.nrrd", "NRRD0004\ntype: uint8\ndimension: 3\nspace: " + space +
                                      "\nsizes: 2 2 2\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
                                      "encoding: raw\nspace origin: (5,30,40)\n\n" +
                                      std::string(8, '\7'));
  };
  EXPECT_EQ(read_volume(nrrd("LPS")).origin, Vec3(5, 30, 40));
  EXPECT_EQ(read_volume(nrrd("right-anterior-superior")).origin, Vec3(-5, -30, 40));
  for (const char* space : {"LAS", "left-anterior-superior"})
    EXPECT_NE(test::refusal([&] { read_volume(nrrd(space)); }).find("left-anterior-superior"),
              std::string::npos)
        << space;
}

TEST(VolumeRead, RefusesANiftiFileWhoseOrientationIsHugeOrNotFinite) {
  const test::Folder folder;
  const std::string sound = fuzz::niftis()[1];
  EXPECT_EQ(read_volume(folder.write("a.nii", sound)).axes.cwiseAbs(), Mat3::Identity());
  for (const float bad : {NAN, INFINITY, -1e38f}) {
    std::string spoilt = sound;
    spoilt.replace(296 + 4 * 2, 4, surface::bytes_of<float>(bad));
    for (const int32_t size : {348, 349}) {  // of the header, which the library does not look at
      spoilt.replace(0, 4, surface::bytes_of(size));
      EXPECT_NE(test::refusal([&] {
                  read_volume(folder.write("a.nii", spoilt));
                }).find("srow_y[2] of its orientation is "),
                std::string::npos);
    }
  }
}

std::string refusal_of_slices(const std::string& second) {
  const test::Folder folder;
  folder.write("1.dcm", fuzz::slice(1));
  folder.write("2.dcm", second);
  return test::refusal([&] { read_volume(folder.path(".")); });
}

/// A slice with `more` before its series' name.
std::string slice_with(const std::string& more) {
  std::string slice = fuzz::slice(2);
  return slice.insert(slice.find(fuzz::element(8, 0x103e, "LO", "bone")), more);
}

TEST(VolumeRead, RefusesASliceWithAnElementLongerThanTheFile) {
  EXPECT_EQ(refusal_of_slices(fuzz::slice(2)), "accepted");
  EXPECT_EQ(refusal_of_slices(slice_with(fuzz::element(8, 0x1030, "LO", "CT"))), "accepted");
  const std::string unknown("\x08\0\x30\x10UN\0\0\xff\xff\xff\x7f", 12),
      garbage("\x08\0\x30\x10\0-\xff\x7f", 8), syntax("\2\0\x10\0UI\x14\0", 8);
  EXPECT_NE(refusal_of_slices(slice_with(unknown)).find("(0008,1030) says it holds 2147483647 b"),
            std::string::npos);
  EXPECT_NE(refusal_of_slices(slice_with(garbage)).find("(0008,1030) says it holds 2147429632 b"),
            std::string::npos);
  std::string odd = fuzz::slice(2);
  ASSERT_NE(odd.find(syntax), std::string::npos);
  odd.replace(odd.find(syntax) + 4, 4, std::string("U6\0\x20", 4));
  EXPECT_NE(refusal_of_slices(odd).find("(0002,0010) says it holds 536884821 bytes"),
            std::string::npos);
}

}  // namespace volume_read_test
}  // namespace repose::imaging
