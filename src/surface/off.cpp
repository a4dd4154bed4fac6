#include <bit>

#include "repose/base/error.h"
#include "repose/base/text.h"
#include "soup.h"

/// OFF, text and binary. Not read by CGAL, whose reader (5.5) allocates what a header claims, reads
/// beyond a face's colors and cannot step over those of a binary file.
namespace repose::surface {
namespace {

[[noreturn]] void fail(const Content& content, int64_t line, const std::string& reason) {
  base::refuse("{}:{}: {}; export the mesh again as OFF", content.file.string(), line, reason);
}

/// The lines of a text file that say something, comments removed.
class Lines {
 public:
  explicit Lines(const Content& content) : content_(content) {}

  std::vector<std::string_view> next() {
    while (position_ < content_.bytes.size()) {
      ++number_;
      const auto line = base::next_line(content_.bytes, position_);
      auto found = base::words(line.substr(0, line.find('#')));
      if (!found.empty()) return found;
    }
    fail(content_, number_, "the file ends too early");
  }

  double number(std::string_view word) const {
    const auto value = base::parse_number(word);
    if (!value) fail(content_, number_, base::quote(word) + " is not a finite number");
    return *value;
  }

  int64_t integer(std::string_view word) const {
    const auto value = base::parse_integer(word);
    if (!value) fail(content_, number_, base::quote(word) + " is not a whole number");
    return *value;
  }

  int64_t line() const { return number_; }
  size_t position() const { return position_; }

 private:
  const Content& content_;
  size_t position_ = 0;
  int64_t number_ = 0;
};

struct Counts {
  int64_t points, faces;
};

/// Refuses a header that promises more than the file can hold, with at least so many bytes each.
void check_counts(const Content& content, int64_t line, const Counts& promised,
                  const Counts& bytes_each) {
  const auto room = std::ssize(content.bytes);
  const auto [points, faces] = promised;
  if (points < 0 || faces < 0 || points > room / bytes_each.points ||
      faces > room / bytes_each.faces)
    fail(content, line,
         fmt::format("the header promises {} vertices and {} faces, which the file ({} bytes) "
                     "cannot hold: it is truncated or damaged",
                     points, faces, room));
}

Soup parse_text(const Content& content, Lines& lines, std::vector<std::string_view> counts) {
  if (counts.empty()) counts = lines.next();
  if (counts.size() < 2) fail(content, lines.line(), "numbers of vertices and faces expected");
  const auto points = lines.integer(counts[0]);
  const auto faces = lines.integer(counts[1]);
  check_counts(content, lines.line(), {points, faces}, {6, 2});
  Soup soup;
  for (int64_t i = 0; i < points; ++i) {
    const auto line = lines.next();
    if (line.size() < 3) fail(content, lines.line(), "three coordinates expected");
    soup.points.emplace_back(lines.number(line[0]), lines.number(line[1]), lines.number(line[2]));
  }
  for (int64_t i = 0; i < faces; ++i) {
    const auto line = lines.next();
    const auto corners = lines.integer(line[0]);
    if (corners < 0 || corners >= std::ssize(line))
      fail(content, lines.line(), fmt::format("a face of {} vertex numbers expected", corners));
    auto& polygon = soup.polygons.emplace_back();
    for (int64_t k = 1; k <= corners; ++k) polygon.push_back(lines.integer(line[k]));
  }
  return soup;
}

/// Big-endian 32-bit words one after the other.
class Binary {
 public:
  Binary(const Content& content, size_t position) : content_(content), position_(position) {}

  template <class Value>
  Value next() {
    if (content_.bytes.size() - position_ < 4)
      base::refuse(
          "{}: truncated or damaged: the file ends within its data ({} bytes); export it "
          "again",
          content_.file.string(), content_.bytes.size());
    uint32_t word = 0;
    for (int i = 0; i < 4; ++i)
      word = word << 8 | static_cast<unsigned char>(content_.bytes[position_++]);
    return std::bit_cast<Value>(word);
  }

 private:
  const Content& content_;
  size_t position_;
};

Soup parse_binary(const Content& content, const Lines& lines) {
  Binary data(content, lines.position());
  const int64_t points = data.next<int32_t>();
  const int64_t faces = data.next<int32_t>();
  data.next<int32_t>();  // the number of edges, which nobody uses
  check_counts(content, lines.line(), {points, faces}, {12, 8});
  Soup soup;
  for (int64_t i = 0; i < points; ++i) {
    const double x = data.next<float>(), y = data.next<float>(), z = data.next<float>();
    soup.points.emplace_back(x, y, z);
  }
  for (int64_t i = 0; i < faces; ++i) {
    auto& polygon = soup.polygons.emplace_back();
    const int32_t corners = data.next<int32_t>();
    for (int32_t k = 0; k < corners; ++k) polygon.push_back(data.next<int32_t>());
    const int32_t colors = data.next<int32_t>();
    for (int32_t k = 0; k < colors; ++k) data.next<int32_t>();
  }
  return soup;
}

}  // namespace

Soup parse_off(Content content) {
  Lines lines(content);
  auto first = lines.next();
  const std::string keyword(first[0]);
  first.erase(first.begin());
  if (keyword.find_first_of("4n") != keyword.npos)
    fail(content, lines.line(),
         base::quote(keyword) + " has points of another dimension than three");
  if (first.empty() || first[0] != "BINARY") return parse_text(content, lines, std::move(first));
  if (keyword != "OFF")
    fail(content, lines.line(), "binary " + base::quote(keyword) + " is not read, only binary OFF");
  return parse_binary(content, lines);
}

}  // namespace repose::surface
