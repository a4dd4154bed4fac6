#include "repose/scene/transform_file.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "folder.h"
#include "repose/base/hdf5.h"

namespace repose::scene {
namespace transform_file_test {

const std::string head = "#Insight Transform File V1.0\n#Transform 0\n";

RigidMotion read(const std::string& text) {
  const Folder folder;
  return read_transform(folder.write("plan.tfm", text));
}

std::string refused(const std::string& text) {
  return refusal([&] { read(text); });
}

void expect_maps(const RigidMotion& motion, const Vec3& from, const Vec3& to) {
  EXPECT_LT((motion.apply(from) - to).norm(), 1e-12) << motion.apply(from).transpose();
}

// Stored: y = x + (1, 2, 3), from planned (fixed) to present (moving) place; the bone goes back.
TEST(TransformFile, MovesTheBoneByTheInverse) {
  const RigidMotion motion = read(head +
                                  "Transform: AffineTransform_double_3_3\n"
                                  "Parameters: 1 0 0 0 1 0 0 0 1 1 2 3\nFixedParameters: 0 0 0\n");
  expect_maps(motion, {1, 2, 3}, {0, 0, 0});
}

// A 90° turn about z through the center (10, 0, 0): row-major, y = A (x − c) + t + c.
TEST(TransformFile, AffineWithCenter) {
  const RigidMotion motion = read("\xEF\xBB\xBF" + head +
                                  "Transform: AffineTransform_double_3_3\r\n"
                                  "Parameters: 0 -1 0 1 0 0 0 0 1 0 0 5\r\n"
                                  "FixedParameters: 10 0 0\r\n");
  expect_maps(motion.inverse(), {11, 0, 0}, {10, 1, 5});
  expect_maps(motion, {10, 1, 5}, {11, 0, 0});
}

TEST(TransformFile, EulerTurnsInBothOrders) {
  const auto turn = [](const Vec3& axis, double angle) -> Mat3 {
    return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  };
  const Mat3 x = turn(Vec3::UnitX(), 0.1), y = turn(Vec3::UnitY(), -0.2),
             z = turn(Vec3::UnitZ(), 0.3);
  const Vec3 c(4, 5, 6), t(-1, 2, 0.5), p(7, -8, 9);
  const std::string text = head +
                           "Transform: Euler3DTransform_double_3_3\n"
                           "Parameters: 0.1 -0.2 0.3 -1 2 0.5\nFixedParameters: 4 5 6";
  expect_maps(read(text).inverse(), p, z * x * y * (p - c) + t + c);
  expect_maps(read(text + " 0\n").inverse(), p, z * x * y * (p - c) + t + c);
  expect_maps(read(text + " 1\n").inverse(), p, z * y * x * (p - c) + t + c);
}

TEST(TransformFile, Versor) {
  const Eigen::Quaterniond q(Eigen::AngleAxisd(0.7, Vec3(1, 2, -2).normalized()));
  const Vec3 c(4, 5, 6), t(-1, 2, 0.5), p(7, -8, 9);
  const RigidMotion motion =
      read(head + fmt::format("Transform: VersorRigid3DTransform_double_3_3\n"
                              "Parameters: {} {} {} -1 2 0.5\nFixedParameters: 4 5 6\n",
                              q.x(), q.y(), q.z()));
  expect_maps(motion.inverse(), p, q * (p - c) + t + c);
}

TEST(TransformFile, Translation) {
  expect_maps(read(head + "Transform: TranslationTransform_double_3_3\nParameters: 1 2 3\n"
                          "FixedParameters:\n"),
              {1, 2, 3}, {0, 0, 0});
}

/// Writes ITK's layout: a kind and numbers to each group.
struct Hdf5Part {
  std::string kind;
  std::vector<double> parameters, fixed;
};

void write_text(hid_t file, const std::string& path, const std::string& text) {
  const base::Hdf5Type type(H5Tcopy(H5T_C_S1));
  H5Tset_size(type, H5T_VARIABLE);
  const base::Hdf5Space space(H5Screate(H5S_SCALAR));
  const base::Hdf5Dataset data(
      H5Dcreate2(file, path.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  const char* pointer = text.c_str();
  H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, &pointer);
}

void write_numbers(hid_t file, const std::string& path, const std::vector<double>& numbers) {
  const hsize_t size = numbers.size();
  const base::Hdf5Space space(H5Screate_simple(1, &size, nullptr));
  const base::Hdf5Dataset data(
      H5Dcreate2(file, path.c_str(), H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data());
}

RigidMotion read_hdf5(const std::vector<Hdf5Part>& parts, const std::string& name = "Transform") {
  const Folder folder;
  const std::filesystem::path path = folder.path("plan.h5");
  {
    const base::Hdf5File file = base::create_hdf5(path);
    const base::Hdf5Group top = base::create_hdf5_group(file, "TransformGroup");
    for (size_t k = 0; k < parts.size(); ++k) {
      const std::string group = "/TransformGroup/" + std::to_string(k);
      const base::Hdf5Group made = base::create_hdf5_group(file, group.c_str());
      write_text(file, group + "/TransformType", parts[k].kind);
      if (parts[k].parameters.empty()) continue;
      write_numbers(file, group + "/" + name + "Parameters", parts[k].parameters);
      write_numbers(file, group + "/" + name + "FixedParameters", parts[k].fixed);
    }
  }
  return read_transform(path);
}

const Hdf5Part turn_and_shift{
    "AffineTransform_double_3_3", {0, -1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 5}, {10, 0, 0}};

TEST(TransformFile, Hdf5HoldsTheSame) {
  for (const char* name : {"Transform", "Tranform"}) {
    const RigidMotion motion = read_hdf5({turn_and_shift}, name);
    expect_maps(motion.inverse(), {11, 0, 0}, {10, 1, 5});
    expect_maps(motion, {10, 1, 5}, {11, 0, 0});
  }
}

// ITK applies the last of a composite first.
TEST(TransformFile, Hdf5CompositeInItksOrder) {
  const RigidMotion motion = read_hdf5({{"CompositeTransform_double_3_3", {}, {}},
                                        turn_and_shift,
                                        {"TranslationTransform_double_3_3", {1, 0, 0}, {0, 0, 0}}});
  expect_maps(motion.inverse(), {10, 0, 0}, {10, 1, 5});
}

TEST(TransformFile, Hdf5RefusesInOneLine) {
  const auto refused = [](const std::vector<Hdf5Part>& parts) {
    return refusal([&] { read_hdf5(parts); });
  };
  const auto holds = [](const std::string& text, const char* words) {
    EXPECT_NE(text.find(words), std::string::npos) << text;
  };
  holds(refused({}), "holds no ITK transform");
  holds(refused({turn_and_shift, turn_and_shift}), "more than one transform");
  holds(refused({{"BSplineTransform_double_3_3", {1}, {1}}}), "is not supported");
  holds(refused({{"AffineTransform_double_3_3", {}, {}}}), "holds no TransformParameters");
  holds(refused({{"AffineTransform_double_3_3", {1, 2}, {0, 0, 0}}}), "needs 12 numbers");
  holds(refused({{"CompositeTransform_double_3_3", {}, {}}}), "without parts");
  const Folder folder;
  holds(refusal([&] { read_transform(folder.write("cut.h5", "\x89HDF\r\n\x1a\nrest")); }),
        "cannot be read as an ITK transform in HDF5");
}

TEST(TransformFile, RefusesInOneLine) {
  const std::string affine = "Transform: AffineTransform_double_3_3\n";
  const std::string identity = "Parameters: 1 0 0 0 1 0 0 0 1 0 0 0\n";
  const std::string fixed = "FixedParameters: 0 0 0\n";
  const std::vector<std::pair<std::string, std::string>> cases{
      {"", "holds no transform"},
      {"hello\n", "plan.tfm:1: not an ITK text transform"},
      {std::string(2 << 20, 'x'), "too large"},
      {head, "holds no transform"},
      {head + affine, "holds no line 'Parameters:'"},
      {head + affine + "Parameters: 1 0 0\n" + fixed,
       "plan.tfm:4: an AffineTransform needs 12 numbers, it has 3"},
      {head + affine + "Parameters: 1 0 0 0 1 0 0 0 nan 0 0 0\n",
       "plan.tfm:4: 'nan' is not a finite number"},
      {head + affine + "Parameters: 2 0 0 0 2 0 0 0 2 0 0 0\n" + fixed,
       "plan.tfm:4: the matrix is not rigid"},
      {head + affine + "Parameters: -1 0 0 0 1 0 0 0 1 0 0 0\n" + fixed,
       "plan.tfm:4: the matrix is a reflection"},
      {head + affine + identity + "FixedParameters: 0 0\n",
       "plan.tfm:5: FixedParameters (the center) needs 3"},
      {head + "Transform: BSplineTransform_double_3_3\n" + identity,
       "plan.tfm:3: a transform 'BSplineTransform_double_3_3' is not"},
      {head + "Transform: AffineTransform_double_2_2\n" + identity, "plan.tfm:3: a transform"},
      {head + affine + identity + fixed + affine + identity,
       "plan.tfm:6: the file holds more than one transform"},
      {head + "Transform: VersorRigid3DTransform_double_3_3\nParameters: 1 1 0 0 0 0\n",
       "plan.tfm:4: the versor is longer than 1"},
      {head + affine + "Paramters: 1\n", "plan.tfm:4: expected Transform, Parameters"},
  };
  for (const auto& [text, expected] : cases)
    EXPECT_NE(refused(text).find(expected), std::string::npos)
        << refused(text) << "\nwanted " << expected;
  const Folder folder;
  EXPECT_NE(refusal([&] { read_transform(folder.path("sub")); }).find("sub: is a folder"),
            std::string::npos);
  EXPECT_NE(refusal([&] { read_transform(folder.path("none")); }).find("none: no such file"),
            std::string::npos);
}

}  // namespace transform_file_test
}  // namespace repose::scene
