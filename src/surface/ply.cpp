#include "ply.h"

#include <algorithm>
#include <array>

#include "repose/base/error.h"
#include "repose/base/text.h"

namespace repose::surface {
namespace {

struct TypeName {
  const char *name, *alias;
  size_t bytes;
};
constexpr std::array<TypeName, 8> known_types = {{{"char", "int8", 1},
                                                  {"uchar", "uint8", 1},
                                                  {"short", "int16", 2},
                                                  {"ushort", "uint16", 2},
                                                  {"int", "int32", 4},
                                                  {"uint", "uint32", 4},
                                                  {"float", "float32", 4},
                                                  {"double", "float64", 8}}};

/// Reads the lines of one header.
class HeaderParser {
 public:
  explicit HeaderParser(const Content& content) : content_(content) {}

  PlyHeader parse() {
    size_t position = 0;
    while (position < content_.bytes.size()) {
      const auto line = base::words(base::next_line(content_.bytes, position));
      ++header_.lines;
      if (!line.empty() && line[0] == "end_header") {
        header_.bytes = position;
        std::erase_if(header_.elements, [](const PlyElement& e) { return e.properties.empty(); });
        return header_;
      }
      if (!line.empty()) parse(line);
    }
    fail("the header has no end_header: the file is truncated");
  }

 private:
  void parse(const std::vector<std::string_view>& line) {
    const auto keyword = line[0];
    if (keyword == "ply" || keyword == "comment" || keyword == "obj_info") return;
    if (keyword == "format" && line.size() >= 2)
      header_.format = line[1];
    else if (keyword == "element" && line.size() == 3)
      header_.elements.push_back({std::string(line[1]), count(line[2]), {}});
    else if (keyword == "property" && line.size() == 3)
      add({std::string(line[2]), type(line[1]), {}});
    else if (keyword == "property" && line.size() == 5 && line[1] == "list")
      add({std::string(line[4]), type(line[3]), type(line[2])});
    else
      fail(base::shown(keyword) + " does not begin a line of a PLY header");
  }

  void add(PlyProperty property) {
    if (header_.elements.empty()) fail("a property before any element");
    header_.elements.back().properties.push_back(std::move(property));
  }

  uint64_t count(std::string_view word) const {
    const auto value = base::parse_integer(word);
    if (!value || *value < 0) fail(base::shown(word) + " is not a number of rows");
    return static_cast<uint64_t>(*value);
  }

  PlyType type(std::string_view word) const {
    for (const auto& known : known_types)
      if (word == known.name || word == known.alias) return {known.name, known.bytes};
    fail(fmt::format("unknown type {} (char, uchar, short, ushort, int, uint, float, double)",
                     base::shown(word)));
  }

  [[noreturn]] void fail(const std::string& reason) const {
    base::refuse("{}:{}: {}; export the mesh anew as PLY", content_.file.string(), header_.lines,
                 reason);
  }

  const Content& content_;
  PlyHeader header_{"", {}, 0, 0};
};

const PlyElement* find_element(const PlyHeader& header, const char* name, const char* other) {
  const auto found =
      std::find_if(header.elements.begin(), header.elements.end(),
                   [&](const PlyElement& e) { return e.name == name || e.name == other; });
  return found == header.elements.end() ? nullptr : &*found;
}

bool is_index_list(const PlyProperty& property) {
  return property.name == "vertex_indices" || property.name == "vertex_index";
}

const char* plain_name(const PlyProperty& property) {
  for (const char* axis : {"x", "y", "z"})
    if (property.name == axis) return axis;
  return is_index_list(property) ? "vertex_indices" : "skipped";
}

void check_coordinates(const PlyElement& vertex, const std::string& file) {
  for (const char* axis : {"x", "y", "z"}) {
    const auto& all = vertex.properties;
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const PlyProperty& p) { return p.name == axis; });
    if (found == all.end())
      base::refuse("{}: its vertices have no property {}; export the mesh with x, y and z", file,
                   axis);
    if (found->list_size || (found->type.name != "float" && found->type.name != "double"))
      base::refuse("{}: property {} is {}; export coordinates as float or double", file, axis,
                   found->list_size ? "a list" : found->type.name);
  }
}

void check_indices(const PlyElement& face, const std::string& file) {
  for (const auto& property : face.properties) {
    if (!is_index_list(property)) continue;
    if (!property.list_size) base::refuse("{}: property {} is not a list", file, property.name);
    const auto& size = property.list_size->name;
    if (size == "float" || size == "double" || property.type.bytes != 4 ||
        property.type.name == "float")
      base::refuse("{}: property {} is a list {} {}; export vertex indices as list uchar int", file,
                   property.name, size, property.type.name);
    return;
  }
  base::refuse("{}: its faces have no property vertex_indices; export the mesh as polygons", file);
}

/// Walks a binary body row by row to its end, reading list sizes only.
class BodyWalk {
 public:
  BodyWalk(const Content& content, const PlyHeader& header)
      : content_(content),
        position_(header.bytes),
        big_endian_(header.format == "binary_big_endian") {}

  void step_over(const PlyElement& element) {
    for (uint64_t row = 0; row < element.count; ++row)
      for (const auto& property : element.properties) {
        const uint64_t entries = property.list_size ? list_size(*property.list_size) : 1;
        if (entries > remaining() / property.type.bytes)
          base::refuse(
              "{}: truncated or damaged: {} {} of {} lies beyond the end of the file ({} "
              "bytes); export it anew",
              content_.file.string(), base::shown(element.name), row, element.count,
              content_.bytes.size());
        position_ += entries * property.type.bytes;
      }
  }

 private:
  size_t remaining() const { return content_.bytes.size() - position_; }

  /// The size that a list states; a negative one or one cut off becomes too large to fit.
  uint64_t list_size(const PlyType& type) {
    if (remaining() < type.bytes) return UINT64_MAX;
    uint64_t value = 0;
    for (size_t i = 0; i < type.bytes; ++i) {
      const size_t byte = big_endian_ ? i : type.bytes - 1 - i;
      value = value << 8 | static_cast<unsigned char>(content_.bytes[position_ + byte]);
    }
    position_ += type.bytes;
    return value;
  }

  const Content& content_;
  size_t position_;
  bool big_endian_;
};

/// Every value of a text body takes a character and a blank.
void check_text_size(const PlyHeader& header, const Content& content) {
  uint64_t room = (content.bytes.size() - header.bytes + 1) / 2;
  for (const auto& element : header.elements) {
    const uint64_t values = element.properties.size();
    if (element.count > room / values)
      base::refuse(
          "{}: truncated or damaged: the header promises {} rows of element {}, more than "
          "the file can hold ({} bytes); export it anew",
          content.file.string(), element.count, base::shown(element.name), content.bytes.size());
    room -= element.count * values;
  }
}

}  // namespace

PlyHeader parse_ply_header(const Content& content) { return HeaderParser(content).parse(); }

void check_ply(const PlyHeader& header, const Content& content) {
  const std::string file = content.file.string();
  const bool text = header.format == "ascii";
  if (!text && header.format != "binary_little_endian" && header.format != "binary_big_endian")
    base::refuse("{}: format {} is none of ascii, binary_little_endian, binary_big_endian", file,
                 base::shown(header.format));
  const PlyElement* vertex = find_element(header, "vertex", "vertices");
  const PlyElement* face = find_element(header, "face", "faces");
  if (!vertex || vertex->count == 0)
    base::refuse("{}: holds no vertices; export the mesh anew", file);
  if (!face || face->count == 0)
    base::refuse("{}: holds no faces (a point cloud?); export a triangle mesh", file);
  check_coordinates(*vertex, file);
  check_indices(*face, file);
  if (text) return check_text_size(header, content);
  BodyWalk walk(content, header);
  for (const auto& element : header.elements) walk.step_over(element);
}

std::string plain_ply_header(const PlyHeader& header) {
  const bool text = header.format == "ascii";
  const PlyElement* vertex = find_element(header, "vertex", "vertices");
  const PlyElement* face = find_element(header, "face", "faces");
  std::string plain = fmt::format("ply\nformat {} 1.0\n", header.format);
  for (const auto& element : header.elements) {
    const char* name = &element == vertex ? "vertex" : &element == face ? "face" : "skipped";
    plain += fmt::format("element {} {}\n", name, element.count);
    for (const auto& property : element.properties) {
      plain += "property ";
      if (property.list_size)
        plain += fmt::format("list {} ", text ? "ushort" : property.list_size->name);
      plain += fmt::format("{} {}\n", property.type.name, plain_name(property));
    }
  }
  return plain + "end_header\n";
}

}  // namespace repose::surface
