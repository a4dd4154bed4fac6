#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

/// Reader of PLY files: the header, checked against the size of the file, and every value of the
/// body.
namespace repose::surface {

/// The bytes of one file.
struct Content {
  std::filesystem::path file;  ///< for messages
  std::string bytes;
};

/// Reads the whole of a regular file. Throws InputError when it is missing, unreadable or empty.
Content read_content(const std::filesystem::path& file);

struct PlyType {
  std::string name;  ///< char uchar short ushort int uint float double
  size_t bytes;
  double (*decode)(const char* bytes);  ///< from the bytes of one little-endian value

  bool is_real() const { return name == "float" || name == "double"; }
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

  bool is_vertex() const { return name == "vertex" || name == "vertices"; }
  bool is_face() const { return name == "face" || name == "faces"; }
};

struct PlyHeader {
  std::string format;  ///< ascii, binary_little_endian or binary_big_endian
  std::vector<PlyElement> elements;
  size_t bytes;   ///< where the body begins
  int64_t lines;  ///< lines of the header
};

/// Parses the header. Throws InputError naming the line where it is malformed. Leaves out elements
/// without properties: their rows take no room in a file, however many it claims.
PlyHeader parse_ply_header(const Content& content);

/// Throws InputError where the elements cannot describe a surface: no coordinates, no faces, or
/// types that coordinates and vertex indices cannot have.
void check_ply(const PlyHeader& header, const Content& content);

/// Reads every value of a PLY file's body as a double, element by element; lists included.
class PlyValues {
 public:
  PlyValues(const Content& content, const PlyHeader& header);

  /// Values of one row: for each property one number, or the entries of a list.
  using Row = std::vector<std::vector<double>>;
  /// Reads the next element whole. Throws InputError naming the row, and in a text the line, where
  /// the file ends or holds no number. Takes no memory for rows that the file does not hold.
  void read(const PlyElement& element,
            const std::function<void(uint64_t row, const Row&)>& receive);

 private:
  double text_value(const PlyType& type);
  double binary_value(const PlyType& type);
  double value(const PlyType& type) { return text_ ? text_value(type) : binary_value(type); }
  [[noreturn]] void fail() const;

  const Content& content_;
  size_t position_;
  bool text_, big_endian_;
  std::string place_;
};

/// Row of the vertex-index list among the face's properties; the number of properties if it has
/// none.
size_t index_list(const PlyElement& face);

}  // namespace repose::surface
