#include "vest_tissue/shared/contact_memory.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <ctime>
#include <stdexcept>

namespace vest::shared {

std::string contactMemoryName(const std::string& master_uri, const std::string& ns) {
  std::string name = "/vest_contacts_" + std::to_string(::getuid());
  const auto colon = master_uri.rfind(':');
  for (const std::string& part :
       {colon == std::string::npos ? std::string() : master_uri.substr(colon + 1), ns}) {
    name += '_';
    for (const char c : part) {
      const bool plain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
      if (plain)
        name += c;
      else if (name.back() != '_')
        name += '_';
    }
    while (name.back() == '_') name.pop_back();
  }
  return name.substr(0, 200);
}

namespace {

constexpr std::uint64_t kVolumeMagic = 0x31'4c4f'5654'5345'56ull;  // "VESTVOL1", little-endian
constexpr std::uint64_t kVolumeVersion = 1;
constexpr std::size_t kMostVoxels = (std::size_t{64} << 20) / 3;

// Behind it lie all numbers as stored, then the region of each voxel.
struct VolumePage {
  std::atomic<std::uint64_t> number;  // last to be written; 0: not whole yet
  std::uint64_t magic, version;
  voxel::Header header;
};

std::string volumeName(const std::string& name) {
  return name + "_volume";
}

std::size_t voxelsOf(const voxel::Header& h) {
  std::size_t n = 1;
  for (const std::uint32_t s : h.size) n = s > 0 && s <= 65536 && n <= kMostVoxels ? n * s : 0;
  return n <= kMostVoxels ? n : 0;
}

bool sound(const voxel::Header& h) {
  bool all = voxelsOf(h) > 0 && h.rows >= 1 && h.rows <= voxel::kMostRows;
  const auto look = [&](double x, double least) { all = all && std::isfinite(x) && x >= least; };
  for (const auto& row : h.to_grid)
    for (const double x : row) look(x, -1e12);
  for (const double x : {h.needle_stiffness, h.radius}) look(x, 0);
  for (const double x : {h.slope, h.intercept, h.surface}) look(x, -1e12);
  for (const double x : h.depth) look(x, 0);
  for (const double x : h.weight) look(x, 0);
  for (const double x : h.capsule) look(x, 0);
  for (std::uint32_t r = 0; all && r < h.rows; ++r) {
    const voxel::Feel& f = h.table[r];
    look(f.value, r > 0 ? h.table[r - 1].value : -1e12);
    for (const double x : {f.stiffness, f.yield, f.viscosity, f.friction}) look(x, 0);
  }
  return all;
}

}  // namespace

ContactWriter::ContactWriter(const std::string& name) : name_(name) {
  const auto fail = [&](const std::string& what) {
    throw std::runtime_error("contact memory '" + name + "': " + what);
  };
  const int fd = ::shm_open(name.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (fd < 0) fail(std::string(std::strerror(errno)) + "; allowed: a name that belongs to this user");
  struct stat info {};
  if (::fstat(fd, &info) != 0 || info.st_uid != ::geteuid() ||
      (info.st_size < static_cast<off_t>(sizeof(ContactPage)) && ::ftruncate(fd, sizeof(ContactPage)) != 0)) {
    ::close(fd);
    fail("cannot be set up for this user");
  }
  void* memory = ::mmap(nullptr, sizeof(ContactPage), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  ::close(fd);
  if (memory == MAP_FAILED) fail(std::strerror(errno));
  page_ = static_cast<ContactPage*>(memory);
  if (page_->magic == kContactMagic && page_->version == kContactVersion) {
    // Generations go on. If the one before died while it wrote, the sequence stays odd until the first write:
    // nobody reads the torn image.
    generation_ = page_->words[1].load() + 1;
  } else {
    page_->sequence.store(0);
    for (auto& word : page_->words) word.store(0, std::memory_order_relaxed);
    page_->bytes.store(sizeof(ContactPage));
    page_->version.store(kContactVersion);
    generation_ = 1;
    page_->magic.store(kContactMagic);
  }
}

ContactWriter::~ContactWriter() {
  if (volume_) ::shm_unlink(volumeName(name_).c_str());
  if (page_) ::munmap(page_, sizeof(ContactPage));
}

std::uint64_t ContactWriter::shareVolume(const voxel::Volume& volume) {
  const std::string name = volumeName(name_);
  const std::size_t voxels = volume.stored.size(), bytes = sizeof(VolumePage) + 3 * voxels;
  const auto fail = [&](const std::string& what) {
    throw std::runtime_error("memory of a volume '" + name + "': " + what);
  };
  if (!sound(volume.header) || voxelsOf(volume.header) != voxels || volume.region.size() != voxels)
    fail("its size or table is not sound");
  ::shm_unlink(name.c_str());  // readers of the one before keep what they have mapped
  const int fd = ::shm_open(name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (fd < 0) fail(std::strerror(errno));
  volume_ = true;
  // Room is taken now: a memory that is full would end the process at the first write.
  if (const int full = ::posix_fallocate(fd, 0, static_cast<off_t>(bytes))) {
    ::close(fd);
    fail(std::strerror(full));
  }
  void* const memory = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  ::close(fd);
  if (memory == MAP_FAILED) fail(std::strerror(errno));
  auto* const page = static_cast<VolumePage*>(memory);
  page->magic = kVolumeMagic;
  page->version = kVolumeVersion;
  page->header = volume.header;
  auto* const stored = reinterpret_cast<char*>(page + 1);
  std::memcpy(stored, volume.stored.data(), 2 * voxels);
  std::memcpy(stored + 2 * voxels, volume.region.data(), voxels);
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  const std::uint64_t number =
      static_cast<std::uint64_t>(now.tv_sec) * 1000000000u + static_cast<std::uint64_t>(now.tv_nsec) + 1;
  page->number.store(number, std::memory_order_release);
  ::munmap(memory, bytes);
  return number;
}

void ContactWriter::write(const ContactImage& image) noexcept {
  std::array<std::uint64_t, kContactWords> words;
  std::memcpy(words.data(), &image, sizeof image);
  words[1] = generation_;
  const std::uint64_t sequence = page_->sequence.load(std::memory_order_relaxed);
  page_->sequence.store(sequence | 1, std::memory_order_relaxed);
  std::atomic_thread_fence(std::memory_order_release);
  for (std::size_t i = 0; i < kContactWords; ++i) page_->words[i].store(words[i], std::memory_order_relaxed);
  page_->sequence.store((sequence | 1) + 1, std::memory_order_release);
}

struct ContactReader::Mapped {
  std::uint64_t number = 0;
  voxel::Header header;  // checked, so a copy
  void* memory = nullptr;
  std::size_t bytes = 0;
  ~Mapped() {
    if (memory) ::munmap(memory, bytes);
  }
};

std::string ContactReader::connectVolume() {
  const std::string name = volumeName(name_);
  const int fd = ::shm_open(name.c_str(), O_RDONLY | O_CLOEXEC, 0);
  if (fd < 0) return {};  // no scene with a volume
  const std::string prefix = "memory of a volume '" + name + "': ";
  struct stat info {};
  if (::fstat(fd, &info) != 0 || info.st_size < static_cast<off_t>(sizeof(VolumePage))) {
    ::close(fd);
    return prefix + "is smaller than this version's layout";
  }
  auto mapped = std::make_unique<Mapped>();
  mapped->bytes = static_cast<std::size_t>(info.st_size);
  void* const memory = ::mmap(nullptr, mapped->bytes, PROT_READ, MAP_SHARED, fd, 0);
  ::close(fd);
  if (memory == MAP_FAILED) return prefix + std::strerror(errno);
  mapped->memory = memory;
  const auto* const page = static_cast<const VolumePage*>(memory);
  mapped->number = page->number.load(std::memory_order_acquire);
  if (mapped->number == 0 || (mapped_ && mapped_->number == mapped->number)) return {};
  if (page->magic != kVolumeMagic || page->version != kVolumeVersion)
    return prefix + "has layout version " + std::to_string(page->version) +
           "; allowed: " + std::to_string(kVolumeVersion);
  mapped->header = page->header;
  if (!sound(mapped->header) || mapped->bytes < sizeof(VolumePage) + 3 * voxelsOf(mapped->header))
    return prefix + "its size or table is not sound";
  before_ = std::move(mapped_);
  mapped_ = std::move(mapped);
  volume_.store(mapped_.get(), std::memory_order_release);
  return {};
}

voxel::View ContactReader::volume(std::uint64_t number) const noexcept {
  const Mapped* const m = volume_.load(std::memory_order_acquire);
  if (!m || number == 0 || m->number != number) return {};
  const auto* const stored =
      reinterpret_cast<const std::int16_t*>(static_cast<const VolumePage*>(m->memory) + 1);
  return {&m->header, stored, reinterpret_cast<const std::uint8_t*>(stored + voxelsOf(m->header))};
}

ContactReader::ContactReader(std::string name) : name_(std::move(name)) {}

ContactReader::~ContactReader() {
  if (page_) ::munmap(const_cast<ContactPage*>(page_.load()), sizeof(ContactPage));
}

std::string ContactReader::connect() {
  if (page_) return connectVolume();
  const std::string prefix = "contact memory '" + name_ + "': ";
  const int fd = ::shm_open(name_.c_str(), O_RDONLY | O_CLOEXEC, 0);
  if (fd < 0) {
    return prefix + (errno == ENOENT ? "no simulation has made it yet" : std::strerror(errno));
  }
  struct stat info {};
  // Mapping more than there is would raise SIGBUS at the first read.
  if (::fstat(fd, &info) != 0 || info.st_size < static_cast<off_t>(sizeof(ContactPage))) {
    ::close(fd);
    return prefix + "is smaller than this version's layout";
  }
  void* memory = ::mmap(nullptr, sizeof(ContactPage), PROT_READ, MAP_SHARED, fd, 0);
  ::close(fd);
  if (memory == MAP_FAILED) return prefix + std::strerror(errno);
  const auto* page = static_cast<const ContactPage*>(memory);
  if (page->magic.load() != kContactMagic || page->version.load() != kContactVersion ||
      page->bytes.load() != sizeof(ContactPage)) {
    const std::string version = std::to_string(page->version.load());
    ::munmap(memory, sizeof(ContactPage));
    return prefix + "has layout version " + version + "; allowed: " + std::to_string(kContactVersion);
  }
  page_ = page;
  return connectVolume();
}

bool ContactReader::read(ContactImage& image, int tries) const noexcept {
  const ContactPage* const page = page_.load(std::memory_order_acquire);
  if (!page) return false;
  std::array<std::uint64_t, kContactWords> words;
  for (int i = 0; i < tries; ++i) {
    const std::uint64_t before = page->sequence.load(std::memory_order_acquire);
    if (before == 0) return false;
    if (before & 1) continue;
    for (std::size_t w = 0; w < kContactWords; ++w) words[w] = page->words[w].load(std::memory_order_relaxed);
    std::atomic_thread_fence(std::memory_order_acquire);
    if (page->sequence.load(std::memory_order_relaxed) != before) continue;
    std::memcpy(static_cast<void*>(&image), words.data(), sizeof image);
    return true;
  }
  return false;
}

}  // namespace vest::shared
