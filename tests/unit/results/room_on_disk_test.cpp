#include "files.h"
#include "results/model_write.h"
#include "results/step_writer.h"

namespace repose::results {
namespace room_on_disk_test {

/// A result file that grows.
class GrowingFile {
 public:
  GrowingFile() {
    part_.create([](hid_t file) { base::create_hdf5_group(file, "step"); });
  }
  SharedPart& part() { return part_; }
  /// Expects `bytes` to be what `work` adds to the file, and at most a quarter more.
  void expect_enough(int64_t bytes, const std::function<void()>& work) {
    const int64_t before = size();
    part_.open();
    work();
    part_.close();
    const int64_t grown = size() - before;
    EXPECT_GE(bytes, grown);
    EXPECT_LT(bytes, grown + grown / 4);
  }

 private:
  int64_t size() const {
    return static_cast<int64_t>(std::filesystem::file_size(folder_.path(folder_.content())));
  }
  Folder folder_;
  SharedPart part_{MPI_COMM_SELF, folder_.path("a.h5")};
};

TEST(RoomOnDisk, IsEnoughForTheFieldsOfTheFirstStep) {
  const model::Model m = test::layered_patch({.columns_x = 40, .columns_y = 30, .layers = 3});
  const auto points = static_cast<int64_t>(m.points.position.size());
  StepViews views({.points = points,
                   .springs = static_cast<int64_t>(m.springs.points.size()),
                   .prisms = static_cast<int64_t>(m.prisms.points.size()),
                   .skin = 1},
                  {});
  model::StepRows rows = small_rows(m, 1);
  for (int k = 0; k < 100; ++k)
    rows.point_fields.push_back({"tangent_" + std::to_string(k),
                                 true,
                                 std::vector<double>(3 * points),
                                 {{"unit", "mm"}, {"piece", "a piece with a long name"}},
                                 {{"converged", true}}});
  GrowingFile file;
  StepWriter writer(file.part(), views, model::all_rows(m), {}, {});
  file.expect_enough(writer.bytes(rows), [&] { writer.write(small_numbers(1), rows); });
}

TEST(RoomOnDisk, IsEnoughForInstrumentsThatAreMeshes) {
  model::Model m = small_model();
  surface::Surface mesh;
  mesh.points.assign(10000, Vec3::Zero());
  mesh.triangles.assign(20000, {0, 1, 2});
  m.contact.bodies = {{"retractor", -1, mesh}};
  m.contact.pairs = {{0}, {0}, {model::Binding::touches}, {1.0}};
  const model::ModelRows slabs = model::all_rows(m);
  GrowingFile file;
  file.expect_enough(model_bytes(m, slabs, {}),
                     [&] { write_model(file.part().id(), m, slabs, {}); });
}

}  // namespace room_on_disk_test
}  // namespace repose::results
