#include <gdcmFile.h>
#include <gdcmImage.h>
#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmTrace.h>
#include <gdcmWriter.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <stdexcept>

#include "vest_instruments/files/read.h"
#include "vest_tissue/image/phantom.h"

namespace vest::image {
namespace {

using Eigen::Vector3d;
using gdcm::DataSet;
using gdcm::Tag;
using gdcm::TransferSyntax;
using gdcm::VR;

constexpr const char* kCt = "1.2.840.10008.5.1.4.1.1.2";
constexpr const char* kEnhancedCt = "1.2.840.10008.5.1.4.1.1.2.1";

/// What becomes a file; faults change it before it is written. Lengths in mm.
struct Picture {
  std::vector<std::int16_t> values;  // HU, all frames
  std::uint32_t columns = 0, rows = 0;
  std::vector<Vector3d> positions;  // one a frame
  Vector3d row = Vector3d::UnitX(), column = Vector3d::UnitY();
  double row_spacing = 1, column_spacing = 1, thickness = 1, slope = 1, intercept = -1024;
  bool is_signed = false, has_position = true, has_spacing = true, has_frame_groups = true;
  std::uint16_t stored_bits = 16;
  std::optional<int> padding, padding_limit;
  int number = 1, of = 1, series = 1, acquisition = 1;
  std::string photometric = "MONOCHROME2", image_type = "ORIGINAL\\PRIMARY\\AXIAL", sop = kCt;
  TransferSyntax::TSType syntax = TransferSyntax::ExplicitVRLittleEndian;
};

void put(DataSet& data, Tag tag, VR::VRType type, const void* bytes, std::size_t count) {
  gdcm::DataElement element(tag, 0, type);
  element.SetByteValue(static_cast<const char*>(bytes), static_cast<std::uint32_t>(count));
  data.Replace(element);
}

void put(DataSet& data, Tag tag, VR::VRType type, std::string text) {
  if (text.size() % 2 != 0) text += type == VR::UI ? '\0' : ' ';
  put(data, tag, type, text.data(), text.size());
}

void put16(DataSet& data, Tag tag, int value, bool is_signed = false) {
  const auto bits = static_cast<std::uint16_t>(value);
  put(data, tag, is_signed ? VR::SS : VR::US, &bits, sizeof bits);
}

std::string decimals(std::initializer_list<double> numbers) {
  std::string text;
  for (const double number : numbers) {
    char one[32];
    std::snprintf(one, sizeof one, "%.10g", number);
    text += (text.empty() ? "" : "\\") + std::string(one);
  }
  return text;
}

void putItems(DataSet& data, Tag tag, const std::vector<DataSet>& items) {
  const gdcm::SmartPointer<gdcm::SequenceOfItems> sequence = new gdcm::SequenceOfItems;
  sequence->SetLengthToUndefined();
  for (const DataSet& nested : items) {
    gdcm::Item item;
    item.SetVLToUndefined();
    item.SetNestedDataSet(nested);
    sequence->AddItem(item);
  }
  gdcm::DataElement element(tag, 0, VR::SQ);
  element.SetValue(*sequence);
  element.SetVLToUndefined();
  data.Replace(element);
}

DataSet within(Tag tag, const DataSet& item) {
  DataSet data;
  putItems(data, tag, {item});
  return data;
}

void putPosition(DataSet& data, const Vector3d& p) {
  put(data, Tag(0x0020, 0x0032), VR::DS, decimals({p[0], p[1], p[2]}));
}

/// Geometry and rescaling in the file itself, or in groups shared by all frames with a position for each.
void putGeometry(DataSet& data, const Picture& p) {
  DataSet direction, measures, values;
  put(direction, Tag(0x0020, 0x0037), VR::DS,
      decimals({p.row[0], p.row[1], p.row[2], p.column[0], p.column[1], p.column[2]}));
  if (p.has_spacing) put(measures, Tag(0x0028, 0x0030), VR::DS, decimals({p.row_spacing, p.column_spacing}));
  put(measures, Tag(0x0018, 0x0050), VR::DS, decimals({p.thickness}));
  put(values, Tag(0x0028, 0x1052), VR::DS, decimals({p.intercept}));
  put(values, Tag(0x0028, 0x1053), VR::DS, decimals({p.slope}));
  put(values, Tag(0x0028, 0x1054), VR::LO, "HU");
  if (p.positions.size() == 1 || !p.has_frame_groups) {
    for (const DataSet* const part : {&direction, &measures, &values})
      for (const auto& element : part->GetDES()) data.Replace(element);
    if (p.has_position) putPosition(data, p.positions.front());
    return;
  }
  DataSet shared;
  for (const auto& [tag, part] :
       {std::pair(Tag(0x0020, 0x9116), &direction), std::pair(Tag(0x0028, 0x9110), &measures),
        std::pair(Tag(0x0028, 0x9145), &values)})
    putItems(shared, tag, {*part});
  putItems(data, Tag(0x5200, 0x9229), {shared});
  std::vector<DataSet> frames;
  for (const Vector3d& position : p.positions) {
    DataSet place;
    putPosition(place, position);
    frames.push_back(within(Tag(0x0020, 0x9113), place));
  }
  putItems(data, Tag(0x5200, 0x9230), frames);
}

std::string uid(int series, int number) {
  return "2.25.2017." + std::to_string(series) + (number == 0 ? "" : "." + std::to_string(number));
}

void putImage(DataSet& data, const Picture& p) {
  const bool colour = p.photometric == "RGB";
  put(data, Tag(0x0008, 0x0008), VR::CS, p.image_type);
  put(data, Tag(0x0008, 0x0060), VR::CS, "CT");
  put(data, Tag(0x0010, 0x0010), VR::PN, "PHANTOM");
  put(data, Tag(0x0020, 0x000d), VR::UI, uid(0, 0));
  put(data, Tag(0x0020, 0x000e), VR::UI, uid(p.series, 0));
  put(data, Tag(0x0020, 0x0012), VR::IS, std::to_string(p.acquisition));
  put(data, Tag(0x0020, 0x0013), VR::IS, std::to_string(p.number));
  put(data, Tag(0x0020, 0x1002), VR::IS, std::to_string(p.of));
  put16(data, Tag(0x0028, 0x0002), colour ? 3 : 1);
  if (colour) put16(data, Tag(0x0028, 0x0006), 0);
  put(data, Tag(0x0028, 0x0004), VR::CS, p.photometric);
  put16(data, Tag(0x0028, 0x0010), static_cast<int>(p.rows));
  put16(data, Tag(0x0028, 0x0011), static_cast<int>(p.columns));
  put16(data, Tag(0x0028, 0x0100), colour ? 8 : 16);
  put16(data, Tag(0x0028, 0x0101), colour ? 8 : p.stored_bits);
  put16(data, Tag(0x0028, 0x0102), colour ? 7 : p.stored_bits - 1);
  put16(data, Tag(0x0028, 0x0103), p.is_signed ? 1 : 0);
  if (p.padding) put16(data, Tag(0x0028, 0x0120), *p.padding, p.is_signed);
  if (p.padding_limit) put16(data, Tag(0x0028, 0x0121), *p.padding_limit, p.is_signed);
  if (p.positions.size() > 1) put(data, Tag(0x0028, 0x0008), VR::IS, std::to_string(p.positions.size()));
}

gdcm::DataElement pixels(const Picture& p) {
  gdcm::DataElement element(Tag(0x7fe0, 0x0010), 0, VR::OW);
  if (p.photometric == "RGB") {
    const std::vector<char> grey(std::size_t{3} * p.columns * p.rows, 90);
    element.SetVR(VR::OB);
    element.SetByteValue(grey.data(), static_cast<std::uint32_t>(grey.size()));
    return element;
  }
  std::vector<std::uint16_t> stored;
  for (const std::int16_t value : p.values)
    stored.push_back(static_cast<std::uint16_t>(std::lround((value - p.intercept) / p.slope)));
  element.SetByteValue(reinterpret_cast<const char*>(stored.data()),
                       static_cast<std::uint32_t>(2 * stored.size()));
  if (p.syntax == TransferSyntax::ExplicitVRLittleEndian || p.syntax == TransferSyntax::ExplicitVRBigEndian ||
      p.syntax == TransferSyntax::ImplicitVRLittleEndian)
    return element;
  const gdcm::SmartPointer<gdcm::Image> picture = new gdcm::Image;  // GDCM's objects count who holds them
  gdcm::Image& image = *picture;
  image.SetNumberOfDimensions(p.positions.size() > 1 ? 3 : 2);
  image.SetDimension(0, p.columns), image.SetDimension(1, p.rows);
  if (p.positions.size() > 1) image.SetDimension(2, static_cast<unsigned>(p.positions.size()));
  image.SetPixelFormat(gdcm::PixelFormat(1, 16, p.stored_bits, p.stored_bits - 1, p.is_signed ? 1 : 0));
  image.SetPhotometricInterpretation(gdcm::PhotometricInterpretation::MONOCHROME2);
  image.SetTransferSyntax(TransferSyntax::ExplicitVRLittleEndian);
  image.SetDataElement(element);
  gdcm::ImageChangeTransferSyntax change;
  change.SetTransferSyntax(p.syntax);
  change.SetInput(*picture);
  if (!change.Change()) throw std::invalid_argument("GDCM cannot compress so");
  return change.GetOutput().GetDataElement();
}

void save(const Picture& p, const std::string& path) {
  gdcm::Writer writer;
  gdcm::File& file = writer.GetFile();
  DataSet& data = file.GetDataSet();
  put(data, Tag(0x0008, 0x0016), VR::UI, p.sop);
  put(data, Tag(0x0008, 0x0018), VR::UI, uid(p.series, p.number));
  if (p.sop == kCt || p.sop == kEnhancedCt) {
    putImage(data, p);
    putGeometry(data, p);
    if (!p.has_position) data.Remove(Tag(0x0020, 0x0037));
    data.Replace(pixels(p));
  }
  file.GetHeader().SetDataSetTransferSyntax(p.syntax);
  writer.SetFileName(path.c_str());
  if (!writer.Write()) throw std::invalid_argument(path + ": cannot be written");
}

using Pictures = std::vector<Picture>;

struct Fault {
  const char *name, *what;
  std::function<void(Pictures&)> change;
};

std::function<void(Pictures&)> each(std::function<void(Picture&)> change) {
  return [change](Pictures& all) {
    for (Picture& p : all) change(p);
  };
}

std::function<void(Pictures&)> coded(TransferSyntax::TSType syntax) {
  return each([syntax](Picture& p) { p.syntax = syntax, p.stored_bits = 12; });
}

void join(Pictures& all, bool groups) {
  Picture one = all.front();
  for (std::size_t k = 1; k < all.size(); ++k) {
    one.values.insert(one.values.end(), all[k].values.begin(), all[k].values.end());
    one.positions.push_back(all[k].positions[0]);
  }
  one.has_frame_groups = groups;
  one.sop = kEnhancedCt;
  all = {one};
}

/// Copies of all or of one, with a change.
void add(Pictures& all, std::size_t from, std::size_t count, const std::function<void(Picture&)>& change) {
  for (std::size_t k = from; k < from + count; ++k) {
    Picture copy = all.at(k);
    copy.number = static_cast<int>(all.size() + 1);
    change(copy);
    all.push_back(copy);
  }
}

const std::vector<Fault>& table() {
  const auto middle = [](Pictures& all) -> Picture& { return all[all.size() / 2]; };
  static const std::vector<Fault> all = {
      {"none", "a plain series", [](Pictures&) {}},
      {"tilt", "gantry tilted by 15 degrees",
       each([](Picture& p) { p.positions[0][1] += std::tan(M_PI / 12) * p.positions[0][2]; })},
      {"spacing", "one slice a fifth of the distance off",
       [=](Pictures& a) { middle(a).positions[0][2] += 0.2 * a[0].thickness; }},
      {"sideways", "one slice two pixels aside",
       [=](Pictures& a) { middle(a).positions[0][0] += 2 * a[0].column_spacing; }},
      {"missing", "one slice is not there",
       [](Pictures& a) { a.erase(a.begin() + static_cast<long>(a.size() / 2)); }},
      {"gap", "three slices in a row are not there",
       [](Pictures& a) {
         a.erase(a.begin() + static_cast<long>(a.size() / 2),
                 a.begin() + static_cast<long>(a.size() / 2 + 3));
       }},
      {"no_first", "the first slice is not there", [](Pictures& a) { a.erase(a.begin()); }},
      {"no_last", "the last slice is not there", [](Pictures& a) { a.pop_back(); }},
      {"duplicate", "one slice twice", [](Pictures& a) { add(a, a.size() / 2, 1, [](Picture&) {}); }},
      {"contradiction", "two different slices at one place",
       [](Pictures& a) { add(a, a.size() / 2, 1, [](Picture& p) { p.values[0] += 1; }); }},
      {"mixed", "two series", [](Pictures& a) { add(a, 0, a.size(), [](Picture& p) { p.series = 2; }); }},
      {"phases", "two acquisitions at the same places",
       [](Pictures& a) { add(a, 0, a.size(), [](Picture& p) { p.acquisition = 2, p.values[0] += 1; }); }},
      {"sizes", "one slice of another size",
       [=](Pictures& a) {
         Picture& p = middle(a);
         p.rows /= 2, p.values.resize(std::size_t{p.rows} * p.columns);
       }},
      {"directions", "one slice turned by 10 degrees",
       [=](Pictures& a) {
         Picture& p = middle(a);
         p.row = Vector3d(std::cos(0.1745), std::sin(0.1745), 0), p.column = Vector3d(-p.row[1], p.row[0], 0);
       }},
      {"localizer", "a scout picture beside the series",
       [](Pictures& a) {
         add(a, 0, 1, [](Picture& p) {
           p.series = 2, p.image_type = "ORIGINAL\\PRIMARY\\LOCALIZER", p.row = Vector3d::UnitY(),
           p.column = -Vector3d::UnitZ();
         });
       }},
      {"report", "a dose report beside the series",
       [](Pictures& a) {
         add(a, 0, 1, [](Picture& p) { p.sop = "1.2.840.10008.5.1.4.1.1.88.67", p.series = 3; });
       }},
      {"only_report", "no picture at all",
       [](Pictures& a) { a.resize(1), a[0].sop = "1.2.840.10008.5.1.4.1.1.88.67"; }},
      {"monochrome1", "low values are meant to be bright",
       each([](Picture& p) { p.photometric = "MONOCHROME1"; })},
      {"padding", "signed pixels, -2000 outside of a circle",
       each([](Picture& p) { p.is_signed = true, p.intercept = -24, p.padding = -2000; })},
      {"padding_range", "signed pixels, -2000 … -1990 outside of a circle", each([](Picture& p) {
         p.is_signed = true, p.intercept = -24, p.padding = -2000, p.padding_limit = -1990;
       })},
      {"slopes", "each slice has its own slope and intercept",
       [](Pictures& a) {
         for (std::size_t k = 0; k < a.size(); ++k)
           if (k % 2 == 1) a[k].slope = 0.5, a[k].intercept = -1025;
       }},
      {"odd_slopes", "values that are no whole numbers",
       each([](Picture& p) { p.slope = 0.25, p.intercept = -1024.125; })},
      {"big_endian", "explicit big endian", each([](Picture& p) {
         p.syntax = TransferSyntax::ExplicitVRBigEndian, p.is_signed = true, p.padding = -2000,
         p.intercept = -24;
       })},
      {"implicit", "implicit little endian",
       each([](Picture& p) { p.syntax = TransferSyntax::ImplicitVRLittleEndian; })},
      {"rle", "RLE lossless", coded(TransferSyntax::RLELossless)},
      {"jpeg", "JPEG lossless", coded(TransferSyntax::JPEGLosslessProcess14_1)},
      {"jpeg_ls", "JPEG-LS lossless", coded(TransferSyntax::JPEGLSLossless)},
      {"jpeg2000", "JPEG 2000 lossless", coded(TransferSyntax::JPEG2000Lossless)},
      {"multi_frame", "all slices in one file, each with its place", [](Pictures& a) { join(a, true); }},
      {"multi_frame_jpeg2000", "the same, compressed",
       [](Pictures& a) {
         join(a, true), a[0].syntax = TransferSyntax::JPEG2000Lossless, a[0].stored_bits = 12;
       }},
      {"multi_frame_no_position", "all slices in one file with one place",
       [](Pictures& a) { join(a, false); }},
      {"colour", "RGB", each([](Picture& p) { p.photometric = "RGB"; })},
      {"no_position", "no image position and orientation", each([](Picture& p) { p.has_position = false; })},
      {"no_spacing", "no pixel spacing", each([](Picture& p) { p.has_spacing = false; })},
  };
  return all;
}

}  // namespace

const std::vector<std::pair<std::string, std::string>>& faults() {
  static const auto all = [] {
    std::vector<std::pair<std::string, std::string>> names;
    for (const Fault& f : table()) names.emplace_back(f.name, f.what);
    return names;
  }();
  return all;
}

void writeDicom(const Volume& volume, const std::string& folder, const std::string& fault) {
  gdcm::Trace::WarningOff(), gdcm::Trace::ErrorOff();
  const Fault* found = nullptr;
  for (const Fault& f : table())
    if (f.name == fault) found = &f;
  if (found == nullptr) throw std::invalid_argument("fault \"" + files::shown(fault) + "\": not known");
  if (!volume.whole || volume.size[2] < 8)
    throw std::invalid_argument("faults need 8 slices of whole numbers");
  Pictures pictures;
  const Vector3d spacing = 1e3 * volume.spacing();
  for (std::uint32_t k = 0; k < volume.size[2]; ++k) {
    Picture p;
    p.columns = volume.size[0], p.rows = volume.size[1];
    const std::int16_t* const first = volume.whole.get() + k * volume.layer();
    p.values.assign(first, first + volume.layer());
    p.positions = {1e3 * volume.slices[k].position};
    p.column_spacing = spacing[0], p.row_spacing = spacing[1], p.thickness = spacing[2];
    p.number = static_cast<int>(k + 1), p.of = static_cast<int>(volume.size[2]);
    pictures.push_back(std::move(p));
  }
  found->change(pictures);
  for (Picture& p : pictures) {
    if (!p.padding) continue;
    for (std::size_t i = 0; i < p.values.size(); ++i) {  // outside of the circle that a scanner sees
      const double x = 2.0 * static_cast<double>(i % p.columns) / p.columns - 1,
                   y = 2.0 * static_cast<double>(i / p.columns) / p.rows - 1;
      if (x * x + y * y > 1)
        p.values[i] = static_cast<std::int16_t>(*p.padding + static_cast<int>(p.padding_limit ? i % 11 : 0) +
                                                p.intercept);
    }
  }
  for (std::size_t k = 0; k < pictures.size(); ++k) {
    char name[24];
    std::snprintf(name, sizeof name, "I%04zu", k + 1);
    save(pictures[k], (std::filesystem::path(folder) / name).string());
  }
}

}  // namespace vest::image
