#include "dicom_file.h"

#include <gdcmFile.h>
#include <gdcmImage.h>
#include <gdcmImageReader.h>
#include <gdcmReader.h>
#include <gdcmSequenceOfFragments.h>
#include <gdcmSequenceOfItems.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "vest_instruments/files/read.h"

namespace vest::image {
namespace {

using gdcm::DataSet;
using gdcm::Tag;

/// A file that remembers whether a value was asked for that it ends within: GDCM fills up with zeros. Marks
/// of four bytes and less do not count; what ends there is missing, and found missing.
class Whole : public std::filebuf {
 public:
  explicit Whole(const std::string& path) { open(path, std::ios::in | std::ios::binary); }
  bool cut = false;

 protected:
  std::streamsize xsgetn(char* to, std::streamsize count) override {
    const std::streamsize got = std::filebuf::xsgetn(to, count);
    if (got < count && count > 4) cut = true;
    return got;
  }
};

const Tag kPixels(0x7fe0, 0x0010), kShared(0x5200, 0x9229), kPerFrame(0x5200, 0x9230);

std::string bytesOf(const DataSet& data, const Tag& tag) {
  if (!data.FindDataElement(tag)) return {};
  const gdcm::ByteValue* const value = data.GetDataElement(tag).GetByteValue();
  if (value == nullptr || value->GetPointer() == nullptr) return {};
  return {value->GetPointer(), std::min<std::size_t>(value->GetLength(), 4096)};
}

std::string textOf(const DataSet& data, const Tag& tag) {
  std::string text = bytesOf(data, tag);
  const auto outer = [](char c) { return c == ' ' || c == '\0'; };
  while (!text.empty() && outer(text.back())) text.pop_back();
  while (!text.empty() && outer(text.front())) text.erase(0, 1);
  return text;
}

/// Decimal strings with \ between them (DICOM PS3.5, 6.2). @throws std::invalid_argument on what is no number
bool numbers(const DataSet& data, const Tag& tag, double* to, std::size_t count, const char* name) {
  const std::string text = textOf(data, tag);
  if (text.empty()) return false;
  std::size_t from = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t end = std::min(text.find('\\', from), text.size());
    std::string one = text.substr(from, end - from);
    one.erase(std::remove(one.begin(), one.end(), ' '), one.end());
    if (!one.empty() && one[0] == '+') one.erase(0, 1);
    if (from > text.size() || !files::parseNumber(one, to[i]))
      throw std::invalid_argument(std::string(name) + ": \"" + text + "\" is not " + std::to_string(count) +
                                  " numbers");
    from = end + 1;
  }
  return true;
}

bool number16(const DataSet& data, const Tag& tag, std::uint32_t& to) {
  const std::string bytes = bytesOf(data, tag);
  std::uint16_t value = 0;
  if (bytes.size() < sizeof value) return false;
  std::memcpy(&value, bytes.data(), sizeof value);
  to = value;
  return true;
}

/// A number that only notes need: 0 where it is none.
std::int32_t count(const DataSet& data, const Tag& tag) {
  double value = 0;
  return files::parseNumber(textOf(data, tag), value) && value >= 1 && value <= 1e6
             ? static_cast<std::int32_t>(value)
             : 0;
}

template <std::size_t N>
void keep(char (&to)[N], const std::string& text) {
  std::memset(to, 0, N);
  std::memcpy(to, text.data(), std::min(text.size(), N - 1));
}

/// Item of a sequence, from 1; null where there is none.
const DataSet* item(const DataSet& data, const Tag& tag, std::size_t number,
                    std::vector<gdcm::SmartPointer<gdcm::SequenceOfItems>>& keepers) {
  if (!data.FindDataElement(tag)) return nullptr;
  const auto sequence = data.GetDataElement(tag).GetValueAsSQ();
  if (!sequence || sequence->GetNumberOfItems() < number) return nullptr;
  keepers.push_back(sequence);
  return &sequence->GetItem(number).GetNestedDataSet();
}

/// Where a frame's own groups, those shared by all frames, or the file itself say something.
class Groups {
 public:
  Groups(const DataSet& file, std::size_t frame)
      : file_(file),
        own_(item(file, kPerFrame, frame + 1, keepers_)),
        shared_(item(file, kShared, 1, keepers_)) {}
  const DataSet& of(const Tag& sequence) {
    for (const DataSet* const group : {own_, shared_})
      if (const DataSet* found = group == nullptr ? nullptr : item(*group, sequence, 1, keepers_))
        return *found;
    return file_;
  }

 private:
  std::vector<gdcm::SmartPointer<gdcm::SequenceOfItems>> keepers_;
  const DataSet& file_;
  const DataSet *own_, *shared_;
};

void readPadding(const DataSet& data, FrameHeader& h) {
  std::uint32_t value[2] = {};
  if (!number16(data, Tag(0x0028, 0x0120), value[0])) return;
  if (!number16(data, Tag(0x0028, 0x0121), value[1])) value[1] = value[0];
  h.has_padding = true;
  // Its sign is that of the pixels, whatever its own representation says (DICOM PS3.3, C.7.5.1.1.2).
  for (int i = 0; i < 2; ++i)
    h.padding[i] =
        h.is_signed != 0 ? static_cast<std::int16_t>(value[i]) : static_cast<std::int64_t>(value[i]);
}

void readGeometry(const DataSet& data, std::size_t frame, FrameHeader& h) {
  Groups groups(data, frame);
  h.has_position =
      numbers(groups.of(Tag(0x0020, 0x9113)), Tag(0x0020, 0x0032), h.position, 3, "image position");
  double axes[6];
  h.has_orientation =
      numbers(groups.of(Tag(0x0020, 0x9116)), Tag(0x0020, 0x0037), axes, 6, "image orientation");
  if (h.has_orientation) std::copy(axes, axes + 3, h.row), std::copy(axes + 3, axes + 6, h.column);
  const DataSet& measures = groups.of(Tag(0x0028, 0x9110));
  h.has_spacing = numbers(measures, Tag(0x0028, 0x0030), h.spacing, 2, "pixel spacing");
  numbers(measures, Tag(0x0018, 0x0050), &h.thickness, 1, "slice thickness");
  const DataSet& values = groups.of(Tag(0x0028, 0x9145));
  h.slope = 1;
  const bool slope = numbers(values, Tag(0x0028, 0x1053), &h.slope, 1, "rescale slope");
  const bool intercept = numbers(values, Tag(0x0028, 0x1052), &h.intercept, 1, "rescale intercept");
  h.rescaled = slope || intercept;
  keep(h.rescale_type, textOf(values, Tag(0x0028, 0x1054)));
}

/// Objects that are no pictures: reports, presentation states, structures, plans, documents, folders' tables.
bool isReport(const std::string& sop) {
  const std::string storage = "1.2.840.10008.5.1.4.1.1.";
  for (const char* const kind : {"88.", "11.", "481.3", "481.5", "481.8", "104.", "66", "9."})
    if (sop.compare(0, storage.size() + std::strlen(kind), storage + kind) == 0) return true;
  return sop == "1.2.840.10008.1.3.10";
}

/// Text, tables and pictures that lie beside the images: known by their names.
bool isBeside(const std::string& path) {
  const std::filesystem::path file(path);
  std::string name = file.filename().string(), ending = file.extension().string();
  for (std::string* const s : {&name, &ending})
    std::transform(s->begin(), s->end(), s->begin(), [](unsigned char c) { return std::tolower(c); });
  for (const char* const known : {".txt", ".md", ".json", ".xml", ".html", ".htm", ".pdf", ".csv", ".yaml",
                                  ".jpg", ".png", ".inf", ".exe", ".ini", ".log"})
    if (ending == known) return true;
  return name[0] == '.' || name.compare(0, 6, "readme") == 0 || name.compare(0, 7, "license") == 0 ||
         name == "thumbs.db";
}

bool isPart10(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  char bytes[132] = {};
  in.read(bytes, sizeof bytes);
  return in.gcount() == sizeof bytes && std::memcmp(bytes + 128, "DICM", 4) == 0;
}

void readImage(const DataSet& data, FrameHeader& h) {
  const auto need = [&](const Tag& tag, std::uint32_t& to, const char* name) {
    if (!number16(data, tag, to))
      throw std::invalid_argument(std::string("is damaged, or no image: ") + name + " is missing");
  };
  need(Tag(0x0028, 0x0010), h.rows, "the number of rows");
  need(Tag(0x0028, 0x0011), h.columns, "the number of columns");
  need(Tag(0x0028, 0x0100), h.allocated, "bits allocated");
  need(Tag(0x0028, 0x0101), h.stored, "bits stored");
  need(Tag(0x0028, 0x0103), h.is_signed, "pixel representation");
  h.high_bit = h.stored - 1;
  number16(data, Tag(0x0028, 0x0102), h.high_bit);
  h.samples = 1;
  number16(data, Tag(0x0028, 0x0002), h.samples);
  keep(h.photometric, textOf(data, Tag(0x0028, 0x0004)));
  keep(h.series, textOf(data, Tag(0x0020, 0x000e)));
  keep(h.phase, textOf(data, Tag(0x0020, 0x0100)) + "/" + textOf(data, Tag(0x0018, 0x0086)));
  keep(h.acquisition, textOf(data, Tag(0x0020, 0x0012)));
  h.number = count(data, Tag(0x0020, 0x0013)), h.of = count(data, Tag(0x0020, 0x1002));
  h.localizer = textOf(data, Tag(0x0008, 0x0008)).find("LOCALIZER") != std::string::npos;
  readPadding(data, h);
}

}  // namespace

std::size_t readHeaders(const std::string& path, FrameHeader* headers, std::size_t most) {
  if (most == 0)
    throw std::invalid_argument("one frame more than the " + std::to_string(kMostFrames) + " allowed");
  // What the kernel makes up has no size either, and may let its reader wait: /proc/kmsg.
  const bool empty = std::filesystem::file_size(path) == 0, beside = isBeside(path);
  if (empty && !beside) throw std::invalid_argument("is empty");
  const bool part10 = !empty && isPart10(path);
  FrameHeader h{};
  if (!part10 && beside) {
    h.kind = FrameHeader::Other;
    headers[0] = h;
    return 1;
  }
  gdcm::Reader reader;
  reader.SetFileName(path.c_str());
  if (!reader.ReadUpToTag(kPixels))
    throw std::invalid_argument(part10 ? "is a damaged DICOM file" : "is no DICOM file, or a damaged one");
  const DataSet& data = reader.GetFile().GetDataSet();
  keep(h.modality, textOf(data, Tag(0x0008, 0x0060)));
  const char* const syntax = reader.GetFile().GetHeader().GetDataSetTransferSyntax().GetString();
  keep(h.syntax, syntax == nullptr ? "" : syntax);
  h.frames = 1;
  std::string sop = textOf(data, Tag(0x0008, 0x0016));
  if (sop.empty()) sop = textOf(reader.GetFile().GetHeader(), Tag(0x0002, 0x0002));
  if (isReport(sop)) {
    h.kind = FrameHeader::Report;
    headers[0] = h;
    return 1;
  }
  readImage(data, h);
  double frames = 1;
  numbers(data, Tag(0x0028, 0x0008), &frames, 1, "number of frames");
  if (!(frames >= 1 && frames <= static_cast<double>(most)))
    throw std::invalid_argument("number of frames: 1 … " + std::to_string(most) + " are allowed");
  h.frames = static_cast<std::uint32_t>(frames);
  for (std::uint32_t i = 0; i < h.frames; ++i) {
    h.frame = i;
    readGeometry(data, i, h);
    headers[i] = h;
  }
  return h.frames;
}

std::vector<char> readStored(const std::string& path, const FrameHeader& header) {
  gdcm::ImageReader reader;
  Whole file(path);
  std::istream stream(&file);
  reader.SetStream(stream);
  if (!reader.Read()) throw std::invalid_argument("is damaged: its pixels cannot be read");
  if (file.cut) throw std::invalid_argument("is damaged: it ends within a value");
  const gdcm::Image& image = reader.GetImage();
  const std::size_t needed =
      std::size_t{header.columns} * header.rows * header.frames * (header.allocated / 8);
  const gdcm::DataElement& pixels = reader.GetFile().GetDataSet().GetDataElement(kPixels);
  const gdcm::ByteValue* const plain = pixels.GetByteValue();
  if (plain != nullptr && plain->GetLength() < needed)
    throw std::invalid_argument("is damaged: " + std::to_string(plain->GetLength()) +
                                " bytes of pixels, not " + std::to_string(needed));
  if (image.GetBufferLength() != needed)
    throw std::invalid_argument("is damaged: its pixels are not what its header says");
  std::vector<char> bytes(needed);
  if (!image.GetBuffer(bytes.data()))
    throw std::invalid_argument(std::string("its pixels cannot be decoded (transfer syntax ") +
                                header.syntax + ")");
  return bytes;
}

}  // namespace vest::image
