#include "image.h"

#include <itkGDCMImageIO.h>
#include <itkMetaDataObject.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csetjmp>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <functional>
#include <new>

#include "repose/base/error.h"
#include "repose/base/text.h"

/// ITK's readers of one format each, without its pipeline.
namespace repose::imaging {
namespace {

/// Drops what ITK's libraries write to the terminal. Where one aborts, as Debian's GDCM
/// does at many a damaged file, for it is built with its assertions, control comes back.
class AbortGuard {
 public:
  AbortGuard() {
    itk::Object::GlobalWarningDisplayOff();
    std::fflush(stderr);
    terminal_ = dup(STDERR_FILENO);
    const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
    dup2(nowhere, STDERR_FILENO);
    close(nowhere);
    struct sigaction action {};
    action.sa_handler = [](int) { siglongjmp(place_, 1); };
    sigaction(SIGABRT, &action, &usual_);
  }
  ~AbortGuard() {
    sigaction(SIGABRT, &usual_, nullptr);
    dup2(terminal_, STDERR_FILENO);
    close(terminal_);
  }

  /// Returns whether `work` completed. Memory that it held when it did not is lost.
  bool survives(const std::function<void()>& work) {
    if (sigsetjmp(place_, 1) != 0) return false;
    work();
    return true;
  }

 private:
  static inline sigjmp_buf place_;
  int terminal_;
  struct sigaction usual_ {};
};

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& reason) {
  base::refuse("{}: cannot be read as a volume, truncated or damaged: {}; export it again",
               file.string(), reason);
}

itk::ImageIOBase::Pointer reader_of(ImageFormat format) {
  switch (format) {
    case ImageFormat::nifti:
      return itk::NiftiImageIO::New().GetPointer();
    case ImageFormat::nrrd:
      return itk::NrrdImageIO::New().GetPointer();
    case ImageFormat::meta:
      return itk::MetaImageIO::New().GetPointer();
    case ImageFormat::dicom:
      break;
  }
  return itk::GDCMImageIO::New().GetPointer();
}

std::string tag(const itk::ImageIOBase& io, const std::string& name) {
  std::string text;
  itk::ExposeMetaData<std::string>(io.GetMetaDataDictionary(), name, text);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\0')) text.pop_back();
  return text;
}

/// A library's message without its line breaks and the object it comes from.
std::string one_line(std::string text) {
  const auto end = text.find_last_not_of(" \n\r\t.");
  text.resize(end == std::string::npos ? 0 : end + 1);
  if (const auto object = text.find("): "); object < 60) text.erase(0, object + 3);
  for (char& c : text)
    if (static_cast<unsigned char>(c) < ' ') c = ' ';
  return text;
}

/// Does `work` with an image reader whose header has been read.
Image with_reader(const std::filesystem::path& file, ImageFormat format,
                  const std::function<Image(itk::ImageIOBase&)>& work) {
  AbortGuard guard;
  Image image;
  const bool survived = guard.survives([&] {
    try {
      const auto io = reader_of(format);
      io->SetFileName(file.string());
      io->ReadImageInformation();
      image = work(*io);
    } catch (const itk::ExceptionObject& problem) {
      refuse(file, one_line(problem.GetDescription()));
    }
  });
  if (!survived) refuse(file, "its library gives up");
  return image;
}

/// The library of DICOM puts 1 in the place of a spacing that is 0 or lacking, so it is read here:
/// "rows\\columns" of a single slice.
double spacing_of(const itk::ImageIOBase& io, unsigned axis) {
  const bool slice = io.GetNumberOfDimensions() < 3 || io.GetDimensions(2) == 1;
  if (!dynamic_cast<const itk::GDCMImageIO*>(&io) || !slice || axis > 1) return io.GetSpacing(axis);
  const std::string text = tag(io, "0028|0030");
  const auto bar = std::min(text.find('\\'), text.size());
  const auto part = axis == 1 ? text.substr(0, bar) : text.substr(std::min(bar + 1, text.size()));
  return base::parse_number(part).value_or(0);
}

/// DICOM's values may be more after rescaling than they are in the file.
int64_t bytes_of(const itk::ImageIOBase& io) {
  const auto bits = base::parse_integer(tag(io, "0028|0100"));
  return static_cast<int64_t>(bits ? io.GetImageSizeInPixels() * *bits / 8
                                   : io.GetImageSizeInBytes());
}

Image header_of(const itk::ImageIOBase& io) {
  Image image;
  for (unsigned axis = 0; axis < io.GetNumberOfDimensions(); ++axis)
    image.size.push_back(static_cast<int64_t>(io.GetDimensions(axis)));
  image.numbers = io.GetNumberOfComponents();
  for (unsigned axis = 0; axis < 3; ++axis) {
    const bool there = axis < io.GetNumberOfDimensions();
    image.spacing[axis] = there ? spacing_of(io, axis) : 1;
    image.origin[axis] = there ? io.GetOrigin(axis) : 0;
    for (unsigned row = 0; there && row < std::min(3u, io.GetNumberOfDimensions()); ++row)
      image.direction[axis][row] = io.GetDirection(axis)[row];
  }
  image.bytes = bytes_of(io);
  image.series = tag(io, "0020|000e");
  image.title = tag(io, "0008|103e");
  return image;
}

template <class Number>
std::vector<float> to_float(const std::vector<char>& bytes) {
  const auto* numbers = reinterpret_cast<const Number*>(bytes.data());
  return {numbers, numbers + bytes.size() / sizeof(Number)};
}

std::vector<float> to_float(const std::vector<char>& bytes, const itk::ImageIOBase& io) {
  using Type = itk::IOComponentEnum;
  switch (io.GetComponentType()) {
    case Type::UCHAR:
      return to_float<unsigned char>(bytes);
    case Type::CHAR:
      return to_float<signed char>(bytes);
    case Type::USHORT:
      return to_float<unsigned short>(bytes);
    case Type::SHORT:
      return to_float<short>(bytes);
    case Type::UINT:
      return to_float<unsigned int>(bytes);
    case Type::INT:
      return to_float<int>(bytes);
    case Type::ULONG:
      return to_float<unsigned long>(bytes);
    case Type::LONG:
      return to_float<long>(bytes);
    case Type::FLOAT:
      return to_float<float>(bytes);
    case Type::DOUBLE:
      return to_float<double>(bytes);
    default:
      base::refuse("{}: holds numbers of a type that is not read; convert them to short or float",
                   io.GetFileName());
  }
}

std::vector<float> values_of(itk::ImageIOBase& io) {
  const unsigned dimensions = io.GetNumberOfDimensions();
  itk::ImageIORegion region(dimensions);
  for (unsigned axis = 0; axis < dimensions; ++axis) region.SetSize(axis, io.GetDimensions(axis));
  io.SetIORegion(region);
  const auto size = static_cast<size_t>(io.GetImageSizeInBytes());
  try {
    std::vector<char> bytes(size);
    io.Read(bytes.data());
    return to_float(bytes, io);
  } catch (const std::bad_alloc&) {
    base::refuse("{}: its header promises {} MiB, more than this machine's memory; is it damaged?",
                 io.GetFileName(), size >> 20);
  }
}

}  // namespace

bool is_dicom(const std::filesystem::path& file) {
  std::array<char, 132> begin{};
  std::ifstream(file, std::ios::binary).read(begin.data(), begin.size());
  const bool marked = std::string_view(begin.data() + 128, 4) == "DICM";
  AbortGuard guard;
  bool answer = false;
  const bool survived =
      guard.survives([&] { answer = itk::GDCMImageIO::New()->CanReadFile(file.string().c_str()); });
  if (!survived) refuse(file, "its library gives up");
  if (marked && !answer) refuse(file, "it begins as DICOM, but what follows is not DICOM");
  return answer;
}

Image read_header(const std::filesystem::path& file, ImageFormat format) {
  return with_reader(file, format, [](const itk::ImageIOBase& io) { return header_of(io); });
}

Image read_image(const std::filesystem::path& file, ImageFormat format) {
  return with_reader(file, format, [](itk::ImageIOBase& io) {
    Image image = header_of(io);
    image.values = values_of(io);
    return image;
  });
}

}  // namespace repose::imaging
