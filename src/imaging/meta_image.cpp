#include "meta_image.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <regex>
#include <string>
#include <vector>

#include "repose/base/error.h"
#include "repose/base/text.h"
#include "stored_bytes.h"

namespace repose::imaging {
namespace {

/// Location of the voxels stated by a MetaImage header.
struct MetaHeader {
  std::string data;  ///< LOCAL, LIST, a file's name, or a format of names with first, last and step
  bool compressed = false;
  int64_t skipped = 0;  ///< bytes at the begin of a data file
  int64_t bytes = 0;    ///< of the header, up to what follows it
};

/// Returns the text behind a key. ITK takes ':' for '=', and several of them for one.
std::string value_behind(const std::string& text) {
  return base::trimmed(text.substr(std::min(text.find_first_not_of(" \t:="), text.size())));
}

MetaHeader meta_header(const std::filesystem::path& file) {
  MetaHeader header;
  std::ifstream in(file, std::ios::binary);
  for (std::string line; std::getline(in, line);) {
    const size_t separator = line.find_first_of("=:");
    if (separator == std::string::npos) continue;
    const std::string key = base::trimmed(line.substr(0, separator));
    const std::string value = value_behind(line.substr(separator));
    if (key == "CompressedData") header.compressed = base::lower(value) == "true";
    if (key == "HeaderSize") header.skipped = base::parse_integer(value).value_or(0);
    if (key != "ElementDataFile") continue;
    header.data = value;
    break;
  }
  header.bytes = in.tellg();
  return header;
}

/// Refuses a file that is too short to hold `bytes` of voxels from `offset` on.
void check_length(const std::filesystem::path& file, const MetaHeader& header,
                  const std::filesystem::path& data, int64_t offset, int64_t bytes) {
  const int64_t stored =
      header.compressed ? unpacked_bytes(data, offset) : file_bytes(data) - offset;
  if (stored < bytes)
    base::refuse("{}: truncated: {} of the {} bytes of its voxels are in {}; copy it again",
                 file.string(), stored, bytes, data.string());
}

/// Voxels of one file: the whole volume's or a slice's.
void check_data(const std::filesystem::path& file, const MetaHeader& header,
                const std::string& name, int64_t bytes) {
  const auto data = file.parent_path() / name;
  if (file_bytes(data) == 0)
    base::refuse("{}: its voxels should be in {}, which is missing or empty; copy that file, too",
                 file.string(), data.string());
  check_length(file, header, data, std::max<int64_t>(0, header.skipped), bytes);
}

void check_count(const std::filesystem::path& file, int64_t named, int64_t count) {
  if (named != count)
    base::refuse("{}: its ElementDataFile names {} files, its DimSize {}; mend the header",
                 file.string(),
                 named > count ? fmt::format("more than {}", count) : fmt::to_string(named), count);
}

/// Names of files, a line each, behind the header; ITK leaves out a last line that has no end.
void check_list(const std::filesystem::path& file, const MetaHeader& header, const Image& image) {
  const auto words = base::words(header.data);
  const auto dimensions = std::ssize(image.size);
  int64_t of_file = words.size() > 1 ? base::parse_integer(words[1]).value_or(0) : 0;
  if (of_file <= 0 || of_file >= dimensions) of_file = dimensions - 1;
  int64_t count = 1;
  for (int64_t axis = of_file; axis < dimensions; ++axis) count *= image.size[axis];
  std::vector<std::string> names;
  std::ifstream in(file, std::ios::binary);
  in.seekg(header.bytes);
  for (std::string line; std::ssize(names) <= count && std::getline(in, line);)
    if (const std::string name = base::trimmed(line); !in.eof() && !name.empty())
      names.push_back(name);
  check_count(file, std::ssize(names), count);
  for (const std::string& name : names) check_data(file, header, name, image.bytes / count);
}

/// A name with one number, as sprintf writes it.
std::string formatted(const std::string& format, int64_t number) {
  const size_t at = format.find('%'), end = format.find('d', at);
  const std::string width = format.substr(at + 1, end - at - 1);
  std::string digits = fmt::to_string(number);
  const auto length = static_cast<size_t>(base::parse_integer(width).value_or(0));
  if (digits.size() < length)
    digits.insert(0, length - digits.size(), width.starts_with('0') ? '0' : ' ');
  return format.substr(0, at) + digits + format.substr(end + 1);
}

/// A format of names, then the first number, the last and the step. Only a name with blanks needs
/// all three.
void check_format(const std::filesystem::path& file, const MetaHeader& header, const Image& image) {
  constexpr int64_t maximum = std::numeric_limits<int32_t>::max();
  const int64_t count = image.size.back();
  auto words = base::words(header.data);
  std::string format(words.front());
  for (words.erase(words.begin()); words.size() > 3; words.erase(words.begin()))
    format.append(" ").append(words.front());
  std::vector<int64_t> numbers;
  for (const std::string_view word : words)
    numbers.push_back(std::clamp<int64_t>(base::parse_integer(word).value_or(-1), -1, maximum));
  const int64_t first = numbers.empty() ? 1 : numbers[0];
  const int64_t last = numbers.size() > 1 ? numbers[1] : first + count - 1;
  const int64_t step = numbers.size() > 2   ? numbers[2]
                       : numbers.size() > 1 ? (last - first) / count
                                            : 1;
  if (first < 0 || last < first || step < 1 || format.find('%') == std::string::npos)
    base::refuse(
        "{}: its ElementDataFile is {}; expected a name such as s%03d.raw, the first number, the "
        "last and the step; mend the header",
        file.string(), base::quote(header.data));
  check_count(file, (last - first) / step + 1, count);
  for (int64_t i = 0; i < count; ++i)
    check_data(file, header, formatted(format, first + i * step), image.bytes / count);
}

/// The values of a key anywhere in a header, for ITK reads on behind a data file's name.
std::vector<std::string> meta_values(const std::string& header, std::string_view key) {
  std::vector<std::string> values;
  for (size_t at = header.find(key); at != std::string::npos; at = header.find(key, at + 1)) {
    const std::string text = header.substr(at + key.size(), 1000);
    const std::string line = text.substr(0, text.find('\n'));
    values.push_back(line.substr(std::min(line.find_first_not_of(" \t:="), line.size())));
  }
  return values;
}

void check_dimensions(const std::filesystem::path& file, const std::string& value) {
  constexpr int64_t maximum = 10;
  const auto words = base::words(value);
  const auto number = words.size() == 1 ? base::parse_integer(words[0]) : std::nullopt;
  if (!number || *number < 1 || *number > maximum)
    base::refuse("{}: its NDims is {}, not 1 to {}; mend the header", file.string(),
                 base::quote(value), maximum);
}

void check_size(const std::filesystem::path& file, const std::string& value) {
  for (const std::string_view word : base::words(value))
    if (const auto number = base::parse_number(word); number && !(*number >= 1))
      base::refuse("{}: its DimSize is {}; each number must be ≥ 1; mend the header", file.string(),
                   base::quote(base::trimmed(value)));
}

/// ITK formats the name with sprintf, into a buffer of fixed size, for each of several files.
void check_data_file(const std::filesystem::path& file, const std::string& value) {
  static const std::regex one_number("[^%]{0,200}%[0-9]{0,2}d[^%]{0,200}");
  if (value.find('%') != std::string::npos && !std::regex_match(value, one_number))
    base::refuse(
        "{}: its ElementDataFile is {}; a name may hold one number such as %03d and no other %; "
        "rename the data file or mend the header",
        file.string(), base::quote(value));
}

}  // namespace

void check_meta_header(const std::filesystem::path& file) {
  std::string begin(size_t{1} << 16, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<size_t>(in.gcount()));
  for (const std::string& value : meta_values(begin, "NDims")) check_dimensions(file, value);
  for (const std::string& value : meta_values(begin, "DimSize")) check_size(file, value);
  for (const std::string& value : meta_values(begin, "ElementDataFile"))
    check_data_file(file, value);
}

void check_meta_voxels(const std::filesystem::path& file, const Image& header) {
  const MetaHeader meta = meta_header(file);
  if (std::ranges::any_of(header.size, [](int64_t size) { return size < 1; }))
    base::refuse("{}: its DimSize holds no size ≥ 1 of each axis; mend the header", file.string());
  if (meta.data.empty())
    base::refuse("{}: its ElementDataFile names no file; mend the header", file.string());
  if (meta.data == "LOCAL" || meta.data == "Local" || meta.data == "local")
    return check_length(file, meta, file, meta.skipped > 0 ? meta.skipped : meta.bytes,
                        header.bytes);
  if (meta.data.starts_with("LIST")) return check_list(file, meta, header);
  if (meta.data.find('%') != std::string::npos) return check_format(file, meta, header);
  check_data(file, meta, meta.data, header.bytes);
}

}  // namespace repose::imaging
