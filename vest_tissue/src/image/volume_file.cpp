#include "volume_file.h"

#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <zlib.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <limits>
#include <map>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <vector>

#include <Eigen/Core>

#include "passing.h"
#include "vest_instruments/files/read.h"

namespace vest::image {
namespace {

namespace fs = std::filesystem;

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

enum class Format { Other, Nrrd, Meta, Nifti };

Format formatOf(const std::string& path) {
  const std::string name = lower(fs::path(path).filename().string());
  const auto ends = [&](const std::string& with) {
    return name.size() > with.size() && name.compare(name.size() - with.size(), with.size(), with) == 0;
  };
  if (ends(".nrrd") || ends(".nhdr")) return Format::Nrrd;
  if (ends(".mha") || ends(".mhd")) return Format::Meta;
  if (ends(".nii") || ends(".nii.gz")) return Format::Nifti;
  return Format::Other;
}

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r"), last = text.find_last_not_of(" \t\r");
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

using Fields = std::map<std::string, std::string>;

/// What lies in a file from a place on, unpacked.
struct Content {
  std::string head;       ///< up to 348 bytes
  std::size_t bytes = 0;  ///< of text: numbers
};

enum class Stored { Plain, Packed, Text, Hex };

/// Counts what ITK takes for whole where it is cut: all of it, checksums of gzip and zlib included; of text,
/// its numbers. @param most bytes that are wanted: of packed data, no more are unpacked @throws
/// std::runtime_error: data that are damaged, or values that are refused
Content contentOf(const std::string& path, std::size_t from, Stored stored, Passing passing,
                  std::size_t most = SIZE_MAX) {
  Content content;
  const auto add = [&](const char* data, std::size_t count) {
    content.head.append(data, std::min(count, 348 - content.head.size()));
    content.bytes += count;
    passing.take(data, count);
  };
  std::ifstream file(path, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(from));
  std::vector<char> in(1 << 16), out(1 << 18);
  int half = -1;  // of a byte in base 16
  if (stored == Stored::Text) {
    double value = 0;
    for (std::string word; file >> std::setw(400) >> word; ++content.bytes)
      if (!files::parseNumber(word, value))
        throw std::runtime_error("is damaged: '" + files::shown(word, 40) + "' among its values");
      else if (std::abs(value) > 1e30)
        refuseBeyond();
    return content;
  }
  if (stored == Stored::Plain) {
    const std::size_t size = fs::file_size(path), bytes = size > from ? size - from : 0;
    // One that is too short is refused by its size.
    const std::size_t looked = passing.wanted() && passing.bytes() <= bytes ? passing.bytes() : 348;
    while (content.bytes < looked && file) {
      file.read(in.data(), static_cast<std::streamsize>(std::min(in.size(), looked - content.bytes)));
      add(in.data(), static_cast<std::size_t>(file.gcount()));
    }
    content.bytes = bytes;
    return content;
  }
  if (stored == Stored::Hex) {
    while (file) {
      file.read(in.data(), static_cast<std::streamsize>(in.size()));
      std::size_t bytes = 0;
      for (std::streamsize i = 0; i < file.gcount(); ++i) {
        const auto c = static_cast<unsigned char>(in[static_cast<std::size_t>(i)]);
        if (std::isspace(c) != 0) continue;
        if (std::isxdigit(c) == 0)
          throw std::runtime_error("is damaged: '" +
                                   files::shown(std::string(1, in[static_cast<std::size_t>(i)]), 40) +
                                   "' among its values");
        const int digit = std::isdigit(c) != 0 ? c - '0' : std::tolower(c) - 'a' + 10;
        if (half < 0)
          half = digit;
        else
          out[bytes++] = static_cast<char>(16 * half + digit), half = -1;
      }
      add(out.data(), bytes);
    }
    return content;
  }
  z_stream zip{};
  if (inflateInit2(&zip, 15 + 32) != Z_OK) throw std::bad_alloc();  // + 32: gzip or zlib
  int state = Z_OK;
  while (state == Z_OK && content.bytes < most) {
    if (zip.avail_in == 0) {
      file.read(in.data(), static_cast<std::streamsize>(in.size()));
      zip.next_in = reinterpret_cast<Bytef*>(in.data());
      zip.avail_in = static_cast<uInt>(file.gcount());
      if (zip.avail_in == 0) break;
    }
    zip.next_out = reinterpret_cast<Bytef*>(out.data()), zip.avail_out = static_cast<uInt>(out.size());
    state = inflate(&zip, Z_NO_FLUSH);
    add(out.data(), out.size() - zip.avail_out);
  }
  inflateEnd(&zip);
  if (state != Z_STREAM_END && content.bytes < most)
    throw std::runtime_error("is damaged: packed data are cut or changed");
  return content;
}

/// Text that NRRD and MetaImage begin with: "key: value" or "key = value", keys in lower case.
struct Text {
  Fields fields;
  std::size_t end = 0;  ///< where data begin
};

Text textOf(const std::string& path, Format format) {
  std::ifstream file(path, std::ios::binary);
  std::string text(100'000, 0);
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (format == Format::Nrrd && text.rfind("NRRD", 0) != 0) throw std::runtime_error("is no NRRD file");
  Text found;
  for (std::size_t at = 0, end = 0; at < text.size(); at = end + 1) {
    end = std::min(text.find('\n', at), text.size());
    const std::string line = trimmed(text.substr(at, end - at));
    found.end = end + 1;
    if (format == Format::Nrrd && line.empty()) return found;
    const auto sign = line.find(format == Format::Nrrd ? ':' : '=');
    if (sign == std::string::npos) continue;
    const std::string key = lower(trimmed(line.substr(0, sign)));
    found.fields[key] = trimmed(line.substr(sign + 1));
    if (format == Format::Meta && key == "elementdatafile") return found;
  }
  if (format == Format::Meta) throw std::runtime_error("is no MetaImage: it has no ElementDataFile");
  return found;  // a header without data
}

/// What ITK does not ask: all of it is there for `read` to judge.
struct Account {
  bool placed = true;     ///< the file says how the patient lies in it
  std::size_t bytes = 0;  ///< of values, unpacked
  std::size_t width = 0;  ///< bytes of a stored value, 1 for text; 0: as ITK gives them
};

/// Bytes of values behind a text, or in a file of their own: one, beside the header.
std::size_t dataOf(const std::string& path, std::size_t end, const std::string& name, Stored stored,
                   const Passing& passing) {
  if (lower(name) == "local") return contentOf(path, end, stored, passing).bytes;
  if (name.empty() || name.find_first_of("/%") != std::string::npos || lower(name).rfind("list", 0) == 0)
    throw std::runtime_error("data file: must be one file in the folder of the header, by its name");
  const fs::path data = fs::path(path).parent_path() / name;
  std::error_code error;
  if (fs::is_symlink(data, error))
    throw std::runtime_error("data file: " + name + " is a link: must be a file");
  if (!fs::is_regular_file(data, error)) throw std::runtime_error("data file: " + name + " is not there");
  if (fs::equivalent(data, path, error))
    throw std::runtime_error("data file: " + name + ": must be another file than the header");
  return contentOf(data.string(), 0, stored, passing).bytes;
}

/// ITK takes a number that it cannot read, or that is missing, for 0 or 1.
void refuseNumbers(const Fields& fields, const std::string& key, std::size_t count) {
  const auto found = fields.find(key);
  if (found == fields.end()) return;
  std::string text = found->second;
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '(' || c == ')' || c == ','; }, ' ');
  std::istringstream words(text);
  std::size_t numbers = 0;
  for (std::string word; words >> word;) {
    double value = 0;
    if (word == "none") continue;  // of an axis that is none of space
    if (!files::parseNumber(word, value) || !(std::abs(value) <= 1e6))
      throw std::runtime_error(key + ": " + files::shown(word, 40) + ": must be a number within 1e6");
    ++numbers;
  }
  if (numbers != count)
    throw std::runtime_error(key + ": " + std::to_string(numbers) + " numbers: must be " +
                             std::to_string(count));
}

void refuseField(const Fields& fields, const std::string& key, const std::string& only) {
  const auto found = fields.find(key);
  if (found != fields.end() && std::atof(found->second.c_str()) != std::atof(only.c_str()))
    throw std::runtime_error(key + ": " + found->second + ": only " + only + " is read");
}

Account accountOfNrrd(const std::string& path) {
  auto [f, end] = textOf(path, Format::Nrrd);
  if (f.count("space directions") == 0 && f.count("spacings") == 0)
    throw std::runtime_error("no spacing: space directions or spacings are needed");
  for (const char* const key : {"line skip", "lineskip", "byte skip", "byteskip"}) refuseField(f, key, "0");
  refuseNumbers(f, "space directions", 9), refuseNumbers(f, "space origin", 3);
  refuseNumbers(f, "spacings", static_cast<std::size_t>(std::atoi(f["dimension"].c_str())));
  for (const char* const key : {"space units", "units"})
    for (std::string unit = f[key]; unit.find('"') != std::string::npos;) {
      const auto from = unit.find('"'), to = std::min(unit.find('"', from + 1), unit.size());
      const std::string one = unit.substr(from + 1, to - from - 1);
      if (one != "mm" && one != "millimeter" && !one.empty())
        throw std::runtime_error(std::string(key) + ": " + one + ": must be mm");
      unit.erase(0, std::min(to + 1, unit.size()));
    }
  // ITK 5.2 turns left-anterior-superior round the wrong axis.
  const std::string space = lower(f["space"]), encoding = lower(f["encoding"]);
  Account account;
  account.placed = !space.empty();
  if (account.placed && space != "right-anterior-superior" && space != "ras" && space != "lps" &&
      space != "left-posterior-superior")
    throw std::runtime_error("space: " + space +
                             ": must be left-posterior-superior or right-anterior-superior");
  const bool text = encoding == "ascii" || encoding == "text" || encoding == "txt";
  const bool packed = encoding == "gzip" || encoding == "gz";
  const bool hex = encoding == "hex";
  // ITK takes memory for all values before it says this, as it does before it finds base 16 too short.
  if (!text && !packed && !hex && encoding != "raw")
    throw std::runtime_error("encoding: " + files::shown(encoding, 40) + ": must be raw, gzip, ascii or hex");
  account.width = text ? 1 : 0;
  std::string name = "local";
  for (const char* const key : {"datafile", "data file"})
    if (f.count(key) != 0) name = f[key];
  const Stored stored = text ? Stored::Text : packed ? Stored::Packed : hex ? Stored::Hex : Stored::Plain;
  account.bytes = dataOf(path, end, name, stored,
                         Passing::ofText(lower(f["type"]), f["sizes"], lower(f["endian"]) == "big"));
  return account;
}

Account accountOfMeta(const std::string& path) {
  auto [f, end] = textOf(path, Format::Meta);
  if (f.count("elementspacing") == 0 && f.count("elementsize") == 0)
    throw std::runtime_error("no spacing: ElementSpacing is needed");
  refuseField(f, "elementtointensityfunctionslope", "1");
  refuseField(f, "elementtointensityfunctionoffset", "0");
  refuseField(f, "headersize", "0");
  Account account;
  account.placed = f.count("transformmatrix") + f.count("orientation") + f.count("rotation") > 0;
  const auto axes = static_cast<std::size_t>(std::clamp(std::atoi(f["ndims"].c_str()), 0, 10));
  for (const char* const key : {"elementspacing", "elementsize", "offset", "origin", "position"})
    refuseNumbers(f, key, axes);
  for (const char* const key : {"transformmatrix", "orientation", "rotation"})
    refuseNumbers(f, key, axes * axes);
  const bool text = f.count("binarydata") != 0 && lower(f["binarydata"])[0] != 't';
  const bool packed = lower(f["compresseddata"])[0] == 't';
  account.width = text ? 1 : 0;
  bool big = false;
  for (const char* const key : {"binarydatabyteordermsb", "elementbyteordermsb"})
    big = big || lower(f[key])[0] == 't' || f[key][0] == '1';
  account.bytes = dataOf(path, end, f["elementdatafile"],
                         text     ? Stored::Text
                         : packed ? Stored::Packed
                                  : Stored::Plain,
                         Passing::ofText(lower(f["elementtype"]), f["dimsize"], big));
  return account;
}

/// nifti1.h of the NIfTI Data Format Working Group.
Account accountOfNifti(const std::string& path) {
  const bool packed = lower(path).compare(path.size() - 3, 3, ".gz") == 0;
  const Stored stored = packed ? Stored::Packed : Stored::Plain;
  const Content content = contentOf(path, 0, stored, {}, 348);
  if (content.head.size() < 348 || content.head.compare(344, 3, "n+1") != 0)
    throw std::runtime_error("is no NIfTI-1 file with its values in it");
  std::uint32_t first = 0;
  std::memcpy(&first, content.head.data(), 4);
  const bool swapped = first != 348;
  const auto number = [&](std::size_t at, auto value) {
    char bytes[sizeof value];
    for (std::size_t b = 0; b < sizeof value; ++b)
      bytes[b] = content.head[at + (swapped ? sizeof value - 1 - b : b)];
    std::memcpy(&value, bytes, sizeof value);
    return value;
  };
  if (const int unit = content.head[123] & 7; unit != 0 && unit != 2)
    throw std::runtime_error("units: must be mm");
  for (const std::size_t axis : {80, 84, 88})
    if (number(axis, 0.0f) == 0) throw std::runtime_error("no spacing: pixdim is 0");
  // NIfTI's own reader takes 1 or 0 for what is no number.
  const auto finite = [&](const char* field, std::size_t first, std::size_t count) {
    for (std::size_t at = first; at < first + 4 * count; at += 4)
      if (!std::isfinite(number(at, 0.0f)))
        throw std::runtime_error(std::string(field) + ": not a finite number");
  };
  finite("pixdim", 76, 4);
  if (number(252, std::int16_t{0}) > 0) finite("quatern or qoffset", 256, 6);
  if (number(254, std::int16_t{0}) > 0) {
    finite("srow", 280, 12);
    // ITK 4 makes right angles of whatever it finds, ITK 5 refuses.
    const auto column = [&](std::size_t c) {
      return Eigen::Vector3d(number(280 + 4 * c, 0.0f), number(296 + 4 * c, 0.0f), number(312 + 4 * c, 0.0f));
    };
    for (std::size_t a = 0; a < 3 && number(252, std::int16_t{0}) <= 0; ++a) {
      const Eigen::Vector3d one = column(a), next = column((a + 1) % 3);
      if (std::abs(one.dot(next)) > 1e-3 * one.norm() * next.norm())
        throw std::runtime_error("srow: its directions are not orthonormal");
    }
  }
  const float begin = number(108, 0.0f);
  if (!(begin >= 348 && begin <= 1e9f)) throw std::runtime_error("vox_offset: must be at least 348");
  const int axes = number(40, std::int16_t{0});
  for (int a = 1; a <= std::min(axes, 7); ++a)
    if (const int size = number(40 + 2 * static_cast<std::size_t>(a), std::int16_t{0}); size < 1)
      throw std::runtime_error("dim[" + std::to_string(a) + "]: " + std::to_string(size) +
                               ": must be at least 1");
  static const std::map<int, int> kBits{{2, 8},   {4, 16},   {8, 32},   {16, 32},   {64, 64},
                                        {256, 8}, {512, 16}, {768, 32}, {1024, 64}, {1280, 64}};
  const int type = number(70, std::int16_t{0}), bits = number(72, std::int16_t{0});
  const auto known = kBits.find(type);
  if (known != kBits.end() && bits != known->second)
    throw std::runtime_error("bitpix: " + std::to_string(bits) + ": must be " +
                             std::to_string(known->second) + ", as of datatype " + std::to_string(type));
  Account account;
  account.width = static_cast<std::size_t>(std::max(bits / 8, 1));
  account.placed = number(252, std::int16_t{0}) > 0 || number(254, std::int16_t{0}) > 0;
  std::size_t count = 1;
  for (int a = 1; a <= std::min(axes, 7); ++a)
    count = std::min(
        count * static_cast<std::size_t>(number(40 + 2 * static_cast<std::size_t>(a), std::int16_t{0})),
        std::size_t{1} << 40);
  const std::size_t bytes = contentOf(path, 0, stored,
                                      Passing::ofNifti(type, count, swapped, static_cast<std::size_t>(begin),
                                                       number(112, 0.0f), number(116, 0.0f)))
                                .bytes;
  account.bytes = bytes - std::min(bytes, static_cast<std::size_t>(begin));
  return account;
}

itk::ImageIOBase::Pointer readerOf(Format format) {
  if (format == Format::Nrrd) return itk::NrrdImageIO::New().GetPointer();
  if (format == Format::Meta) return itk::MetaImageIO::New().GetPointer();
  return itk::NiftiImageIO::New().GetPointer();
}

/// A reader with its header read.
itk::ImageIOBase::Pointer open(const std::string& path) {
  const auto io = readerOf(formatOf(path));
  // Of NRRD ITK 4 asks for an ending in small letters, no more.
  if (formatOf(path) != Format::Nrrd && !io->CanReadFile(path.c_str()))
    throw std::runtime_error("is no file of its ending");
  io->SetFileName(path);
  io->ReadImageInformation();
  return io;
}

/// ITK's own words, in one line.
std::runtime_error translated(const itk::ExceptionObject& error) {
  std::string cause = error.GetDescription();
  std::replace(cause.begin(), cause.end(), '\n', ' ');
  return std::runtime_error("cannot be read: " + cause);
}

template <class Value>
ValueKind convert(const Value* from, const VolumeHeader& h, bool reversed, void* to) {
  const std::size_t layer = std::size_t{h.size[0]} * h.size[1], count = layer * h.size[2];
  ValueKind kind{true, 0, 0};
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < count; ++i) {
    const auto v = static_cast<double>(from[i]);
    if (std::isnan(v)) {
      ++kind.nothing;
      continue;
    }
    if (!(std::abs(v) <= 1e30)) refuseBeyond();
    least = std::min(least, v);
    kind.whole = kind.whole && v >= -32768 && v <= 32767 && v == std::floor(v);
  }
  if (kind.nothing == count) refuseNothing();
  kind.whole = kind.whole && kind.nothing == 0;
  kind.padding = std::nextafter(static_cast<float>(least) - 1, -std::numeric_limits<float>::infinity());
  const auto fill = [&](auto* out) {
    for (std::size_t k = 0; k < h.size[2]; ++k) {
      const Value* const slice = from + (reversed ? h.size[2] - 1 - k : k) * layer;
      for (std::size_t i = 0; i < layer; ++i) {
        const bool nothing = std::isnan(static_cast<double>(slice[i]));
        *out++ = static_cast<std::decay_t<decltype(*out)>>(nothing ? kind.padding : slice[i]);
      }
    }
  };
  if (kind.whole)
    fill(static_cast<std::int16_t*>(to));
  else
    fill(static_cast<float*>(to));
  return kind;
}

}  // namespace

bool isVolumeFile(const std::string& path) {
  return formatOf(path) != Format::Other;
}

VolumeHeader readVolumeHeader(const std::string& path) try {
  const Format format = formatOf(path);
  if (fs::file_size(path) == 0) throw std::runtime_error("is empty");  // as readHeaders() has it
  const Account account = format == Format::Nrrd   ? accountOfNrrd(path)
                          : format == Format::Meta ? accountOfMeta(path)
                                                   : accountOfNifti(path);
  const auto io = open(path);
  const unsigned dimensions = io->GetNumberOfDimensions();
  if (io->GetNumberOfComponents() != 1)
    throw std::runtime_error(std::to_string(io->GetNumberOfComponents()) +
                             " numbers a voxel: colour and vectors are no volume");
  if (dimensions < 3) throw std::runtime_error("has fewer than 3 dimensions: it is a picture, no volume");
  for (unsigned a = 3; a < dimensions; ++a)
    if (io->GetDimensions(a) != 1)
      throw std::runtime_error("has more than 3 dimensions: one phase is needed");
  VolumeHeader header{};
  for (unsigned a = 0; a < 3; ++a) {
    header.size[a] = static_cast<std::uint32_t>(std::min<std::size_t>(io->GetDimensions(a), UINT32_MAX));
    header.spacing[a] = io->GetSpacing(a), header.origin[a] = io->GetOrigin(a);
    const auto axis = io->GetDirection(a);
    for (unsigned r = 0; r < 3; ++r) header.direction[r][a] = axis.at(r);
  }
  header.width = static_cast<std::uint32_t>(io->GetComponentSize());
  header.placed = account.placed;
  const std::size_t width = account.width != 0 ? account.width : std::max(header.width, 1u);
  header.values = account.bytes / width;
  return header;
} catch (const itk::ExceptionObject& error) {
  throw translated(error);
}

ValueKind readValues(const std::string& path, const VolumeHeader& header, bool reversed, void* to) try {
  const auto io = open(path);
  itk::ImageIORegion region(io->GetNumberOfDimensions());
  std::size_t count = 1;
  for (unsigned a = 0; a < io->GetNumberOfDimensions(); ++a) {
    region.SetIndex(a, 0), region.SetSize(a, io->GetDimensions(a));
    count *= io->GetDimensions(a);
    if (a < 3 && io->GetDimensions(a) != header.size[a]) throw std::runtime_error("changes while it is read");
  }
  io->SetIORegion(region);
  const std::unique_ptr<double[]> room(new double[count * io->GetComponentSize() / sizeof(double) + 1]);
  io->Read(room.get());
  const auto as = [&](auto value) {
    return convert(reinterpret_cast<const decltype(value)*>(room.get()), header, reversed, to);
  };
  using Type = itk::ImageIOBase;  // ITK 4 has the names there alone
  switch (io->GetComponentType()) {
    case Type::UCHAR:
      return as(static_cast<unsigned char>(0));
    case Type::CHAR:
      return as(static_cast<signed char>(0));
    case Type::USHORT:
      return as(static_cast<unsigned short>(0));
    case Type::SHORT:
      return as(short{0});
    case Type::UINT:
      return as(0u);
    case Type::INT:
      return as(0);
    case Type::ULONG:
      return as(0ul);
    case Type::LONG:
      return as(0l);
    case Type::ULONGLONG:
      return as(0ull);
    case Type::LONGLONG:
      return as(0ll);
    case Type::FLOAT:
      return as(0.0f);
    case Type::DOUBLE:
      return as(0.0);
    default:
      throw std::runtime_error("has a type of number that is not read");
  }
} catch (const itk::ExceptionObject& error) {
  throw translated(error);
}

}  // namespace vest::image
