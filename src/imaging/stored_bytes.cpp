#include "stored_bytes.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "meta_image.h"
#include "repose/base/error.h"
#include "repose/base/text.h"

namespace repose::imaging {
namespace {

constexpr int64_t nifti_header = 348;  // bytes
constexpr float farthest = 1e7f;       // mm, whose squares ITK can add up
// DICOM's transfer syntaxes whose pixels are not packed.
constexpr std::string_view implicit_little_endian = "1.2.840.10008.1.2",
                           explicit_little_endian = "1.2.840.10008.1.2.1",
                           explicit_big_endian = "1.2.840.10008.1.2.2";

/// A DICOM file's transfer syntax, the element (0002, 0010); empty where it is not found.
std::string transfer_syntax(const std::filesystem::path& file) {
  std::string begin(4096, '\0');
  std::ifstream(file, std::ios::binary)
      .read(begin.data(), static_cast<std::streamsize>(begin.size()));
  const std::string element("\2\0\x10\0UI", 6);
  const size_t at = begin.find(element);
  if (at == std::string::npos || at + 8 >= begin.size()) return "";
  const std::string syntax = begin.substr(at + 8, static_cast<unsigned char>(begin[at + 6]));
  return syntax.substr(0, syntax.find('\0'));
}

/// Returns whether a DICOM file compresses its pixels.
bool is_packed_dicom(const std::filesystem::path& file) {
  const std::string syntax = transfer_syntax(file);
  return !syntax.empty() && syntax != implicit_little_endian && syntax != explicit_little_endian &&
         syntax != explicit_big_endian;
}

/// The next data element in a DICOM file of little endian.
struct DicomElement {
  uint32_t tag = 0;
  int64_t header = 8, bytes = 0;
  bool odd = false;  ///< its kind is none, as some programs write it
};

DicomElement next_element(std::ifstream& in, bool implicit) {
  std::array<unsigned char, 12> h{};
  in.read(reinterpret_cast<char*>(h.data()), h.size());
  const auto word = [&](size_t at) { return static_cast<uint32_t>(h[at] | h[at + 1] << 8); };
  const auto number = [&](size_t at) { return word(at) | word(at + 2) << 16; };
  DicomElement element{word(0) << 16 | word(2), 8, number(4), false};
  const std::string kind(reinterpret_cast<const char*>(&h[4]), 2);
  const bool item = word(0) == 0xfffe;
  if (item || (implicit && word(0) != 2)) return element;
  const auto capital = [](char c) { return c >= 'A' && c <= 'Z'; };
  if (!capital(kind[0]) || !capital(kind[1])) {
    element.odd = kind == "??" || kind == "  " || kind == std::string(2, '\0');
  } else if (std::string_view("OB OW OF OD OL OV SQ UN UT UC UR SV UV").find(kind) !=
             std::string_view::npos) {
    element.header = 12;
    element.bytes = number(8);
  } else {
    element.bytes = word(6);
  }
  return element;
}

/// The header of a NIfTI file, in either order of bytes.
class NiftiHeader {
 public:
  /// Nothing where the file is no NIfTI of version 1.
  static std::optional<NiftiHeader> of(const std::filesystem::path& file) {
    NiftiHeader header;
    gzFile in = gzopen(file.c_str(), "rb");  // reads what is not packed as well
    const int read = in ? gzread(in, header.bytes_.data(), nifti_header) : 0;
    if (in) gzclose(in);
    // The library tells the order of bytes by the number of dimensions, 1 to 7.
    const auto few = [&](size_t low, size_t high) {
      return header.bytes_[high] == 0 && header.bytes_[low] >= 1 && header.bytes_[low] <= 7;
    };
    header.little_ = few(40, 41);
    if (read != nifti_header || !(header.little_ || few(41, 40))) return std::nullopt;
    return header;
  }

  bool has_rows() const { return bytes_[254] != 0 || bytes_[255] != 0; }  ///< of its orientation
  bool has_axes() const { return has_rows() || bytes_[252] != 0 || bytes_[253] != 0; }
  float number(size_t at) const { return std::bit_cast<float>(bits<uint32_t>(at)); }
  /// Bytes of a voxel in the file, which its library may rescale to wider numbers.
  int64_t voxel_bytes() const {
    switch (bits<uint16_t>(70)) {  // the type of its numbers
      case 4:
      case 512:
        return 2;
      case 8:
      case 16:
      case 768:
        return 4;
      case 64:
      case 1024:
      case 1280:
        return 8;
      default:
        return 1;  // at least
    }
  }
  /// Where voxels begin: behind the header and its extensions.
  int64_t offset() const {
    const float stated = std::min(std::max(0.0f, number(108)), 1e9f);
    return std::max(nifti_header, static_cast<int64_t>(stated));
  }

 private:
  template <class Bits>
  Bits bits(size_t at) const {
    Bits value = 0;
    for (size_t b = 0; b < sizeof(Bits); ++b)
      value = static_cast<Bits>(value << 8 | bytes_[at + (little_ ? sizeof(Bits) - 1 - b : b)]);
    return value;
  }

  std::array<unsigned char, nifti_header> bytes_{};
  bool little_ = false;
};

/// Bytes of a file's voxels: those there are, and those of its header; −1: unknown.
std::array<int64_t, 2> stored_bytes(const std::filesystem::path& file, ImageFormat format,
                                    const Image& header) {
  if (format == ImageFormat::nrrd) return {-1, -1};
  if (format == ImageFormat::dicom)
    return {is_packed_dicom(file) ? -1 : file_bytes(file), header.bytes};
  const auto nifti = NiftiHeader::of(file);
  const bool packed = base::lower(file.extension().string()) == ".gz";
  const int64_t all = packed ? unpacked_bytes(file, 0) : file_bytes(file);
  if (!nifti) return {all - nifti_header, header.bytes};
  int64_t bytes = header.numbers * nifti->voxel_bytes();
  for (const int64_t voxels : header.size) bytes *= voxels;
  return {std::max<int64_t>(0, all - nifti->offset()), bytes};
}

}  // namespace

int64_t unpacked_bytes(const std::filesystem::path& file, int64_t offset) {
  constexpr int any_header = 47;  // zlib's code for: zlib or gzip, found out
  std::ifstream in(file, std::ios::binary);
  in.seekg(offset);
  std::vector<char> packed(1 << 16), unpacked(1 << 18);
  z_stream stream{};
  if (inflateInit2(&stream, any_header) != Z_OK) throw base::InternalError("zlib does not start");
  int64_t total = 0;
  int status = Z_OK;
  while (status == Z_OK || status == Z_STREAM_END) {
    if (stream.avail_in == 0) {
      in.read(packed.data(), static_cast<std::streamsize>(packed.size()));
      stream.next_in = reinterpret_cast<Bytef*>(packed.data());
      stream.avail_in = static_cast<uInt>(in.gcount());
      if (stream.avail_in == 0) break;
    }
    if (status == Z_STREAM_END) inflateReset(&stream);
    stream.next_out = reinterpret_cast<Bytef*>(unpacked.data());
    stream.avail_out = static_cast<uInt>(unpacked.size());
    status = inflate(&stream, Z_NO_FLUSH);
    total += static_cast<int64_t>(unpacked.size() - stream.avail_out);
    if (status == Z_BUF_ERROR) status = Z_OK;
  }
  inflateEnd(&stream);
  return total;
}

int64_t file_bytes(const std::filesystem::path& file) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  return error ? 0 : static_cast<int64_t>(size);
}

void check_stored_bytes(const std::filesystem::path& file, ImageFormat format,
                        const Image& header) {
  if (format == ImageFormat::meta) return check_meta_voxels(file, header);
  const auto [stored, bytes] = stored_bytes(file, format, header);
  if (stored >= 0 && stored < bytes)
    base::refuse("{}: truncated: {} of the {} bytes of its voxels are there; copy it again",
                 file.string(), stored, bytes);
}

void check_dicom_lengths(const std::filesystem::path& file) {
  constexpr int64_t preamble = 132, sequence = 0xffffffff;
  constexpr uint32_t pixels = 0x7fe00010, item = 0xfffee000;
  std::ifstream in(file, std::ios::binary);
  std::string begin(preamble, ' ');
  in.read(begin.data(), preamble);
  if (!begin.ends_with("DICM")) return;
  const std::string syntax = transfer_syntax(file);
  const bool implicit = syntax == implicit_little_endian;
  const bool known = implicit || syntax == explicit_little_endian;
  const int64_t size = file_bytes(file);
  for (int64_t at = preamble; at + 8 <= size;) {
    in.clear();
    in.seekg(at);
    const DicomElement element = next_element(in, implicit);
    const bool description = element.tag >> 16 == 2;  // of the file, explicit in every syntax
    if (element.tag == pixels || element.odd || !(description || known)) return;
    at += element.header;
    if (element.tag == item || element.bytes == sequence) continue;  // goes on inside
    if (element.bytes > size - at)
      base::refuse(
          "{}: truncated or damaged: its element ({:04x},{:04x}) says it holds {} bytes, {} are "
          "left; copy it again",
          file.string(), element.tag >> 16, element.tag & 0xffff, element.bytes,
          std::max<int64_t>(0, size - at));
    at += element.bytes;
  }
}

void check_nifti_header(const std::filesystem::path& file) {
  const auto header = NiftiHeader::of(file);
  if (!header) return;
  for (size_t axis = 0; axis < 3; ++axis) {
    const float spacing = header->number(80 + 4 * axis);
    if (spacing == 0 || !std::isfinite(spacing))
      base::refuse("{}: its spacing along axis {} is {:g} mm; it must be > 0: mend the header",
                   file.string(), "ijk"[axis], spacing);
  }
  if (!header->has_axes())
    base::refuse(
        "{}: qform_code and sform_code are 0, so that it does not say which side is left; one of "
        "them must be > 0: export it with its orientation",
        file.string());
  for (size_t entry = 0; header->has_rows() && entry < 12; ++entry)
    if (const float mm = header->number(280 + 4 * entry); !(std::abs(mm) <= farthest))
      base::refuse(
          "{}: srow_{}[{}] of its orientation is {:g}, expected at most {:g} mm; mend the header",
          file.string(), "xyz"[entry / 4], entry % 4, mm, farthest);
}

void check_nrrd_space(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string line;
  if (!std::getline(in, line) || !line.starts_with("NRRD")) return;
  while (std::getline(in, line) && !line.empty() && line != "\r") {
    const std::string text = base::lower(line);
    if (!text.starts_with("space:")) continue;
    const size_t from = text.find_first_not_of(" \t", 6);
    const std::string space = from == std::string::npos ? "" : text.substr(from);
    if (space.starts_with("las") || space.starts_with("left-anterior-superior"))
      base::refuse(
          "{}: its space is left-anterior-superior, which its library turns by half a turn; export "
          "it in left-posterior-superior or right-anterior-superior",
          file.string());
  }
}

}  // namespace repose::imaging
