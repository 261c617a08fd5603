// A patient's images: every kind of file is read as it was meant, or refused with cause and file. Never is a
// grid made even that is not.
#include <sys/resource.h>

#include <cmath>
#include <fstream>

#include <gtest/gtest.h>

#include "phantom_files.h"
#include "vest_tissue/image/volume.h"

namespace {

using namespace vest::image;
using vest::test::refusal;
using vest::test::SeriesFolder;

const Volume& head() {
  static const Volume volume = vest::test::headOf(32, 12);
  return volume;
}

Volume readFault(const std::string& fault, const ReadOptions& options = {}) {
  const SeriesFolder files(head(), fault);
  return read(files.folder(), options);
}

void expectSameGrid(const Volume& a, const Volume& b) {
  EXPECT_EQ(a.size, b.size);
  EXPECT_TRUE(a.axes.isApprox(b.axes, 1e-8)) << a.axes << "\n\n" << b.axes;
  EXPECT_LT((a.origin - b.origin).norm(), 1e-9);
}

bool noted(const Volume& v, const std::string& word) {
  for (const auto& note : v.notes)
    if (note.find(word) != std::string::npos) return true;
  return false;
}

class Taken : public ::testing::TestWithParam<const char*> {};

TEST_P(Taken, ValuesAndGridAreThoseOfThePhantom) {
  const Volume v = readFault(GetParam());
  expectSameGrid(v, head());
  EXPECT_EQ(v.unit, "HU");
  EXPECT_FALSE(v.resampled);
  ASSERT_TRUE(v.whole != nullptr);
  for (std::size_t i = 0; i < v.voxels(); ++i) ASSERT_EQ(v.value(i), head().value(i)) << i;
}

INSTANTIATE_TEST_SUITE_P(Dicom, Taken,
                         ::testing::Values("none", "implicit", "slopes", "monochrome1", "rle", "jpeg",
                                           "jpeg_ls", "jpeg2000", "multi_frame", "multi_frame_jpeg2000",
                                           "duplicate", "localizer", "report"));

struct Refusal {
  const char *fault, *cause, *file;
};
class Refused : public ::testing::TestWithParam<Refusal> {};

TEST_P(Refused, NamesCauseAndFile) {
  const SeriesFolder files(head(), GetParam().fault);
  const std::string message = refusal([&] { read(files.folder()); });
  EXPECT_NE(message.find(GetParam().cause), std::string::npos) << message;
  EXPECT_NE(message.find(files.folder() + "/" + GetParam().file), std::string::npos) << message;
  EXPECT_EQ(message.find('\n'), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(
    Dicom, Refused,
    ::testing::Values(
        Refusal{"spacing", "spacing", "I0007"}, Refusal{"sideways", "spacing", "I0007"},
        Refusal{"missing", "missing slice", "I0007"}, Refusal{"gap", "missing slice", "I0007"},
        Refusal{"contradiction", "duplicate", "I0013"}, Refusal{"mixed", "mixed series", "I0013"},
        Refusal{"phases", "mixed series", "I0013"}, Refusal{"sizes", "mixed series", "I0007"},
        Refusal{"directions", "mixed series", "I0007"}, Refusal{"only_report", "report", "I0001"},
        Refusal{"multi_frame_no_position", "no position", "I0001"}, Refusal{"colour", "colour", "I0001"},
        Refusal{"no_position", "no position", "I0001"}, Refusal{"no_spacing", "no pixel spacing", "I0001"}));

TEST(Dicom, ASliceThatIsMissingAtAnEndIsNotedByTheNumbersOfTheOthers) {
  for (const char* const fault : {"no_first", "no_last"}) {
    const Volume v = readFault(fault);
    EXPECT_EQ(v.size[2], 11u);
    EXPECT_TRUE(noted(v, "missing slice at an end? 11 pictures, numbered ")) << fault;
    EXPECT_TRUE(noted(v, "the acquisition has 12")) << fault;
  }
  EXPECT_FALSE(noted(readFault("none"), "missing"));
  EXPECT_FALSE(noted(readFault("duplicate"), "missing"));
}

TEST(Dicom, OrderIsThatOfPlacesWhateverTheNames) {
  const SeriesFolder files(head(), "none");
  namespace fs = std::filesystem;
  for (int k = 1; k <= 12; ++k) {
    char name[16];
    std::snprintf(name, sizeof name, "/I%04d", k);
    fs::rename(files.folder() + name, files.folder() + "/" + std::string(1, "qwertyuiopas"[k - 1]) + ".dcm");
  }
  std::ofstream(files.folder() + "/README.txt") << "words beside the images";
  const Volume v = read(files.folder());
  EXPECT_TRUE(noted(v, "README.txt"));
  for (std::uint32_t k = 0; k < 12; ++k) EXPECT_EQ(checksum(v, k), checksum(head(), k));
}

TEST(Dicom, TiltKeepsItsShearedAxes) {
  const Volume v = readFault("tilt");
  EXPECT_NEAR(v.tilt(), M_PI / 12, 1e-9);
  EXPECT_TRUE(noted(v, "tilt"));
  Eigen::Vector3d step = head().axes.col(2);
  step[1] += std::tan(M_PI / 12) * step[2];
  EXPECT_LT((v.axes.col(2) - step).norm(), 1e-9);
  for (const std::size_t voxel : {0u, 5000u, 9999u}) {
    const std::size_t i = voxel % 32, j = voxel / 32 % 28, k = voxel / (32 * 28);
    EXPECT_EQ(v.nearest(v.origin + v.axes * Eigen::Vector3d(i + 0.3, j - 0.0, k + 0.4)), voxel);
  }
  EXPECT_FALSE(v.nearest(v.origin - 0.6 * v.axes.col(0)));
}

// An image that is linear in space is the same after linear interpolation, however its slices lie.
class Resampled : public ::testing::TestWithParam<const char*> {};

TEST_P(Resampled, LinearFieldStaysWhereItWas) {
  PhantomImage options;
  options.size = {24, 20, 10};
  Volume ramp = picture(makePhantom("head"), options);
  const auto field = [&](const Eigen::Vector3d& place) {
    return 3000 * place[0] + 2000 * place[1] + 4000 * place[2];
  };
  const std::string fault = GetParam();
  const auto values =
      std::shared_ptr<std::int16_t>(new std::int16_t[ramp.voxels()], std::default_delete<std::int16_t[]>());
  for (std::size_t v = 0; v < ramp.voxels(); ++v) {
    const auto i = v % 24, j = v / 24 % 20, k = v / 480;
    Eigen::Vector3d place = ramp.origin + ramp.axes * Eigen::Vector3d(i, j, k);
    if (fault == "tilt") place[1] += std::tan(M_PI / 12) * place[2];
    if (fault == "spacing" && k == 5) place[2] += 0.2 * ramp.axes(2, 2);
    if (fault == "sideways" && k == 5) place[0] += 2 * ramp.axes(0, 0);
    values.get()[v] = static_cast<std::int16_t>(std::lround(field(place)));
  }
  ramp.whole = values;
  const SeriesFolder files(ramp, fault);
  ReadOptions with;
  with.resample = true;
  const Volume v = read(files.folder(), with);
  EXPECT_TRUE(v.resampled);
  EXPECT_TRUE(noted(v, "resampled"));
  EXPECT_LT(v.tilt(), 1e-9);
  EXPECT_EQ(v.size[2], 10u);
  std::size_t inside = 0;
  for (std::size_t n = 0; n < v.voxels(); ++n) {
    if (v.padding(n)) continue;
    ++inside;
    const auto i = n % v.size[0], j = n / v.size[0] % v.size[1], k = n / v.layer();
    ASSERT_NEAR(v.value(n), field(v.origin + v.axes * Eigen::Vector3d(i, j, k)), 1.01)
        << i << " " << j << " " << k;
  }
  EXPECT_GT(inside, ramp.voxels() * 8 / 10);
}

INSTANTIATE_TEST_SUITE_P(Dicom, Resampled, ::testing::Values("tilt", "spacing", "sideways", "missing"));

TEST(Dicom, AWideGapIsNotBridged) {
  ReadOptions with;
  with.resample = true;
  const std::string message = refusal([&] { readFault("gap", with); });
  EXPECT_NE(message.find("at most two distances"), std::string::npos) << message;
}

TEST(Dicom, PaddingHasTheSignOfThePixelsAndNoPartInStatistics) {
  for (const char* const fault : {"padding", "padding_range", "big_endian"}) {
    const Volume v = readFault(fault);
    std::size_t padded = 0;
    for (std::size_t i = 0; i < v.voxels(); ++i) {
      const double x = 2.0 * (i % 32) / 32 - 1, y = 2.0 * (i / 32 % 28) / 28 - 1;
      ASSERT_EQ(v.padding(i), x * x + y * y > 1) << fault << " " << i;
      ASSERT_TRUE(v.padding(i) || v.value(i) == head().value(i)) << fault << " " << i;
      padded += v.padding(i);
    }
    const Statistics s = statistics(v);
    EXPECT_EQ(s.count + padded, v.voxels());
    EXPECT_GE(s.min, -1024) << fault;
  }
}

TEST(Dicom, ValuesThatAreNoWholeNumbersAreKept) {
  const Volume v = readFault("odd_slopes");
  ASSERT_TRUE(v.real != nullptr);
  // 0.25 · stored - 1024.125: stored rounds to the nearest, so values lie within an eighth of the phantom's.
  for (std::size_t i = 0; i < v.voxels(); ++i) ASSERT_NEAR(v.value(i), head().value(i), 0.1251);
  EXPECT_EQ(std::fmod(std::abs(v.value(0)), 0.25), 0.125);
}

TEST(Dicom, OneOfSeveralSeriesIsChosen) {
  for (const char* const which : {"2", "2.25.2017.2"}) {
    ReadOptions options;
    options.series = which;
    const Volume v = readFault("mixed", options);
    expectSameGrid(v, head());
    EXPECT_NE(v.slices[0].file.find("I0013"), std::string::npos);
  }
  ReadOptions third;
  third.series = "3";
  EXPECT_NE(refusal([&] { readFault("mixed", third); }).find("--series 3"), std::string::npos);
}

TEST(Dicom, ASingleSliceIsAsThickAsItSays) {
  const SeriesFolder files(head(), "none");
  const Volume v = read(files.folder() + "/I0004");
  EXPECT_EQ(v.size, (std::array<std::uint32_t, 3>{32, 28, 1}));
  EXPECT_NEAR(v.spacing()[2], head().spacing()[2], 1e-9);
  EXPECT_TRUE(noted(v, "single slice"));
}

// CRC-32 of "123456789" is cbf43926 (its published check value); two bytes a voxel, the low one first.
TEST(Dicom, ChecksumIsCrc32OfLittleEndianValues) {
  Volume v;
  v.size = {4, 1, 1};
  v.slices.resize(1);
  const auto values = std::shared_ptr<std::int16_t>(new std::int16_t[4]{0x3231, 0x3433, 0x3635, 0x3837},
                                                    std::default_delete<std::int16_t[]>());
  v.whole = values;
  EXPECT_EQ(checksum(v, 0), 0x9ae0daafu);  // of "12345678"
}

TEST(Dicom, TwentyEightSlicesOf512TakeLessThan200Megabytes) {
  PhantomImage options;
  options.size = {512, 512, 28};
  const SeriesFolder files(picture(makePhantom("head"), options), "none");
  const Volume v = read(files.folder());
  EXPECT_EQ(v.voxels(), 512u * 512 * 28);
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    getrusage(who, &usage);
    EXPECT_LT(usage.ru_maxrss, 200 * 1024) << "kB";
  }
}

std::string bytesOf(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(Export, NrrdAndMetaImageSayWhereVoxelsLie) {
  const vest::test::TemporaryScene folder;
  const std::string nrrd = folder.folder() + "/head.nrrd", mha = folder.folder() + "/head.mha";
  write(head(), nrrd), write(head(), mha);
  const std::string values(reinterpret_cast<const char*>(head().whole.get()), 2 * head().voxels());
  for (const auto& [file, words] : {std::pair(nrrd, "\nspace directions: (6.25,0,0) (0,8.57142857142857"),
                                    std::pair(mha, "\nElementSpacing = 6.25 8.57142857142857")}) {
    const std::string bytes = bytesOf(file);
    EXPECT_NE(bytes.find(words), std::string::npos) << bytes.substr(0, 500);
    EXPECT_TRUE(bytes.size() > values.size() && bytes.substr(bytes.size() - values.size()) == values);
  }
  EXPECT_NE(refusal([&] { write(readFault("tilt"), mha); }).find("sheared"), std::string::npos);
  EXPECT_NE(refusal([&] { write(head(), folder.folder() + "/head.jpg"); }).find("ending"), std::string::npos);
}

}  // namespace
