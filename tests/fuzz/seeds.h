#pragma once
#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <vector>

#include "../unit/results/files.h"
#include "../unit/surface/formats.h"
#include "repose/base/hdf5.h"

/// Valid inputs of every kind that is read, small, for the mutations to begin with.
namespace repose::fuzz {

inline std::string content_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline void write(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary).write(bytes.data(), static_cast<long>(bytes.size()));
}

/// All files of the folder with shipped scenes that end so.
inline std::vector<std::string> shipped(const std::string& ending) {
  std::vector<std::string> found;
  std::set<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(REPOSE_MESHES))
    if (entry.path().filename().string().ends_with(ending)) files.insert(entry.path());
  for (const auto& file : files) found.push_back(content_of(file));
  return found;
}

inline surface::Surface tetrahedron() {
  return {"",
          {{0, 0, 0}, {30, 0, 0}, {0, 30, 0}, {0, 0, 30}},
          {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
}

/// A PLY file with a color and a number at its vertices.
inline std::string painted() {
  return "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\n"
         "property double z\nproperty uchar red\nproperty float depth\nelement face 1\n"
         "property list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n"
         "0 0 0 255 1.5\n30 0 0 0 2\n0 30 0 7 1e-3\n3 0 1 2 2 0.5 0.25\n";
}

inline const char* tfm = "#Insight Transform File V1.0\n#Transform 0\n";

inline std::vector<std::string> transforms() {
  return {std::string(tfm) +
              "Transform: AffineTransform_double_3_3\n"
              "Parameters: 0 -1 0 1 0 0 0 0 1 1 2 3\nFixedParameters: 10 0 0\n",
          std::string(tfm) +
              "Transform: Euler3DTransform_double_3_3\n"
              "Parameters: 0.1 -0.2 0.3 -1 2 0.5\nFixedParameters: 4 5 6 1\n",
          std::string(tfm) +
              "Transform: VersorRigid3DTransform_double_3_3\n"
              "Parameters: 0.1 0.2 0.3 1 2 3\nFixedParameters: 0 0 0\n"};
}

inline std::vector<std::string> tables_of_landmarks() {
  return {
      "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n"
      "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
      "1,1.5,2,3,0,0,0,1,1,1,0,chin,,\n2,4,-5,6e1,0,0,0,1,1,1,0,\"left, lip\",,\n",
      "# CoordinateSystem = RAS\nname,x,y,z\nchin,1,2,3\nlip,4,5,6\n"};
}

inline std::string numbers_of_a_volume() { return std::string(2 * 3 * 3 * 3, '\7'); }

inline std::vector<std::string> metas() {
  return {
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
      "TransformMatrix = 1 0 0 0 -1 0 0 0 1\nOffset = 0 2.5 0\nElementSpacing = 0.9 0.9 1.5\n"
      "DimSize = 3 3 3\nElementType = MET_SHORT\nElementDataFile = LOCAL\n" +
      numbers_of_a_volume()};
}

inline std::vector<std::string> nrrds() {
  return {
      "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 3 3 3\n"
      "space directions: (0.9,0,0) (0,0.9,0) (0,0,1.5)\nkinds: domain domain domain\n"
      "endian: little\nencoding: raw\nspace origin: (0,2.5,0)\n\n" +
      numbers_of_a_volume()};
}

inline std::vector<std::string> niftis() {
  std::string header(352, '\0');
  const auto put = [&](size_t at, const std::string& bytes) {
    header.replace(at, bytes.size(), bytes);
  };
  put(0, surface::bytes_of<int32_t>(348));
  for (const int axis : {0, 1, 2, 3}) put(40 + 2 * axis, surface::bytes_of<int16_t>(3));
  for (const int axis : {4, 5, 6, 7}) put(40 + 2 * axis, surface::bytes_of<int16_t>(1));
  put(70, surface::bytes_of<int16_t>(4) + surface::bytes_of<int16_t>(16));
  for (const int axis : {0, 1, 2, 3}) put(76 + 4 * axis, surface::bytes_of<float>(1));
  put(108, surface::bytes_of<float>(352));
  put(344, std::string("n+1\0", 4));
  std::string by_rows = header, by_turn = header;  // orientations: srow_x and so on, a quaternion
  by_rows.replace(254, 2, surface::bytes_of<int16_t>(1));
  for (const int axis : {0, 1, 2}) by_rows.replace(280 + 20 * axis, 4, surface::bytes_of<float>(1));
  by_turn.replace(252, 2, surface::bytes_of<int16_t>(1));
  return {header + numbers_of_a_volume(), by_rows + numbers_of_a_volume(),
          by_turn + numbers_of_a_volume()};
}

/// One data element of DICOM in explicit little endian.
inline std::string element(uint16_t group, uint16_t number, const std::string& kind,
                           std::string value) {
  using surface::bytes_of;
  if (value.size() % 2 == 1) value += kind == "UI" ? '\0' : ' ';
  const auto size = static_cast<uint16_t>(value.size());
  const std::string stored = kind == "OB" || kind == "OW"
                                 ? std::string(2, '\0') + bytes_of<uint32_t>(size)
                                 : bytes_of<uint16_t>(size);
  return bytes_of(group) + bytes_of(number) + kind + stored + value;
}

/// A CT slice of 3 × 3 pixels, one of a series along z.
inline std::string slice(int number) {
  using surface::bytes_of;
  const std::string ct = "1.2.840.10008.5.1.4.1.1.2", name = fmt::format("1.2.3.{}", number);
  const auto count = [](uint16_t value) { return bytes_of(value); };
  const std::string meta = element(2, 1, "OB", std::string("\0\1", 2)) + element(2, 2, "UI", ct) +
                           element(2, 3, "UI", name) +
                           element(2, 0x10, "UI", "1.2.840.10008.1.2.1");
  std::string file(128, '\0');
  file += "DICM";
  return file + element(2, 0, "UL", bytes_of<uint32_t>(static_cast<uint32_t>(meta.size()))) + meta +
         element(8, 0x16, "UI", ct) + element(8, 0x18, "UI", name) + element(8, 0x60, "CS", "CT") +
         element(8, 0x103e, "LO", "bone") + element(0x20, 0xd, "UI", "1.2") +
         element(0x20, 0xe, "UI", "1.2.3") + element(0x20, 0x13, "IS", std::to_string(number)) +
         element(0x20, 0x32, "DS", fmt::format("0\\2.5\\{}", 1.5 * number)) +
         element(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0") + element(0x28, 2, "US", count(1)) +
         element(0x28, 4, "CS", "MONOCHROME2") + element(0x28, 0x10, "US", count(3)) +
         element(0x28, 0x11, "US", count(3)) + element(0x28, 0x30, "DS", "0.9\\0.9") +
         element(0x28, 0x100, "US", count(16)) + element(0x28, 0x101, "US", count(16)) +
         element(0x28, 0x102, "US", count(15)) + element(0x28, 0x103, "US", count(1)) +
         element(0x28, 0x1052, "DS", "-1024") + element(0x28, 0x1053, "DS", "0.5") +
         element(0x7fe0, 0x10, "OW", std::string(18, '\7'));
}

inline void write_numbers(hid_t group, const char* name, const std::vector<double>& numbers) {
  const hsize_t size = numbers.size();
  const base::Hdf5Space space(H5Screate_simple(1, &size, nullptr));
  const base::Hdf5Dataset data(
      H5Dcreate2(group, name, H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data());
}

/// ITK's transform in HDF5: one, or a composite of two.
inline std::string hdf5_transform(const std::filesystem::path& file, int parts) {
  {
    const base::Hdf5File made = base::create_hdf5(file);
    const base::Hdf5Group top = base::create_hdf5_group(made, "TransformGroup");
    for (int k = parts > 1 ? 0 : 1; k <= parts; ++k) {
      const std::string group = fmt::format("/TransformGroup/{}", parts > 1 ? k : 0);
      const base::Hdf5Group entry = base::create_hdf5_group(made, group.c_str());
      const std::string kind =
          k == 0 ? "CompositeTransform_double_3_3" : "AffineTransform_double_3_3";
      const base::Hdf5Type type(H5Tcopy(H5T_C_S1));
      H5Tset_size(type, kind.size());
      const base::Hdf5Space one(H5Screate(H5S_SCALAR));
      const base::Hdf5Dataset text(
          H5Dcreate2(entry, "TransformType", type, one, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
      H5Dwrite(text, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, kind.data());
      write_numbers(entry, "TransformParameters", {0, -1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 5});
      write_numbers(entry, "TransformFixedParameters", {10, 0, 0});
    }
  }
  return content_of(file);
}

/// Requests to repose-live, one of every verb.
inline std::vector<std::string> requests() {
  return {R"({"id": 1, "do": "describe"})",
          R"({"id": "a", "do": "solve", "plan": {"mandible": {"translate": [0, -3.5, 1e-1], )"
          R"("rotate": [1, 0, 2]}, "chin": {}}, "accuracy": 0.05, "tangents": true, )"
          R"("base": "rest", "points": "all"})",
          R"({"do": "solve", "base": {"mandible": {"rotate": [0, 0, 1]}}, "points": "skin"})",
          R"({"id": null, "do": "write", "output": "plans/first"})",
          R"({"do": "quit"})",
          R"({"do": "change", "material": {"preset": "face"}, "boundary": {"rim": "free"}})"};
}

/// A model and a result; they are written with what writes them.
inline std::vector<std::string> models(const std::filesystem::path& folder) {
  results::write_small_result(folder / "seed", results::small_model());
  return {content_of(folder / "seed.h5")};
}

}  // namespace repose::fuzz
