#include "results/step_views.h"

#include <gtest/gtest.h>

#include "files.h"

namespace repose::results {
namespace step_views_test {

/// Views of a file of springs, skin and one bone, with three steps.
StepViews three_steps() {
  StepViews views({.points = 8, .springs = 3, .skin = 2, .bone_points = 4, .bone_triangles = 2},
                  {{"mandible", 0, 4, 2}});
  for (const double load : {0.0, 0.5, 1.0}) views.add(load, load > 0);
  return views;
}

std::vector<std::string> names(const std::vector<XdmfBlock>& blocks) {
  std::vector<std::string> found;
  for (const XdmfBlock& block : blocks) found.push_back(block.name);
  return found;
}

/// [steps] where the skin has an array; empty where it has none of that name.
std::vector<bool> steps_with(const StepViews& views, const std::string& name) {
  for (const XdmfBlock& block : views.blocks())
    for (const XdmfArray& array : block.arrays)
      if (block.name == "skin" && array.name == name) return array.in_steps;
  return {};
}

TEST(StepViews, KnowWhichStepsHaveAnArray) {
  StepViews views = three_steps();
  views.note_field("contact_gap", false, 1);
  EXPECT_EQ(steps_with(views, "contact_gap"), (std::vector<bool>{false, true, false}));
  views.note_field("contact_gap", false, 3);
  views.add(1, true);
  EXPECT_EQ(steps_with(views, "contact_gap"), (std::vector<bool>{false, true, false, true}));
}

TEST(StepViews, AnArrayGoesWithTheLastStepThatHasIt) {
  StepViews views = three_steps();
  views.note_field("advance", false, 2);
  views.remove_last();
  EXPECT_EQ(views.loads(), (std::vector<double>{0, 0.5}));
  EXPECT_TRUE(steps_with(views, "advance").empty());
}

TEST(StepViews, OpenWithTheFirstBlockThatHasCellsAndTheBones) {
  EXPECT_EQ(names(three_steps().principal_blocks()),
            (std::vector<std::string>{"springs", "bones"}));
  EXPECT_TRUE(StepViews().principal_blocks().empty());
}

TEST(StepViews, DescribeWhatHasCellsAndRemoveTheRest) {
  const Folder folder;
  folder.write("a_tissue.xdmf", "of an earlier run");
  for (const auto& document : three_steps().describe(folder.path("a"))) document->commit();
  EXPECT_EQ(folder.content(), "a_blocks.xdmf a_bones.xdmf a_skin.xdmf a_springs.xdmf");
}

}  // namespace step_views_test
}  // namespace repose::results
