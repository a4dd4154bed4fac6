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
  return {header + numbers_of_a_volume()};
}

/// A model and a result; they are written with what writes them.
inline std::vector<std::string> models(const std::filesystem::path& folder) {
  results::write_small_result(folder / "seed", results::small_model());
  return {content_of(folder / "seed.h5")};
}

}  // namespace repose::fuzz
