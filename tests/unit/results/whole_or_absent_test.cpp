#include <fstream>
#include <sstream>

#include "files.h"
#include "repose/results/model_file.h"
#include "results/unfinished_file.h"

namespace repose::results {
namespace whole_or_absent_test {

std::string text_of(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

/// The names of the first parts of a file that a process makes.
std::string parts(const std::string& file, int count) {
  std::string text;
  for (int k = 0; k < count; ++k)
    text += (k ? " " : "") + file + "." + std::to_string(getpid() + k) + ".part";
  return text;
}

TEST(WholeOrAbsent, CommitLeavesTheResultAndItsDocuments) {
  const Folder folder;
  write_small_result(folder.path("a"), small_model());
  EXPECT_EQ(folder.content(),
            "a.h5 a_blocks.xdmf a_bones.xdmf a_skin.xdmf a_springs.xdmf a_tissue.xdmf");
}

TEST(WholeOrAbsent, CommitRemovesTheGivenSkinOfAnEarlierRun) {
  const Folder folder;
  std::ofstream(folder.path("a_given_skin.vtp")) << "of another plan";
  write_small_result(folder.path("a"), small_model());
  EXPECT_FALSE(std::filesystem::exists(folder.path("a_given_skin.vtp")));
}

TEST(WholeOrAbsent, NothingIsLeftWithoutCommit) {
  const Folder folder;
  const model::Model m = small_model();
  {
    ResultFile file(MPI_COMM_SELF, folder.path("a"), m, model::all_rows(m));
    file.append(small_numbers(0), small_rows(m, 0));
    ResultFile other(MPI_COMM_SELF, folder.path("a"), m, model::all_rows(m));
    EXPECT_EQ(folder.content(), parts("a.h5", 2)) << "each has its own";
  }
  EXPECT_EQ(folder.content(), "");
}

/// (load, converged) of the steps that a.h5 has.
std::vector<std::pair<double, bool>> steps_of(const Folder& folder, const model::Model& m) {
  std::vector<std::pair<double, bool>> steps;
  for (int64_t k = 0; k < step_count(folder.path("a.h5")); ++k) {
    const model::StepNumbers numbers = read_step(folder.path("a.h5"), k, m).numbers;
    steps.emplace_back(numbers.load, numbers.converged);
  }
  return steps;
}

TEST(WholeOrAbsent, WhatIsSavedOnTheWayIsAResultAndTheRunGoesOn) {
  using Steps = std::vector<std::pair<double, bool>>;
  const Folder folder;
  const model::Model m = small_model();
  ResultFile file(MPI_COMM_SELF, folder.path("a"), m, model::all_rows(m));
  EXPECT_FALSE(file.save()) << "there is no step";
  const auto at = [](double load, bool converged) {
    model::StepNumbers numbers = small_numbers(load);
    numbers.converged = converged;
    return numbers;
  };
  file.append_provisional(at(0, false), small_rows(m, 0));  // which is saved, as was wanted before
  EXPECT_EQ(folder.content(),
            "a.h5 a_blocks.xdmf a_bones.xdmf a_skin.xdmf a_springs.xdmf a_tissue.xdmf");
  EXPECT_EQ(steps_of(folder, m), (Steps{{0, false}}));
  EXPECT_FALSE(file.save()) << "it is saved";
  file.append(at(0, true), small_rows(m, 0));
  file.append(at(0.5, true), small_rows(m, 0.5));
  EXPECT_EQ(steps_of(folder, m), (Steps{{0, false}})) << "what is saved stays as it is";
  EXPECT_TRUE(file.save());
  EXPECT_EQ(steps_of(folder, m), (Steps{{0, true}, {0.5, false}}));
  file.append(at(1, true), small_rows(m, 1));
  file.commit();
  EXPECT_FALSE(file.save());
  EXPECT_EQ(steps_of(folder, m), (Steps{{0, true}, {0.5, true}, {1, true}}));
}

TEST(WholeOrAbsent, KeptStepsAreThoseOfTheEarlierResult) {
  const Folder folder;
  const model::Model m = small_model();
  write_small_result(folder.path("a"), m);
  const int64_t count = step_count(folder.path("a.h5"));
  ResultFile file(MPI_COMM_SELF, folder.path("b"), m, model::all_rows(m));
  file.keep(folder.path("a.h5"), count);
  file.commit();
  EXPECT_EQ(text_of(folder.path("a_tissue.xdmf")).size(),
            text_of(folder.path("b_tissue.xdmf")).size());
  for (int64_t k = 0; k < count; ++k)
    EXPECT_EQ(read_step(folder.path("b.h5"), k, m).rows.position,
              read_step(folder.path("a.h5"), k, m).rows.position);
}

TEST(WholeOrAbsent, AnEarlierResultStaysUntilCommit) {
  const Folder folder;
  write_small_result(folder.path("a"), small_model());
  const std::string before = text_of(folder.path("a.h5"));
  {
    ResultFile file(MPI_COMM_SELF, folder.path("a"), small_model(), model::all_rows(small_model()));
  }
  EXPECT_EQ(text_of(folder.path("a.h5")), before);
}

TEST(WholeOrAbsent, ADocumentOfAnEarlierRunThatDescribesNothingGoes) {
  const Folder folder;
  write_small_result(folder.path("a"), small_model());
  model::Model m = small_model();
  m.skin.clear();
  write_small_result(folder.path("a"), m);
  EXPECT_EQ(folder.content(), "a.h5 a_blocks.xdmf a_bones.xdmf a_springs.xdmf a_tissue.xdmf");
}

TEST(WholeOrAbsent, BytesDoNotDependOnTheTime) {
  const Folder folder;
  write_small_result(folder.path("a"), small_model());
  sleep(1);  // time stamps of HDF5 count seconds
  write_small_result(folder.path("b"), small_model());
  EXPECT_EQ(text_of(folder.path("a.h5")), text_of(folder.path("b.h5")));
}

TEST(WholeOrAbsent, DotsInTheNameAreKept) {
  const Folder folder;
  write_small_result(folder.path("a.v1.2"), small_model());
  EXPECT_TRUE(std::filesystem::exists(folder.path("a.v1.2.h5")));
  EXPECT_NE(text_of(folder.path("a.v1.2_skin.xdmf")).find(">a.v1.2.h5:/model/skin/points<"),
            std::string::npos);
}

TEST(WholeOrAbsent, MarkupInTheNameIsEscaped) {
  const Folder folder;
  write_small_result(folder.path("a&b"), small_model());
  EXPECT_NE(text_of(folder.path("a&b_skin.xdmf")).find(">a&amp;b.h5:/"), std::string::npos);
}

std::string refusal_to_write(const std::filesystem::path& name) {
  return refusal([&] {
    ResultFile(MPI_COMM_SELF, name, small_model(), model::all_rows(small_model())).commit();
  });
}

TEST(WholeOrAbsent, AMissingFolderIsRefused) {
  const Folder folder;
  const std::string text = refusal_to_write(folder.path("none/a"));
  EXPECT_NE(text.find("none/a.h5: cannot be written: there is no folder"), std::string::npos)
      << text;
}

TEST(WholeOrAbsent, AFolderInThePlaceOfTheFileIsRefused) {
  const Folder folder;
  std::filesystem::create_directory(folder.path("a.h5"));
  const std::string text = refusal_to_write(folder.path("a"));
  EXPECT_NE(text.find("a.h5: is a folder"), std::string::npos) << text;
  EXPECT_EQ(folder.content(), "a.h5");
}

TEST(WholeOrAbsent, ADocumentThatCannotBeReplacedLeavesNoResult) {
  const Folder folder;
  std::filesystem::create_directory(folder.path("a_skin.xdmf"));
  const std::string text = refusal_to_write(folder.path("a"));
  EXPECT_NE(text.find("a_skin.xdmf: is a folder"), std::string::npos) << text;
  EXPECT_EQ(folder.content(), "a_skin.xdmf");
}

TEST(WholeOrAbsent, ADiskThatIsTooSmallIsRefusedBeforeWriting) {
  const Folder folder;
  const UnfinishedFile file(folder.path("a"));
  file.write("content");
  const auto left = std::filesystem::space(folder.path("")).available;
  const std::string text = refusal([&] { file.reserve(static_cast<int64_t>(2 * left)); });
  EXPECT_NE(text.find("free space or choose another -output"), std::string::npos) << text;
  EXPECT_EQ(refusal([&] { file.reserve(1000); }), "accepted");
}

TEST(WholeOrAbsent, RowsThatAreNotTheSlabAreAnInternalError) {
  const Folder folder;
  const model::Model m = small_model();
  ResultFile file(MPI_COMM_SELF, folder.path("a"), m, model::all_rows(m));
  model::StepRows rows = small_rows(m, 0);
  rows.tension.pop_back();
  EXPECT_THROW(file.append(small_numbers(0), rows), base::InternalError);
}

}  // namespace whole_or_absent_test
}  // namespace repose::results
