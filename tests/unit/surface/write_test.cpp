#include "repose/surface/write.h"

#include "repose/surface/read.h"
#include "shapes.h"

namespace repose::surface {
namespace write_test {

class Write : public SurfaceFiles {
 protected:
  std::string content(const std::string& name) const {
    std::ifstream in(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
};

Surface uneven_cube() {
  Surface s = cube();
  for (Vec3& p : s.points) p += Vec3(1.0 / 3, -2.0 / 7, 1e-3);
  return s;
}

TEST_F(Write, what_is_written_is_read_back) {
  const Surface s = uneven_cube();
  for (const char* name : {"a.ply", "a.OBJ", "a.stl"}) {
    write_surface(folder_ / name, s);
    const Surface back = read_surface(folder_ / name);
    ASSERT_EQ(back.triangles.size(), s.triangles.size()) << name;
    const double rounding = std::string(name) == "a.stl" ? 1e-5 : 0;
    for (size_t t = 0; t < s.triangles.size(); ++t)
      for (int k = 0; k < 3; ++k)
        EXPECT_LE((back.points[back.triangles[t][k]] - s.points[s.triangles[t][k]]).norm(),
                  rounding)
            << name;
    EXPECT_FALSE(std::filesystem::exists(folder_ / (std::string(name) + ".part")));
  }
}

TEST_F(Write, colors_and_fields_go_along) {
  const Surface s = uneven_cube();
  PointData data;
  data.fields.push_back({"distance", {}});
  for (size_t p = 0; p < s.points.size(); ++p) {
    data.colors.push_back({255, static_cast<uint8_t>(p), 0});
    data.fields[0].values.push_back(-1.5 * static_cast<double>(p));
  }
  write_surface(folder_ / "a.ply", s, data);
  EXPECT_NE(content("a.ply").find("property uchar blue\nproperty double distance\n"),
            std::string::npos);
  EXPECT_EQ(read_surface(folder_ / "a.ply").points, s.points);
  write_surface(folder_ / "a.obj", s, data);
  EXPECT_NE(content("a.obj").find(" 1.0000 0.0039 0.0000\n"), std::string::npos);
  write_surface(folder_ / "a.vtp", s, data);
  const std::string vtp = content("a.vtp");
  EXPECT_NE(vtp.find("<PointData Scalars=\"distance\">"), std::string::npos);
  EXPECT_NE(vtp.find("<DataArray type=\"UInt8\" Name=\"color\" NumberOfComponents=\"3\""),
            std::string::npos);
}

TEST_F(Write, another_ending_is_refused_before_anything_is_written) {
  for (const char* name : {"a.vtk", "a", "a.ply.gz"})
    EXPECT_NE(refusal([&] { write_surface(folder_ / name, cube()); }).find("write .ply, .stl"),
              std::string::npos);
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

}  // namespace write_test
}  // namespace repose::surface
