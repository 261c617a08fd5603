#include "vest_tissue/cache/block.h"

#include <unistd.h>
#include <xxhash.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace vest::cache {
namespace {

constexpr char kMagic[8] = {'V', 'E', 'S', 'T', 'B', 'L', 'K', '1'};

struct Header {
  char magic[8];
  Key key;
};
static_assert(sizeof(Header) == 32, "no padding on disk");

Header headerOf(const Key& key) {
  Header header{};
  std::memcpy(header.magic, kMagic, sizeof kMagic);
  header.key = key;
  return header;
}

std::uint64_t checkSum(const Header& header, const void* data, std::size_t bytes) {
  XXH64_state_t* const state = XXH64_createState();
  XXH64_reset(state, 0);
  XXH64_update(state, &header, sizeof header);
  if (bytes > 0) XXH64_update(state, data, bytes);
  const std::uint64_t sum = XXH64_digest(state);
  XXH64_freeState(state);
  return sum;
}

}  // namespace

std::string defaultDirectory() {
  const auto variable = [](const char* name) {
    const char* const value = std::getenv(name);
    return std::string(value == nullptr ? "" : value);
  };
  if (const std::string own = variable("VEST_CACHE_DIR"); !own.empty()) return own;
  if (const std::string all = variable("XDG_CACHE_HOME"); !all.empty()) return all + "/vest";
  const std::string home = variable("HOME");
  return home.empty() ? home : home + "/.cache/vest";
}

std::uint64_t hash(const void* data, std::size_t bytes, std::uint64_t seed) {
  return XXH64(data, bytes, seed);
}

std::string path(const std::string& directory, const std::string& kind, std::uint64_t content) {
  char hash[17];
  std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(content));
  return directory + "/vest_" + kind + "_" + hash + ".bin";
}

bool load(const std::string& path, const Key& key, void* data, std::size_t bytes) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  if (error || size != sizeof(Header) + bytes + sizeof(std::uint64_t)) return false;
  std::ifstream file(path, std::ios::binary);
  Header header{};
  file.read(reinterpret_cast<char*>(&header), sizeof header);
  const Header expected = headerOf(key);
  if (!file || std::memcmp(&header, &expected, sizeof header) != 0) return false;
  file.read(static_cast<char*>(data), static_cast<std::streamsize>(bytes));
  std::uint64_t sum = 0;
  file.read(reinterpret_cast<char*>(&sum), sizeof sum);
  return file && sum == checkSum(header, data, bytes);
}

bool save(const std::string& path, const Key& key, const void* data, std::size_t bytes) {
  std::error_code error;
  std::filesystem::create_directories(std::filesystem::path(path).parent_path(), error);
  std::string temporary = path + ".XXXXXX";
  const int handle = mkstemp(temporary.data());
  if (handle < 0) return false;
  const Header header = headerOf(key);
  const std::uint64_t sum = checkSum(header, data, bytes);
  const auto put = [handle](const void* from, std::size_t size) {
    const char* at = static_cast<const char*>(from);
    while (size > 0) {
      const ssize_t written = ::write(handle, at, size);
      if (written <= 0) return false;
      at += written;
      size -= static_cast<std::size_t>(written);
    }
    return true;
  };
  bool good =
      put(&header, sizeof header) && put(data, bytes) && put(&sum, sizeof sum) && ::fsync(handle) == 0;
  good = (::close(handle) == 0) && good;
  good = good && std::rename(temporary.c_str(), path.c_str()) == 0;
  if (!good) std::remove(temporary.c_str());
  return good;
}

}  // namespace vest::cache
