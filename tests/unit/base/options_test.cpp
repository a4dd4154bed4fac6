#include "repose/base/options.h"

#include <gtest/gtest.h>
#include <petscsys.h>

#include "../../folder.h"
#include "repose/base/error.h"
#include "repose/base/petsc.h"

namespace repose::base {
namespace options_test {

std::vector<Option> table() {
  return {{.name = "accuracy",
           .kind = OptionKind::number,
           .default_text = "0.1",
           .help = "Stop within this.",
           .range = Range::above(0),
           .unit = "mm"},
          {.name = "level",
           .kind = OptionKind::number,
           .default_text = "",
           .help = "Isovalue.",
           .unit = "HU"},
          {.name = "load_steps",
           .kind = OptionKind::integer,
           .default_text = "auto",
           .help = "Steps.",
           .range = Range::between(1, 1000),
           .choices = {"auto"}},
          {.name = "functional",
           .kind = OptionKind::choice,
           .default_text = "energy",
           .help = "What is minimized.",
           .choices = {"energy", "force"}},
          {.name = "output",
           .kind = OptionKind::path,
           .default_text = "",
           .help = "Where to write.",
           .endings = {".h5"}},
          {.name = "landmarks",
           .kind = OptionKind::path,
           .default_text = "",
           .help = "Two lists.",
           .values = 2},
          {"dry_run", OptionKind::flag, "", "Build only."}};
}

struct Line {
  explicit Line(std::vector<std::string> typed,
                std::vector<Argument> arguments = {{"INPUT", "A scene."}})
      : tokens(std::move(typed)) {
    tokens.insert(tokens.begin(), "/some/where/repose-try");
    for (std::string& token : tokens) pointers.push_back(token.data());
    options = std::make_unique<Options>(static_cast<int>(pointers.size()), pointers.data(),
                                        "Tries options.", std::move(arguments), table());
  }
  Options* operator->() { return options.get(); }
  std::string refusal() {
    try {
      options->check();
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }

  std::vector<std::string> tokens;
  std::vector<char*> pointers;
  std::unique_ptr<Options> options;
};

TEST(Options, ReadsEveryKind) {
  Line line({"-accuracy", "0.5", "head.yaml", "-level", "-300", "-load_steps", "8", "-functional",
             "force", "-output", "out/head", "-landmarks", "a.json", "b.json", "-dry_run"});
  line->check();
  EXPECT_EQ(line->arguments(), std::vector<std::string>{"head.yaml"});
  EXPECT_EQ(line->number("accuracy"), 0.5);
  EXPECT_EQ(line->number("level"), -300);
  EXPECT_EQ(line->integer("load_steps"), 8);
  EXPECT_EQ(line->text("functional"), "force");
  EXPECT_EQ(line->text("output"), "out/head");
  EXPECT_EQ(line->texts("landmarks"), (std::vector<std::string>{"a.json", "b.json"}));
  EXPECT_TRUE(line->flag("dry_run"));
}

TEST(Options, FallsBackToDefaults) {
  Line line({"head.yaml"});
  line->check();
  EXPECT_FALSE(line->has("accuracy"));
  EXPECT_EQ(line->number("accuracy"), 0.1);
  EXPECT_EQ(line->text("load_steps"), "auto");
  EXPECT_EQ(line->text("output"), "");
  EXPECT_TRUE(line->texts("landmarks").empty());
  EXPECT_FALSE(line->flag("dry_run"));
  EXPECT_THROW(line->number("level"), InternalError);
  EXPECT_THROW(line->integer("load_steps"), InternalError);
  EXPECT_THROW(line->has("no_such"), InternalError);
}

TEST(Options, FlagTakesAWordOnlyIfItIsOne) {
  Line line({"-dry_run", "head.yaml"});
  line->check();
  EXPECT_TRUE(line->flag("dry_run"));
  Line off({"-dry_run", "false", "head.yaml"});
  off->check();
  EXPECT_TRUE(off->has("dry_run"));
  EXPECT_FALSE(off->flag("dry_run"));
}

TEST(Options, LastOneWinsAndTwoDashesDo) {
  Line line({"-accuracy", "1", "head.yaml", "--accuracy", "-.5", "-accuracy", "2"});
  line->check();
  EXPECT_EQ(line->number("accuracy"), 2);
}

TEST(Options, NamesBothValuesOfAnOptionGivenTwice) {
  const Line line({"head.yaml", "-accuracy", "1", "-accuracy", "2", "-dry_run", "-dry_run", "false",
                   "-tao_type", "lmvm", "-tao_type", "ntr", "-landmarks", "a", "b", "-landmarks",
                   "a", "c"});
  EXPECT_EQ(
      line.options->repeated(),
      (std::vector<std::string>{
          "option -accuracy is given several times: '2' is used, not '1'; give it once",
          "option -dry_run is given several times: 'false' is used, not 'true'; give it once",
          "option -tao_type is given several times: 'ntr' is used, not 'lmvm'; give it once",
          "option -landmarks is given several times: 'a c' is used, not 'a b'; give it once"}));
  const Line same({"head.yaml", "-accuracy", "1", "-accuracy", "1", "-dry_run", "-dry_run",
                   "-options_file", "a", "-options_file", "b"});
  EXPECT_TRUE(same.options->repeated().empty());
}

TEST(Options, LeavesOutTheEndingsOfAPath) {
  const auto output = [](const char* typed) {
    Line line({"head.yaml", "-output", typed});
    line->check();
    return line->text("output");
  };
  EXPECT_EQ(output("out/r.h5"), "out/r");
  EXPECT_EQ(output("r.H5"), "r");
  EXPECT_EQ(output("r.h5.h5"), "r.h5");
  EXPECT_EQ(output("r.v2"), "r.v2");
}

TEST(Options, PassesPetscsOwnOn) {
  Line line({"head.yaml", "-tao_type", "nls", "-accuracy", "1", "-ksp_shift", "-3", "-log_view",
             "-mat_mumps_icntl_14", "40"});
  line->check();
  const std::vector<std::string> passed(line->petsc_argv() + 1,
                                        line->petsc_argv() + line->petsc_argc());
  EXPECT_EQ(passed, (std::vector<std::string>{"-tao_type", "nls", "-ksp_shift", "-3", "-log_view",
                                              "-mat_mumps_icntl_14", "40"}));
  EXPECT_EQ(line->petsc_argv()[line->petsc_argc()], nullptr);
}

TEST(Options, PassesFilesOfOptionsBeforeWhatTheCommandLineGives) {
  const auto passed = [](const std::vector<std::string>& typed) {
    Line line(typed);
    return std::vector<std::string>(line->petsc_argv() + 1,
                                    line->petsc_argv() + line->petsc_argc());
  };
  EXPECT_EQ(passed({"head.yaml", "-tao_type", "ntr", "-options_file", "a", "-log_view",
                    "-options_file", "b"}),
            (std::vector<std::string>{"-options_file", "a", "-options_file", "b", "-tao_type",
                                      "ntr", "-log_view"}));
  const std::vector<std::string> prefixed{"-prefix_push",  "mg_", "-ksp_type",  "cg",
                                          "-options_file", "a",   "-prefix_pop"};
  EXPECT_EQ(passed(prefixed), prefixed);
}

TEST(Options, PathBehindAViewerOptionIsAnArgument) {
  Line path({"-log_view", "head.yaml"});
  path->check();
  EXPECT_EQ(path->arguments(), std::vector<std::string>{"head.yaml"});
  EXPECT_EQ(path->petsc_argc(), 2);
  Line viewer({"-log_view", "ascii:log.txt", "head.yaml"});
  viewer->check();
  EXPECT_EQ(viewer->petsc_argc(), 3);
}

TEST(Options, HelpIsOursUnlessPetscsIsAskedFor) {
  Line ours({"-help"});
  EXPECT_TRUE(ours->help_requested());
  EXPECT_EQ(ours->petsc_argc(), 1);
  Line petscs({"head.yaml", "-help", "petsc"});
  EXPECT_FALSE(petscs->help_requested());
  EXPECT_STREQ(petscs->petsc_argv()[1], "-help");
  EXPECT_EQ(petscs->petsc_argc(), 2);
  EXPECT_TRUE(Line({"-version"})->version_requested());
  Line intro({"-help", "intro"});
  EXPECT_EQ(intro->petsc_argc(), 3);
}

TEST(Options, HelpShowsTheTable) {
  Line line({"-help"});
  const std::string help = line->help();
  for (const char* part :
       {"repose-try INPUT", "Tries options.", "-accuracy mm", "[> 0; default 0.1]", "-level HU",
        "-load_steps N|auto", "[1 … 1000; default auto]", "-functional energy|force",
        "-landmarks FILE FILE", "Build only.", "-help petsc"})
    EXPECT_NE(help.find(part), std::string::npos) << part << "\n" << help;
}

struct Bad {
  std::vector<std::string> typed;
  std::string expected;
};

TEST(Options, ReadsListsOfNumbers) {
  Line line({"head.yaml", "-output", "2,,4"});
  line->check();
  EXPECT_EQ(line->words("output"), (std::vector<std::string>{"2", "4"}));
  EXPECT_EQ(line->integers("output", Range::between(2, 4)), (std::vector<int>{2, 4}));
  for (const char* bad : {"2,x", "5", "2.5"}) {
    Line refused({"head.yaml", "-output", bad});
    refused->check();
    EXPECT_THROW(refused->integers("output", Range::between(2, 4)), InputError) << bad;
  }
}

TEST(Options, RefusesInOneLine) {
  const std::vector<Bad> cases{
      {{"a", "-acuracy", "1"},
       "repose-try: unknown option '-acuracy'; the nearest known one is -accuracy"},
      {{"a", "-hlep"}, "nearest known one is -help"},
      {{"a", "-accuracy"}, "-accuracy needs 1 value: a number of mm, > 0"},
      {{"a", "-accuracy", "-output", "b"}, "-accuracy needs 1 value"},
      {{"a", "-accuracy", "0"}, "-accuracy '0' must be a number of mm, > 0"},
      {{"a", "-accuracy", "-2"}, "-accuracy '-2' must be"},
      {{"a", "-accuracy", "nan"}, "-accuracy 'nan' must be"},
      {{"a", "-accuracy", "-inf"}, "-accuracy '-inf' must be"},
      {{"a", "-accuracy", "1mm"}, "-accuracy '1mm' must be"},
      {{"a", "-load_steps", "0"}, "-load_steps '0' must be a whole number, 1 … 1000, or auto"},
      {{"a", "-load_steps", "2.5"}, "-load_steps '2.5' must be"},
      {{"a", "-functional", "enrgy"}, "must be one of energy, force; did you mean energy?"},
      {{"a", "-output", ""}, "-output '' must be a path"},
      {{"a", "-landmarks", "one.json"}, "-landmarks needs 2 values"},
      {{}, "INPUT is missing: A scene."},
      {{"-log_view", "a"}, "INPUT is missing: A scene.; 'a' was taken as the value of -log_view"},
      {{"a", "b\nc"}, "unexpected argument 'b?c'; it takes 1"},
  };
  for (const Bad& bad : cases) {
    const std::string message = Line(bad.typed).refusal();
    EXPECT_NE(message.find(bad.expected), std::string::npos)
        << message << "\nwanted " << bad.expected;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

/// PETSc with a database as an -options_file would leave it; one life of PETSc for the whole test.
TEST(Options, ReadsPetscsDatabase) {
  const test::Folder folder;
  const auto file = folder.write(
      "options.txt", "-accuracy 0.25\n-load_steps 7\n-dry_run\n-ksp_rtol 1e-3\n-functionl force\n");
  Line line({"head.yaml", "-load_steps", "9", "-pc_typo", "x", "-options_file", file.string()});
  const Session session(line->petsc_argc(), line->petsc_argv());
  EXPECT_NE(
      line.refusal().find("unknown option '-functionl'; the nearest known one is -functional"),
      std::string::npos)
      << line.refusal();
  ASSERT_EQ(PetscOptionsClearValue(nullptr, "-functionl"), 0);

  Line again({"head.yaml", "-load_steps", "9", "-pc_typo", "x"});
  again->check();
  EXPECT_EQ(again->number("accuracy"), 0.25);
  EXPECT_EQ(again->texts("load_steps"), std::vector<std::string>{"9"}) << "the command line wins";
  EXPECT_TRUE(again->flag("dry_run"));
  EXPECT_EQ(again->unused(), std::vector<std::string>{"-pc_typo"});
  setenv("PETSC_OPTIONS", "-of_another_program 3 -tao_misspelled 1", 1);
  ASSERT_EQ(PetscOptionsSetValue(nullptr, "-of_another_program", "3"), 0);
  ASSERT_EQ(PetscOptionsSetValue(nullptr, "-tao_misspelled", "1"), 0);
  Line shared({"head.yaml"});
  shared->check();
  EXPECT_EQ(shared->unused(), (std::vector<std::string>{"-of_another_program of PETSC_OPTIONS",
                                                        "-tao_misspelled of PETSC_OPTIONS"}));
  unsetenv("PETSC_OPTIONS");
  ASSERT_EQ(PetscOptionsClearValue(nullptr, "-of_another_program"), 0);
  ASSERT_EQ(PetscOptionsClearValue(nullptr, "-tao_misspelled"), 0);
  ASSERT_EQ(PetscOptionsSetValue(nullptr, "-accuracy", "-1"), 0);
  EXPECT_NE(Line({"head.yaml"}).refusal().find("-accuracy '-1' must be"), std::string::npos);
  ASSERT_EQ(PetscOptionsClear(nullptr), 0);
}

}  // namespace options_test
}  // namespace repose::base
