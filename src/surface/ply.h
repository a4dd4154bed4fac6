#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "soup.h"

/// The header of a PLY file, so that nothing reads what the file cannot hold.
namespace repose::surface {

struct PlyType {
  std::string name;  ///< char uchar short ushort int uint float double
  size_t bytes;
};

struct PlyProperty {
  std::string name;
  PlyType type;                      ///< of the value, or of a list's entries
  std::optional<PlyType> list_size;  ///< set for a list
};

struct PlyElement {
  std::string name;
  uint64_t count;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  std::string format;  ///< ascii, binary_little_endian or binary_big_endian
  std::vector<PlyElement> elements;
  size_t bytes;   ///< where the body begins
  int64_t lines;  ///< lines of the header
};

/// Parses the header and refuses, by line, what is malformed. Leaves out elements without
/// properties: their rows take no room in a file, however many it claims.
PlyHeader parse_ply_header(const Content& content);

/// Refuses a header whose elements cannot describe a surface (no coordinates, no faces, types that
/// the reader does not take) or do not fit into the file.
void check_ply(const PlyHeader& header, const Content& content);

/// The header again in plain form: LF line ends, format first, no comments, every element and
/// property but coordinates and vertex indices called "skipped" (the reader trusts the types of
/// names it knows); list sizes of a text file as ushort, which bounds what a list may claim.
std::string plain_ply_header(const PlyHeader& header);

}  // namespace repose::surface
