// Damaged DICOM: one message that names the file, or the right values; never a crash, never others' slices.
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>

#include <gtest/gtest.h>

#include "phantom_files.h"

namespace {

using namespace vest::image;
using vest::test::bytesOf;
using vest::test::refusal;
using vest::test::SeriesFolder;

bool full() {
  return std::getenv("VEST_FULL") != nullptr;
}

class Damaged : public ::testing::TestWithParam<const char*> {};

TEST_P(Damaged, ShorterFilesAreRefusedByName) {
  const Volume volume = vest::test::headOf(24, 8);
  const SeriesFolder files(volume, GetParam());
  const std::string file = files.folder() + "/I0001", bytes = bytesOf(file);
  const Volume whole = read(files.folder());
  const std::size_t step = full() ? 1 : bytes.size() / 60;
  std::size_t taken = 0;
  for (std::size_t length = 0; length < bytes.size(); length += step) {
    std::ofstream(file, std::ios::binary) << bytes.substr(0, length);
    Volume v;
    const std::string message = refusal([&] { v = read(files.folder()); });
    if (message.empty()) {
      ++taken;  // nothing but an end mark is lost
      ASSERT_EQ(v.size, whole.size) << length;
      for (std::size_t i = 0; i < v.voxels(); ++i)
        ASSERT_EQ(v.value(i), whole.value(i)) << length << " of " << bytes.size();
    } else {
      ASSERT_NE(message.find(file), std::string::npos) << length << ": " << message;
    }
  }
  EXPECT_LE(taken, full() ? 16u : 2u);
}

TEST_P(Damaged, ChangedBytesAreTakenOrRefused) {
  const Volume volume = vest::test::headOf(24, 8);
  const SeriesFolder files(volume, GetParam());
  const std::string file = files.folder() + "/I0001", bytes = bytesOf(file);
  std::mt19937 random(7);
  const int count = full() ? 20000 : 60;
  std::printf("count: %d of 20000 damaged slices\n", count);
  for (int n = 0; n < count; ++n) {
    std::string changed = bytes;
    for (unsigned c = 0; c <= random() % 4; ++c)
      changed[random() % bytes.size()] = static_cast<char>(random());
    std::ofstream(file, std::ios::binary) << changed;
    const std::string message = refusal([&] { read(files.folder()); });
    ASSERT_TRUE(message.empty() || message.find(files.folder()) != std::string::npos) << message;
    ASSERT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

INSTANTIATE_TEST_SUITE_P(Dicom, Damaged, ::testing::Values("none", "rle", "jpeg", "jpeg2000", "multi_frame"));

TEST(Damaged, WhatIsNoDicomIsRefusedByName) {
  const SeriesFolder files(vest::test::headOf(24, 8), "none");
  const std::string file = files.folder() + "/I0001";
  for (const std::string& bytes :
       {std::string(), std::string(5000, '\0'), std::string(5000, '\xff'), std::string("word"),
        std::string(128, '\0') + "DICM", std::string(100000, 'A')}) {
    std::ofstream(file, std::ios::binary) << bytes;
    const std::string message = refusal([&] { read(files.folder()); });
    EXPECT_NE(message.find(file), std::string::npos) << message;
  }
  std::filesystem::remove(file);
  ASSERT_EQ(0, std::system(("mkfifo " + file).c_str()));
  EXPECT_NE(refusal([&] { read(files.folder()); }).find("regular"), std::string::npos);
  std::filesystem::remove(file);
  std::ofstream(files.folder() + "/readme.txt").close();
  EXPECT_EQ(refusal([&] { read(files.folder()); }), "") << "an empty file beside the images says nothing";
  // As /proc/kmsg, which root may open and which never ends: a file without a size, that nobody begins to
  // read.
  EXPECT_EQ(refusal([&] { read("/proc/self/status"); }), "/proc/self/status: is empty");
}

}  // namespace
