// NRRD, MetaImage and NIfTI: each is read as it was meant, in the patient's axes of DICOM, or refused with
// cause and file. What damages a file is one message.
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "phantom_files.h"
#include "vest_tissue/image/volume.h"

namespace {

using namespace vest::image;
using vest::test::refusal;
using vest::test::TemporaryScene;

const Volume& head() {
  static const Volume volume = vest::test::headOf(24, 8);
  return volume;
}

std::string raw(const void* values, std::size_t bytes) {
  return {static_cast<const char*>(values), bytes};
}

std::string valuesOf(const Volume& v) {
  return raw(v.whole.get(), 2 * v.voxels());
}

void expectHead(const Volume& v) {
  ASSERT_EQ(v.size, head().size);
  EXPECT_TRUE(v.axes.isApprox(head().axes, 1e-6)) << v.axes;
  EXPECT_LT((v.origin - head().origin).norm(), 1e-7) << v.origin;
  ASSERT_TRUE(v.whole != nullptr);
  ASSERT_EQ(v.slices.size(), v.size[2]);
  EXPECT_LT((v.slices.back().position - head().slices.back().position).norm(), 1e-6);
  for (std::size_t i = 0; i < v.voxels(); ++i) ASSERT_EQ(v.value(i), head().value(i)) << i;
}

bool noted(const Volume& v, const std::string& word) {
  for (const auto& note : v.notes)
    if (note.find(word) != std::string::npos) return true;
  return false;
}

/// gzip -9, as the format has it.
std::string zipped(const TemporaryScene& folder, const std::string& bytes) {
  const std::string file = folder.write("zip", bytes);
  EXPECT_EQ(0, std::system(("gzip -nf " + file).c_str()));
  return vest::test::bytesOf(file + ".gz");
}

/// NIfTI-1 (nifti1.h of the NIfTI Data Format Working Group): 348 bytes, four of no extension, values. Rows
/// of the affine are RAS, in mm.
struct Nifti {
  std::int16_t dim[8]{3, 24, 20, 8, 1, 1, 1, 1};
  std::int16_t type = 4, bits = 16;  // signed, 16 bits
  float slope = 0, intercept = 0;
  float affine[3][4]{};
  bool placed = true;
  char units = 2;  // mm

  explicit Nifti(const Volume& v) {
    for (int r = 0; r < 3; ++r) {
      const double sign = r < 2 ? -1e3 : 1e3;
      for (int c = 0; c < 3; ++c) affine[r][c] = static_cast<float>(sign * v.axes(r, c));
      affine[r][3] = static_cast<float>(sign * v.origin[r]);
    }
  }

  std::string bytes(const std::string& values) const {
    std::string h(352, 0);
    const auto put = [&](std::size_t at, auto value) { std::memcpy(&h[at], &value, sizeof value); };
    put(0, std::int32_t{348});
    std::memcpy(&h[40], dim, sizeof dim);
    put(70, type), put(72, bits);
    put(76, 1.0f);
    for (int c = 0; c < 3; ++c) put(80 + 4 * c, std::hypot(affine[0][c], affine[1][c], affine[2][c]));
    put(108, 352.0f), put(112, slope), put(116, intercept);
    h[123] = units;
    put(254, std::int16_t{placed});  // sform_code: scanner
    std::memcpy(&h[280], affine, sizeof affine);
    std::memcpy(&h[344], "n+1", 4);
    return h + values;
  }
};

std::string nrrd(const std::string& fields, const std::string& values) {
  return "NRRD0004\ndimension: 3\nsizes: 2 2 2\n" + fields + "\n\n" + values;
}
const std::string kDirections = "space: left-posterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,2)\n";

TEST(VolumeFile, WhatIsExportedIsReadBack) {
  const TemporaryScene folder;
  for (const char* const name : {"/a.nrrd", "/a.mha", "/B.NRRD"}) {
    write(head(), folder.folder() + name);
    expectHead(read(folder.folder() + name));
  }
  Volume tilted = head();
  tilted.axes(1, 2) = 0.3 * tilted.axes(2, 2);
  write(tilted, folder.folder() + "/t.nrrd");
  const Volume v = read(folder.folder() + "/t.nrrd");
  EXPECT_TRUE(v.axes.isApprox(tilted.axes, 1e-9));
  EXPECT_TRUE(noted(v, "tilt"));
  const Volume even = read(folder.folder() + "/t.nrrd", {"", true});
  EXPECT_TRUE(even.resampled);
  EXPECT_LT(even.tilt(), 1e-6);
}

TEST(VolumeFile, NiftiIsTurnedToThePatientsAxesOfDicom) {
  const TemporaryScene folder;
  const Nifti nifti(head());
  expectHead(read(folder.write("a.nii", nifti.bytes(valuesOf(head())))));
  expectHead(read(folder.write("a.nii.gz", zipped(folder, nifti.bytes(valuesOf(head()))))));
  Nifti scaled(head());
  scaled.slope = 0.5f, scaled.intercept = 3;
  const Volume v = read(folder.write("s.nii", scaled.bytes(valuesOf(head()))));
  for (std::size_t i = 0; i < v.voxels(); ++i) ASSERT_EQ(v.value(i), 0.5 * head().value(i) + 3) << i;
  Nifti lost(head());
  lost.placed = false;
  EXPECT_TRUE(noted(read(folder.write("l.nii", lost.bytes(valuesOf(head())))), "axes are assumed"));
  Nifti thin(head());
  thin.dim[3] = 7;
  EXPECT_TRUE(noted(read(folder.write("t.nii", thin.bytes(valuesOf(head())))), "holds 480 more values"));
}

// Most NIfTI files are left-handed: their slices are turned round, the values stay at their places.
TEST(VolumeFile, MirroredAxesBecomeRightHanded) {
  const TemporaryScene folder;
  Volume mirrored = head();
  mirrored.axes.col(0) *= -1;
  mirrored.origin += (head().size[0] - 1.0) * head().axes.col(0);
  const Volume v = read(folder.write("a.nii", Nifti(mirrored).bytes(valuesOf(head()))));
  EXPECT_GT(v.axes.determinant(), 0);
  for (std::size_t i = 0; i < 24; ++i)
    for (std::size_t j = 0; j < 20; ++j)
      for (std::size_t k = 0; k < 8; ++k) {
        const Eigen::Vector3d place =
            mirrored.origin + mirrored.axes * Eigen::Vector3d(double(i), double(j), double(k));
        const auto voxel = v.nearest(place);
        ASSERT_TRUE(voxel);
        ASSERT_EQ(v.value(*voxel), head().value((k * 20 + j) * 24 + i));
      }
  EXPECT_LT((v.slices[0].position - v.origin).norm(), 1e-12);
}

TEST(VolumeFile, EveryTypeAndEncodingHasTheSameValues) {
  const TemporaryScene folder;
  const auto expectOf = [&](const std::string& name, const std::string& bytes, double last) {
    const Volume v = read(folder.write(name, bytes));
    ASSERT_EQ(v.voxels(), 8u) << name;
    for (std::size_t i = 0; i < 7; ++i) EXPECT_EQ(v.value(i), double(i)) << name << bytes;
    EXPECT_EQ(v.value(7), last) << name << bytes;
    EXPECT_EQ(v.whole != nullptr, last == std::floor(last) && std::abs(last) <= 32768) << bytes;
  };
  const auto check = [&](const std::string& type, auto last) {
    using Value = decltype(last);
    const Value values[8] = {0, 1, 2, 3, 4, 5, 6, last};
    const std::string little = raw(values, sizeof values);
    std::string big = little;
    for (std::size_t i = 0; i < big.size(); ++i)
      big[i] = little[i / sizeof last * sizeof last + sizeof last - 1 - i % sizeof last];
    const std::string head = kDirections + "type: " + type + "\n";
    expectOf("a.nrrd", nrrd(head + "endian: little\nencoding: raw", little), last);
    expectOf("a.nrrd", nrrd(head + "endian: big\nencoding: raw", big), last);
    expectOf("a.nrrd", nrrd(head + "endian: little\nencoding: gzip", zipped(folder, little)), last);
    std::string text;
    for (const Value v : values) text += std::to_string(v) + " ";
    expectOf("a.nrrd", nrrd(head + "encoding: ascii", text), last);
  };
  check("uint8", std::uint8_t{255});
  check("int16", std::int16_t{-32768});
  check("uint16", std::uint16_t{65535});
  check("int32", std::int32_t{-70000});
  check("float", -0.5f);
  check("double", 1e6);
  folder.write("a.raw", raw("\0\1\2\3\4\5\6\7", 8));
  const std::string meta =
      "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementSpacing = 1 1 2\n"
      "ElementType = MET_UCHAR\nElementDataFile = a.raw\n";
  expectOf("a.mhd", meta, 7);
  expectOf("a.nhdr", nrrd(kDirections + "type: uint8\nencoding: raw\ndata file: a.raw", ""), 7);
}

TEST(VolumeFile, AxesOfNrrdAreTurnedByTheirSpace) {
  const TemporaryScene folder;
  const std::string rest =
      "space directions: (1,0,0) (0,1,0) (0,0,2)\nspace origin: (10,20,30)\ntype: uint8\n"
      "encoding: raw";
  const auto originOf = [&](const std::string& space) {
    const Volume v = read(folder.write("a.nrrd", nrrd("space: " + space + "\n" + rest, std::string(8, 1))));
    return Eigen::Vector3d(1e3 * v.origin);
  };
  EXPECT_LT((originOf("left-posterior-superior") - Eigen::Vector3d(10, 20, 30)).norm(), 1e-9);
  EXPECT_LT((originOf("RAS") - Eigen::Vector3d(-10, -20, 30)).norm(), 1e-9);
  EXPECT_NE(refusal([&] { originOf("left-anterior-superior"); }).find("space:"), std::string::npos);
}

TEST(VolumeFile, WhatIsNoNumberIsPadding) {
  const TemporaryScene folder;
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  float values[8] = {1, 2, nan, 4, -5, 6, 7, 8};
  const std::string head = kDirections + "type: float\nendian: little\nencoding: raw";
  const Volume v = read(folder.write("a.nrrd", nrrd(head, raw(values, sizeof values))));
  EXPECT_TRUE(v.padding(2));
  EXPECT_EQ(statistics(v).count, 7u);
  EXPECT_EQ(statistics(v).min, -5);
  EXPECT_TRUE(noted(v, "no numbers"));
  values[3] = inf;
  EXPECT_NE(
      refusal([&] { read(folder.write("a.nrrd", nrrd(head, raw(values, sizeof values)))); }).find("1e30"),
      std::string::npos);
}

std::string turned(std::string bytes, std::size_t width) {
  for (auto at = bytes.begin(); at != bytes.end(); at += static_cast<std::ptrdiff_t>(width))
    std::reverse(at, at + static_cast<std::ptrdiff_t>(width));
  return bytes;
}

/// Files of 2 x 2 x 2 such values, in each format, byte order and packing: names and bytes.
template <class Value>
std::vector<std::pair<std::string, std::string>> filesOf(const TemporaryScene& folder,
                                                         const std::vector<Value>& values) {
  const std::string little = raw(values.data(), sizeof(Value) * values.size()),
                    big = turned(little, sizeof(Value));
  const std::string type = sizeof(Value) == 8 ? "double" : "float";
  const std::string meta =
      "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementSpacing = 1 1 2\nElementType = MET_" +
      std::string(sizeof(Value) == 8 ? "DOUBLE" : "FLOAT") + "\n";
  Nifti nifti(head());
  std::fill(nifti.dim + 1, nifti.dim + 4, std::int16_t{2});
  nifti.type = sizeof(Value) == 8 ? 64 : 16, nifti.bits = 8 * sizeof(Value);
  std::vector<std::pair<std::string, std::string>> files;
  for (const bool order : {false, true}) {
    const std::string& bytes = order ? big : little;
    const std::string fields = kDirections + "type: " + type + "\nendian: " + (order ? "big" : "little");
    files.emplace_back("a.nrrd", nrrd(fields + "\nencoding: raw", bytes));
    files.emplace_back("b.nrrd", nrrd(fields + "\nencoding: gzip", zipped(folder, bytes)));
    std::string digits;
    for (const char c : bytes)
      for (const int half : {static_cast<unsigned char>(c) / 16, static_cast<unsigned char>(c) % 16})
        digits += "0123456789abcdef"[half];
    files.emplace_back("h.nrrd",
                       nrrd(fields + "\nencoding: hex", digits.substr(0, 30) + "\n" + digits.substr(30)));
    const std::string of = meta + "BinaryDataByteOrderMSB = " + (order ? "True" : "False") + "\n";
    files.emplace_back("a.mha", of + "ElementDataFile = LOCAL\n" + bytes);
  }
  files.emplace_back("a.nii", nifti.bytes(little));
  files.emplace_back("a.nii.gz", zipped(folder, nifti.bytes(little)));
  return files;
}

// What is looked at while a file is counted is what ITK reads later: no good file is refused for the bytes of
// another machine, or for what lies behind its last value.
TEST(VolumeFile, ValuesAreLookedAtAsTheyAreRead) {
  const TemporaryScene folder;
  const auto taken = [&](auto last) {
    using Value = decltype(last);
    for (const auto& [name, bytes] : filesOf(folder, std::vector<Value>{0, 1, 2, 3, 4, 5, 6, last})) {
      const Volume v = read(folder.write(name, bytes));
      EXPECT_EQ(v.value(7), static_cast<float>(last)) << name << bytes.substr(0, 200);
    }
  };
  taken(1.0000151395797729f);  // 3f80007f: beyond 1e30 with its bytes turned
  taken(1.0000000000000258);   // 3ff000000000007f, as well
  const double beyond = std::numeric_limits<double>::infinity();
  const std::vector<double> more{0, 1, 2, 3, 4, 5, 6, 7, beyond};
  for (const auto& [name, bytes] : filesOf(folder, more))
    EXPECT_TRUE(noted(read(folder.write(name, bytes)), "1 more values")) << name;
}

TEST(VolumeFile, ValuesBeyondTheRangeAreRefusedInEachFormat) {
  const TemporaryScene folder;
  const auto refused = [&](auto last, const std::string& cause) {
    using Value = decltype(last);
    std::vector<Value> values(8, cause == "1e30" ? Value{1} : last);
    values.back() = last;
    for (const auto& [name, bytes] : filesOf(folder, values)) {
      const std::string file = folder.write(name, bytes), message = refusal([&] { read(file); });
      EXPECT_EQ(message.rfind(file + ": ", 0), 0u) << message;
      EXPECT_NE(message.find(cause), std::string::npos) << name << message;
    }
  };
  refused(std::numeric_limits<float>::infinity(), "1e30");
  refused(-std::numeric_limits<double>::infinity(), "1e30");
  refused(2e30f, "1e30");
  refused(std::numeric_limits<float>::quiet_NaN(), "no value is a number");
  refused(std::numeric_limits<double>::quiet_NaN(), "no value is a number");
  // NIfTI's own reader makes 0 of a value that is no number, ITK padding of it: none is refused for one.
  for (const auto& [name, bytes] : filesOf(folder, std::vector<float>{1, 2, 3, 4, 5, 6, 7, std::nanf("")})) {
    const Volume v = read(folder.write(name, bytes));
    EXPECT_TRUE(v.padding(7) || v.value(7) == 0) << name;
  }
  Nifti steep(head());  // whole numbers, of which a slope makes such values
  steep.slope = 1e29f;
  EXPECT_NE(refusal([&] { read(folder.write("a.nii", steep.bytes(valuesOf(head())))); }).find("1e30"),
            std::string::npos);
  const std::string text = kDirections + "type: double\nencoding: ascii";
  EXPECT_NE(refusal([&] { read(folder.write("a.nrrd", nrrd(text, "0 1 2 3 4 5 6 2e30"))); }).find("1e30"),
            std::string::npos);
}

// Packed data are small, what they unpack to is not: a few kB of them took 2 GB before their last value was
// refused.
TEST(VolumeFile, WhatIsRefusedTakesNoMemoryForAllOfItsValues) {
  const TemporaryScene folder;
  constexpr long kValues = 256L * 256 * 256 * 8;  // bytes
  Nifti nifti(head());
  std::fill(nifti.dim + 1, nifti.dim + 4, std::int16_t{256});
  nifti.type = 64, nifti.bits = 64;
  const std::string fields = kDirections + "type: double\nendian: little\nencoding: gzip\n\n";
  const std::string place = folder.folder() + "/";
  folder.write("a.nrrd", "NRRD0004\ndimension: 3\nsizes: 256 256 256\n" + fields);
  folder.write("a.mha",
               "ObjectType = Image\nNDims = 3\nDimSize = 256 256 256\nElementSpacing = 1 1 2\nElementType = "
               "MET_DOUBLE\nCompressedData = True\nElementDataFile = LOCAL\n");
  folder.write("head", nifti.bytes(""));
  const std::string values = "head -c " + std::to_string(kValues - 8) + " /dev/zero; printf '" +
                             R"(\000\000\000\000\000\000\360\177)" + "';";
  ASSERT_EQ(0, std::system(("{ " + values + " } | gzip -n1 > " + place + "zip; cat " + place + "zip >> " +
                            place + "a.nrrd; cat " + place + "zip >> " + place + "a.mha; { cat " + place +
                            "head; " + values + " } | gzip -n1 > " + place + "a.nii.gz")
                               .c_str()));
  for (const char* const name : {"a.nrrd", "a.mha", "a.nii.gz"})
    EXPECT_NE(refusal([&] { read(place + name); }).find("1e30"), std::string::npos) << name;
  rusage children{};
  getrusage(RUSAGE_CHILDREN, &children);
  EXPECT_LT(children.ru_maxrss, kValues / 1024) << "kB";
}

TEST(VolumeFile, WhatIsNoVolumeIsRefusedWithTheCause) {
  const TemporaryScene folder;
  const auto expect = [&](const std::string& name, const std::string& bytes, const std::string& cause) {
    const std::string file = folder.write(name, bytes);
    const std::string message = refusal([&] { read(file); });
    EXPECT_NE(message.find(cause), std::string::npos) << name << ": " << message << "\n"
                                                      << bytes.substr(0, 300);
    EXPECT_EQ(message.rfind(file + ": ", 0), 0u) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  };
  const std::string eight(8, 1), kind = "type: uint8\nencoding: raw";
  expect("a.nrrd", nrrd(kind, eight), "no spacing");
  expect("a.nrrd", nrrd(kDirections + "space units: \"um\" \"um\" \"um\"\n" + kind, eight), "um: must be mm");
  expect("a.nrrd", nrrd("space: scanner-xyz\nspace directions: (1,0,0) (0,1,0) (0,0,2)\n" + kind, eight),
         "scanner");
  expect("a.nrrd", nrrd(kDirections + "data file: /etc/passwd\n" + kind, eight), "data file");
  expect("a.nrrd", nrrd(kDirections + "data file: LIST\n" + kind, eight), "data file");
  std::filesystem::create_symlink("/etc/passwd", folder.folder() + "/a_link.raw");
  expect("a.nrrd", nrrd(kDirections + "data file: a_link.raw\n" + kind, eight), "a_link.raw is a link");
  expect("a.nrrd", nrrd("space: LPS\nspace directions: (1,0,0) (0.5,1,0) (0,0,2)\n" + kind, eight),
         "right angles");
  expect("a.nrrd", nrrd("space: LPS\nspace directions: (1,0,0) (0,1,0) (1,0,0)\n" + kind, eight),
         "direction");
  expect("a.nrrd", nrrd(kDirections + kind, eight.substr(1)), "");
  // ITK reads these as something else without a word.
  expect("a.nrrd", nrrd("space: LPS\nspace directions: (1e308,1e308,0) (0,1,0) (0,0,2)\n" + kind, eight),
         "space directions: 1e308");
  expect("a.nrrd", nrrd("space: LPS\nspace directions: none (0,1,0) (0,0,2)\n" + kind, eight),
         "space directions: 6 numbers");
  expect("a.nrrd", nrrd("space: LPS\nspacings: 1 nan 1\n" + kind, eight), "spacings: nan");
  expect("a.nrrd", nrrd(kDirections + "data file: a.nrrd\n" + kind, eight), "another file than the header");
  expect("a.nrrd", nrrd(kDirections + "type: uint8\nencoding: ascii", "0 1 2 3 4 5 x 7"), "'x' among");
  expect("a.nrrd", nrrd(kDirections + "type: uint8\nencoding: ascii", "0 1 2 3 4 5 6"), "ends before");
  expect("a.nrrd", nrrd(kDirections + "type: uint8\nencoding: hex", "00 01 02 03 04 05 06 0"), "ends before");
  expect("a.nrrd", nrrd(kDirections + "type: uint8\nencoding: hex", "00 01 02 03 04 05 06 0g"), "'g' among");
  expect("a.nrrd", nrrd(kDirections + "type: uint8\nencoding: bzip2", eight), "encoding: bzip2: must be raw");
  const std::string meta = "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\n";
  expect("a.mha", meta + "ElementSpacing = 1 1 1\nElementDataFile =\n" + eight, "data file: must be one");
  expect("a.mha", meta + "ElementSpacing = 1 1 1\nElementDataFile = a.mha\n" + eight, "than the header");
  expect("a.mha", meta + "ElementSpacing = 1 1\nElementDataFile = LOCAL\n" + eight, "elementspacing: 2");
  expect("a.mha", meta + "ElementSpacing = 1 1 1\nOffset = 1 x 1\nElementDataFile = LOCAL\n" + eight,
         "offset: x");
  expect("a.mha", meta + "ElementSpacing = 1 1 1\nBinaryData = False\nElementDataFile = LOCAL\n" + eight,
         "among its values");
  Nifti none(head());
  none.dim[2] = 0;
  expect("a.nii", none.bytes(valuesOf(head())), "dim[2]: 0");
  Nifti narrow(head());
  narrow.bits = 8;
  expect("a.nii", narrow.bytes(valuesOf(head())), "bitpix: 8: must be 16");
  // Of which NIfTI's own reader makes 1 mm, or no shift.
  const std::string whole = Nifti(head()).bytes(valuesOf(head()));
  const auto without = [&](std::size_t at, float value) {
    std::string bytes = whole;
    std::memcpy(&bytes[at], &value, sizeof value);
    return bytes;
  };
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  for (const float value : {kNan, std::numeric_limits<float>::infinity()})
    expect("a.nii", without(84, value), "pixdim: not a finite number");
  expect("a.nii", without(292, kNan), "srow: not a finite number");
  std::string turned = without(268, kNan);
  turned[252] = 1;
  expect("a.nii", turned, "qoffset: not a finite number");
  expect("a.nrrd", "NRRD0004\ndimension: 2\nsizes: 4 2\nspacings: 1 1\n" + kind + "\n\n" + eight, "picture");
  expect("a.nrrd",
         "NRRD0004\ndimension: 4\nsizes: 3 2 2 2\nkinds: RGB-color domain domain domain\nspace: LPS\n"
         "space directions: none (1,0,0) (0,1,0) (0,0,2)\n" +
             kind + "\n\n" + eight + eight + eight,
         "3 numbers a voxel");
  expect(
      "a.mha",
      "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n" +
          eight,
      "no spacing");
  expect("a.mha",
         "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementSpacing = 1 1 -1\nElementType = MET_UCHAR\n"
         "ElementDataFile = LOCAL\n" +
             eight,
         "spacing");
  expect("a.mha",
         "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementSpacing = 1 1 1\nElementType = MET_UCHAR\n"
         "ElementToIntensityFunctionSlope = 2\nElementDataFile = LOCAL\n" +
             eight,
         "slope: 2");
  expect("a.mhd",
         "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementSpacing = 1 1 1\nElementType = MET_UCHAR\n"
         "ElementDataFile = ../a.raw\n",
         "data file");
  expect("a.mha",
         "ObjectType = Image\nNDims = 3\nDimSize = 2000 2000 2000\nElementSpacing = 1 1 1\n"
         "ElementType = MET_UCHAR\nElementDataFile = LOCAL\n" +
             eight,
         "2^28");
  Nifti phases(head());
  phases.dim[0] = 4, phases.dim[4] = 2;
  expect("a.nii", phases.bytes(valuesOf(head()) + valuesOf(head())), "phase");
  Nifti sheared(head());
  sheared.affine[1][2] = 0.3f * sheared.affine[2][2];
  expect("a.nii", sheared.bytes(valuesOf(head())), "orthonormal");
  Nifti metres(head());
  metres.units = 1;
  expect("a.nii", metres.bytes(valuesOf(head())), "must be mm");
  for (const char* const name : {"a.nrrd", "a.mha", "a.mhd", "a.nii", "a.nii.gz"})
    for (const std::string& bytes : {std::string(), std::string(5000, '\0'), std::string(100000, 'A')})
      expect(name, bytes, "");
  std::filesystem::remove(folder.folder() + "/a.nii");
  ASSERT_EQ(0, std::system(("mkfifo " + folder.folder() + "/a.nii").c_str()));
  EXPECT_NE(refusal([&] { read(folder.folder() + "/a.nii"); }).find("regular"), std::string::npos);
  write(head(), folder.folder() + "/b.nrrd");
  EXPECT_NE(refusal([&] {
              read(folder.folder() + "/b.nrrd", {"2", false});
            }).find("--series"),
            std::string::npos);
}

struct Sample {
  const char* name;
  std::string (*make)(const TemporaryScene&);
};
class DamagedVolume : public ::testing::TestWithParam<Sample> {};

std::string exported(const TemporaryScene& folder, const char* name) {
  write(head(), folder.folder() + "/" + name);
  return vest::test::bytesOf(folder.folder() + "/" + name);
}

TEST_P(DamagedVolume, ShorterFilesAreRefusedByName) {
  const TemporaryScene folder;
  const std::string whole = GetParam().make(folder);
  const bool full = std::getenv("VEST_FULL") != nullptr;
  expectHead(read(folder.write(GetParam().name, whole)));
  for (std::size_t length = 0; length < whole.size(); length += full ? 1 : whole.size() / 40) {
    const std::string file = folder.write(GetParam().name, whole.substr(0, length));
    const std::string message = refusal([&] { read(file); });
    ASSERT_EQ(message.rfind(file + ": ", 0), 0u) << length << " of " << whole.size() << ": " << message;
    ASSERT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

TEST_P(DamagedVolume, ChangedBytesAreTakenOrRefused) {
  const TemporaryScene folder;
  const std::string whole = GetParam().make(folder), ending = GetParam().name;
  const bool zip =
      ending.find(".gz") != std::string::npos;  // its checksum knows each change, behind its head
  std::mt19937 random(11);
  const int count = std::getenv("VEST_FULL") != nullptr ? 20000 : 60;
  std::printf("count: %d of 20000 damaged files\n", count);
  for (int n = 0; n < count; ++n) {
    std::string changed = whole;
    for (unsigned c = 0; c <= random() % 4; ++c)
      changed[random() % (n % 2 == 0 ? whole.size() : 400)] = static_cast<char>(random());
    const std::string file = folder.write(ending, changed);
    Volume v;
    const std::string message = refusal([&] { v = read(file); });
    ASSERT_EQ(message.find('\n'), std::string::npos) << message;
    if (!message.empty()) {
      ASSERT_EQ(message.rfind(file + ": ", 0), 0u) << message;
    } else {
      ASSERT_FALSE(zip && changed.substr(10) != whole.substr(10)) << n;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Formats, DamagedVolume,
    ::testing::Values(Sample{"a.nrrd", [](const TemporaryScene& f) { return exported(f, "a.nrrd"); }},
                      Sample{"a.mha", [](const TemporaryScene& f) { return exported(f, "a.mha"); }},
                      Sample{"b.nrrd",
                             [](const TemporaryScene& f) {
                               const std::string whole = exported(f, "b.nrrd"), values = valuesOf(head());
                               std::string head = whole.substr(0, whole.size() - values.size());
                               head.replace(head.find("encoding: raw"), 13, "encoding: gzip");
                               return head + zipped(f, values);
                             }},
                      Sample{"a.nii",
                             [](const TemporaryScene&) { return Nifti(head()).bytes(valuesOf(head())); }},
                      Sample{"a.nii.gz", [](const TemporaryScene& f) {
                               return zipped(f, Nifti(head()).bytes(valuesOf(head())));
                             }}));

}  // namespace
