#include "vest_tissue/shared/contact_memory.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
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

ContactWriter::ContactWriter(const std::string& name) {
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
  if (page_) ::munmap(page_, sizeof(ContactPage));
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

ContactReader::~ContactReader() {
  if (page_) ::munmap(const_cast<ContactPage*>(page_.load()), sizeof(ContactPage));
}

std::string ContactReader::connect() {
  if (page_) return {};
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
  return {};
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
