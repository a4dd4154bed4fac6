#include <fstream>
#include <sstream>

#include "files.h"
#include "repose/results/merged_bones.h"
#include "repose/results/model_file.h"

namespace repose::results {
namespace round_trip_test {

void expect_same_points(const model::Points& a, const model::Points& b) {
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.set, b.set);
  EXPECT_EQ(a.target, b.target);
  EXPECT_EQ(a.layer, b.layer);
  EXPECT_EQ(a.column, b.column);
  EXPECT_EQ(a.bone, b.bone);
  EXPECT_EQ(a.mass, b.mass);
  EXPECT_EQ(a.external_force, b.external_force);
}

void expect_same_springs(const model::Springs& a, const model::Springs& b) {
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.set, b.set);
  EXPECT_EQ(a.rest_length, b.rest_length);
  EXPECT_EQ(a.stiffness, b.stiffness);
  EXPECT_EQ(a.exponent, b.exponent);
  EXPECT_EQ(a.reference, b.reference);
}

TEST(RoundTrip, ModelComesBackBitForBit) {
  const Folder folder;
  const model::Model m = small_model();
  write_small_result(folder.path("a"), m);
  const model::Model back = read_model(folder.path("a.h5"));
  expect_same_points(back.points, m.points);
  expect_same_springs(back.springs, m.springs);
  EXPECT_EQ(back.gravity, m.gravity);
  EXPECT_EQ(back.prisms.points, m.prisms.points);
  EXPECT_EQ(back.prisms.rest_volume, m.prisms.rest_volume);
  EXPECT_EQ(back.skin, m.skin);
  EXPECT_EQ(back.spring_sets, m.spring_sets);
  EXPECT_EQ(back.bones, m.bones);
  EXPECT_EQ(back.bone_transform, m.bone_transform);
  ASSERT_EQ(back.bone_surfaces.size(), 2u);
  EXPECT_EQ(back.bone_surfaces[1].points, m.bone_surfaces[1].points);
  EXPECT_EQ(back.bone_surfaces[1].triangles, m.bone_surfaces[1].triangles);
}

TEST(RoundTrip, StepComesBackBitForBit) {
  const Folder folder;
  const model::Model m = small_model();
  write_small_result(folder.path("a"), m);
  ASSERT_EQ(step_count(folder.path("a.h5")), 2);
  const StoredStep step = read_step(folder.path("a.h5"), 1, m);
  const model::StepRows rows = small_rows(m, 1);
  EXPECT_EQ(step.rows.position, rows.position);
  EXPECT_EQ(step.rows.residual_force, rows.residual_force);
  EXPECT_EQ(step.rows.volume_ratio, rows.volume_ratio);
  EXPECT_EQ(step.rows.elongation, rows.elongation);
  EXPECT_EQ(step.rows.tension, rows.tension);
  for (size_t i = 0; i < rows.position.size(); ++i)
    EXPECT_EQ(step.displacement[i], Vec3(rows.position[i] - m.points.position[i]));
  std::ostringstream stored, given;
  const auto print_to = [](std::ostringstream& out) {
    return [&out](const char* name, const auto& value) {
      out << name << '=';
      if constexpr (std::is_enum_v<std::decay_t<decltype(value)>>)
        out << word(value) << '\n';
      else
        out << value << '\n';
    };
  };
  model::for_each_number(step.numbers, print_to(stored));
  const model::StepNumbers expected = small_numbers(1);
  model::for_each_number(expected, print_to(given));
  EXPECT_EQ(stored.str(), given.str());
}

TEST(RoundTrip, BonesAreStoredWhereTheyAreAtTheLoad) {
  const Folder folder;
  const model::Model m = small_model();
  write_small_result(folder.path("a"), m);
  EXPECT_TRUE(read_step(folder.path("a.h5"), 0, m).bone_points.empty()) << "load 0: not moved";
  const std::vector<Vec3> moved = read_step(folder.path("a.h5"), 1, m).bone_points;
  ASSERT_EQ(moved.size(), 6u);
  EXPECT_EQ(moved[0], m.bone_surfaces[0].points[0]);
  EXPECT_LT((moved[3] - m.bone_surfaces[1].points[0] - Vec3(0, 0, 2)).norm(), 1e-14);
  for (const Vec3& still : read_step(folder.path("a.h5"), 0, m).bone_displacement)
    EXPECT_EQ(still, Vec3(0, 0, 0));
  const std::vector<Vec3> motion = read_step(folder.path("a.h5"), 1, m).bone_displacement;
  ASSERT_EQ(motion.size(), 6u);
  EXPECT_EQ(motion[0], Vec3(0, 0, 0));
  EXPECT_EQ(motion[3], Vec3(moved[3] - m.bone_surfaces[1].points[0]));
}

TEST(RoundTrip, ModelWithoutAnythingOptional) {
  const Folder folder;
  model::Model m = small_model();
  m.skin.clear();
  m.prisms = {};
  m.bone_surfaces.clear();
  m.bone_transform.clear();
  write_small_result(folder.path("a"), m);
  const model::Model back = read_model(folder.path("a.h5"));
  EXPECT_TRUE(back.skin.empty());
  EXPECT_TRUE(back.prisms.points.empty());
  EXPECT_TRUE(back.bone_surfaces.empty());
  EXPECT_TRUE(back.bone_transform.empty());
  EXPECT_EQ(folder.content(), "a.h5 a_springs.xdmf") << "no document without a cell";
}

TEST(RoundTrip, AModelHasNoStep) {
  const Folder folder;
  ResultFile(MPI_COMM_SELF, folder.path("a"), small_model(), model::all_rows(small_model()))
      .commit();
  EXPECT_EQ(step_count(folder.path("a.h5")), 0);
}

TEST(RoundTrip, IsHdf5BySignature) {
  const Folder folder;
  write_small_result(folder.path("a"), small_model());
  std::ofstream(folder.path("scene.yaml")) << "skin: face.ply\n";
  std::ofstream(folder.path("block.h5"), std::ios::binary)
      << std::string(512, ' ') << std::ifstream(folder.path("a.h5"), std::ios::binary).rdbuf();
  EXPECT_TRUE(base::is_hdf5(folder.path("a.h5")));
  EXPECT_TRUE(base::is_hdf5(folder.path("block.h5"))) << "after a user block";
  EXPECT_FALSE(base::is_hdf5(folder.path("scene.yaml")));
  EXPECT_FALSE(base::is_hdf5(folder.path("none.h5")));
}

}  // namespace round_trip_test
}  // namespace repose::results
