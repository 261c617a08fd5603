// Protects what haptic processes stake a hand on: no torn model is ever taken for a whole one.
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <stdexcept>
#include <thread>

#include <gtest/gtest.h>

#include "vest_tissue/shared/contact_memory.h"

using namespace vest::shared;

namespace {

class ContactMemory : public ::testing::Test {
 protected:
  const std::string name_ = "/vest_test_contacts_" + std::to_string(::getpid());
  void TearDown() override { ::shm_unlink(name_.c_str()); }
};

/// Every number of the image says the same k: a mixture of two images is seen at once.
ContactImage image(std::uint64_t k) {
  ContactImage i;
  i.step = k;
  i.steady_ns = static_cast<std::int64_t>(k);
  for (auto& c : i.contacts) {
    c.flags = k;
    for (double& x : c.wrench) x = static_cast<double>(k);
    for (double& x : c.stiffness) x = static_cast<double>(k);
    c.jaw_torque = static_cast<double>(k);
  }
  return i;
}

bool whole(const ContactImage& i) {
  const auto k = static_cast<double>(i.step);
  if (static_cast<std::uint64_t>(i.steady_ns) != i.step) return false;
  for (const auto& c : i.contacts) {
    if (c.flags != i.step || c.jaw_torque != k) return false;
    for (const double x : c.wrench) {
      if (x != k) return false;
    }
    for (const double x : c.stiffness) {
      if (x != k) return false;
    }
  }
  return true;
}

}  // namespace

TEST_F(ContactMemory, AReaderNeverTakesATornImageWhileTheWriterWritesAsFastAsItCan) {
  ContactWriter writer(name_);
  writer.write(image(1));
  std::atomic<bool> stop{false};
  std::thread writing([&] {
    for (std::uint64_t k = 2; !stop; ++k) writer.write(image(k));
  });
  ContactReader reader(name_);
  ASSERT_EQ(reader.connect(), "");
  ContactImage got;
  std::uint64_t reads = 0, last = 0, torn = 0, backwards = 0;
  // How many attempts meet a writer at work is the scheduler's business; how many images are enough is ours.
  for (std::uint64_t attempts = 0; reads < 1000 && attempts < 200'000'000; ++attempts) {
    if (!reader.read(got)) continue;
    ++reads;
    torn += !whole(got);
    backwards += got.step < last;
    last = got.step;
  }
  stop = true;
  writing.join();
  EXPECT_EQ(reads, 1000u);
  EXPECT_EQ(torn, 0u);
  EXPECT_EQ(backwards, 0u);
}

TEST_F(ContactMemory, AWriterThatDiedWhileItWroteLeavesNothingToRead) {
  ContactWriter writer(name_);
  writer.write(image(7));
  ContactReader reader(name_);
  ASSERT_EQ(reader.connect(), "");
  const int fd = ::shm_open(name_.c_str(), O_RDWR, 0600);
  auto* page = static_cast<ContactPage*>(
      ::mmap(nullptr, sizeof(ContactPage), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0));
  ::close(fd);
  page->sequence += 1;  // killed in the middle
  page->words[100] = 12345;
  ContactImage got = image(3);
  EXPECT_FALSE(reader.read(got));
  EXPECT_EQ(got.step, 3u) << "what the reader had is untouched";

  ContactWriter next(name_);
  EXPECT_FALSE(reader.read(got)) << "the torn image stays hidden until the new writer has written";
  EXPECT_GT(next.generation(), writer.generation());
  next.write(image(9));
  ASSERT_TRUE(reader.read(got)) << "a reader keeps its mapping across a restart of the simulation";
  EXPECT_EQ(got.step, 9u);
  EXPECT_EQ(got.generation, next.generation());
  ::munmap(page, sizeof(ContactPage));
}

TEST_F(ContactMemory, AnotherLayoutAMissingAndAShortMemoryAreRefusedInWords) {
  ContactReader reader(name_);
  EXPECT_NE(reader.connect().find("no simulation has made it yet"), std::string::npos);
  ContactImage got;
  EXPECT_FALSE(reader.read(got));
  const int fd = ::shm_open(name_.c_str(), O_RDWR | O_CREAT, 0600);
  ASSERT_EQ(::ftruncate(fd, 64), 0);
  EXPECT_NE(reader.connect().find("smaller"), std::string::npos);
  ::close(fd);
  {
    ContactWriter writer(name_);
    const int again = ::shm_open(name_.c_str(), O_RDWR, 0600);
    auto* page = static_cast<ContactPage*>(
        ::mmap(nullptr, sizeof(ContactPage), PROT_READ | PROT_WRITE, MAP_SHARED, again, 0));
    ::close(again);
    page->version = 99;
    EXPECT_NE(reader.connect().find("version 99; allowed: 2"), std::string::npos);
    ::munmap(page, sizeof(ContactPage));
  }
}

TEST_F(ContactMemory, AWriterInAnotherProcessIsSeen) {
  const pid_t child = ::fork();
  if (child == 0) {
    ContactWriter writer(name_);
    writer.write(image(42));
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  ContactReader reader(name_);
  ASSERT_EQ(reader.connect(), "");
  ContactImage got;
  ASSERT_TRUE(reader.read(got));
  EXPECT_EQ(got.step, 42u);
}

namespace {

vest::voxel::Volume volume(double slope) {
  vest::voxel::Volume v;
  v.header.size[0] = 3, v.header.size[1] = 4, v.header.size[2] = 5;
  v.header.rows = 1;
  v.header.slope = slope;
  for (int a = 0; a < 3; ++a) v.header.to_grid[a][a] = 1000;
  for (std::int16_t n = 0; n < 60; ++n) {
    v.stored.push_back(n);
    v.region.push_back(static_cast<std::uint8_t>(n % 3));
  }
  return v;
}

}  // namespace

TEST_F(ContactMemory, AVolumeComesWholeAndOnlyUnderItsNumber) {
  ContactWriter writer(name_);
  ContactReader reader(name_);
  const std::uint64_t first = writer.shareVolume(volume(1));
  ASSERT_EQ(reader.connect(), "");
  EXPECT_FALSE(reader.volume(0));
  EXPECT_FALSE(reader.volume(first + 1)) << "that of another scene";
  const vest::voxel::View view = reader.volume(first);
  ASSERT_TRUE(view);
  EXPECT_EQ(view.stored[59], 59);
  EXPECT_EQ(view.region[59], 2);
  EXPECT_DOUBLE_EQ(vest::voxel::sampleValue(view, {0.001, 0.0015, 0.002}).share, 1.0);
  // Another scene: the one before stays readable until its reader has looked.
  const std::uint64_t second = writer.shareVolume(volume(2));
  EXPECT_TRUE(reader.volume(first));
  EXPECT_FALSE(reader.volume(second));
  EXPECT_EQ(reader.connect(), "");
  EXPECT_FALSE(reader.volume(first));
  ASSERT_TRUE(reader.volume(second));
  EXPECT_EQ(reader.volume(second).header->slope, 2.0);
  EXPECT_EQ(view.stored[59], 59) << "a tick that still works with it does not crash";
}

TEST_F(ContactMemory, AVolumeThatIsNotSoundIsNotShared) {
  ContactWriter writer(name_);
  auto bad = volume(1);
  bad.header.size[0] = 4;
  EXPECT_THROW(writer.shareVolume(bad), std::runtime_error) << "more voxels than there are";
  bad = volume(1);
  bad.header.table[0].yield = NAN;
  EXPECT_THROW(writer.shareVolume(bad), std::runtime_error);
  ContactReader reader(name_);
  EXPECT_EQ(reader.connect(), "");
  EXPECT_FALSE(reader.volume(1));
}

TEST(ContactMemoryName, SessionsOnOneMachineGetMemoriesOfTheirOwn) {
  const std::string a = contactMemoryName("http://localhost:11311/", "/vest");
  EXPECT_NE(a, contactMemoryName("http://localhost:11312/", "/vest"));
  EXPECT_NE(a, contactMemoryName("http://localhost:11311/", "/lab/vest"));
  EXPECT_EQ(a.rfind('/'), 0u) << "shm_open wants exactly one slash, in front";
}
