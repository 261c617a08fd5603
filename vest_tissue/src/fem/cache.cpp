#include "vest_tissue/fem/cache.h"

#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace vest::fem {
namespace {

// The last digit is the version of the computation: raised whenever its numbers change.
constexpr char kMagic[8] = {'V', 'E', 'S', 'T', 'F', 'E', 'M', '1'};

struct Header {
  char magic[8];
  std::uint64_t content;
  std::uint64_t rows, columns;
};
static_assert(sizeof(Header) == 32, "no padding on disk");

struct Hasher {
  XXH64_state_t* state = XXH64_createState();
  Hasher() { XXH64_reset(state, 0); }
  ~Hasher() { XXH64_freeState(state); }
  Hasher(const Hasher&) = delete;
  Hasher& operator=(const Hasher&) = delete;
  void bytes(const void* data, std::size_t size) {
    if (size > 0) XXH64_update(state, data, size);
  }
  template <class T>
  void array(const std::vector<T>& values) {
    const std::uint64_t size = values.size();
    bytes(&size, sizeof size);
    bytes(values.data(), values.size() * sizeof(T));
  }
  std::uint64_t digest() const { return XXH64_digest(state); }
};

std::uint64_t checkSum(const Header& header, const Eigen::MatrixXd& matrix) {
  Hasher hash;
  hash.bytes(&header, sizeof header);
  hash.bytes(matrix.data(), static_cast<std::size_t>(matrix.size()) * sizeof(double));
  return hash.digest();
}

}  // namespace

std::string defaultCacheDirectory() {
  const auto variable = [](const char* name) {
    const char* const value = std::getenv(name);
    return std::string(value == nullptr ? "" : value);
  };
  if (const std::string own = variable("VEST_CACHE_DIR"); !own.empty()) return own;
  if (const std::string all = variable("XDG_CACHE_HOME"); !all.empty()) return all + "/vest";
  const std::string home = variable("HOME");
  return home.empty() ? home : home + "/.cache/vest";
}

std::uint64_t contentHash(const Description& d, const std::vector<Index>& outer_nodes, double step) {
  Hasher hash;
  hash.bytes(kMagic, sizeof kMagic);
  hash.array(d.nodes);
  hash.array(d.tetrahedra);
  std::vector<Index> held = d.fixed;
  for (const auto& p : d.prescribed) held.push_back(p.node);
  std::sort(held.begin(), held.end());
  held.erase(std::unique(held.begin(), held.end()), held.end());
  hash.array(held);
  hash.bytes(&d.material.youngs_modulus, sizeof(double));
  hash.bytes(&d.material.poisson_ratio, sizeof(double));
  for (const Material& m : d.materials) {
    hash.bytes(&m.youngs_modulus, sizeof(double));
    hash.bytes(&m.poisson_ratio, sizeof(double));
  }
  hash.array(d.cell_material);
  if (step > 0.0) {
    for (const double number :
         {step, d.material.density, d.material.rayleigh_mass, d.material.rayleigh_stiffness})
      hash.bytes(&number, sizeof number);
    for (const Material& m : d.materials) hash.bytes(&m.density, sizeof(double));
  }
  hash.array(outer_nodes);
  return hash.digest();
}

std::string cachePath(const std::string& directory, std::uint64_t content_hash) {
  char name[48];
  std::snprintf(name, sizeof name, "/vest_fem_%016llx.bin", static_cast<unsigned long long>(content_hash));
  return directory + name;
}

bool loadMatrix(const std::string& directory, std::uint64_t content_hash, Eigen::Index rows,
                Eigen::MatrixXd& matrix) {
  const std::string path = cachePath(directory, content_hash);
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  const auto count = static_cast<std::uint64_t>(rows) * static_cast<std::uint64_t>(rows);
  if (error || size != sizeof(Header) + count * sizeof(double) + sizeof(std::uint64_t)) return false;
  std::ifstream file(path, std::ios::binary);
  Header header{};
  file.read(reinterpret_cast<char*>(&header), sizeof header);
  if (!file || std::memcmp(header.magic, kMagic, sizeof kMagic) != 0 || header.content != content_hash ||
      header.rows != static_cast<std::uint64_t>(rows) || header.columns != header.rows) {
    return false;
  }
  Eigen::MatrixXd read(rows, rows);
  file.read(reinterpret_cast<char*>(read.data()), static_cast<std::streamsize>(count * sizeof(double)));
  std::uint64_t sum = 0;
  file.read(reinterpret_cast<char*>(&sum), sizeof sum);
  if (!file || sum != checkSum(header, read)) return false;
  matrix.swap(read);
  return true;
}

bool saveMatrix(const std::string& directory, std::uint64_t content_hash, const Eigen::MatrixXd& matrix) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  const std::string path = cachePath(directory, content_hash);
  std::string temporary = path + ".XXXXXX";
  const int handle = mkstemp(temporary.data());
  if (handle < 0) return false;
  Header header{};
  std::memcpy(header.magic, kMagic, sizeof kMagic);
  header.content = content_hash;
  header.rows = static_cast<std::uint64_t>(matrix.rows());
  header.columns = static_cast<std::uint64_t>(matrix.cols());
  const std::uint64_t sum = checkSum(header, matrix);
  const auto put = [handle](const void* data, std::size_t size) {
    const char* at = static_cast<const char*>(data);
    while (size > 0) {
      const ssize_t written = ::write(handle, at, size);
      if (written <= 0) return false;
      at += written;
      size -= static_cast<std::size_t>(written);
    }
    return true;
  };
  bool good = put(&header, sizeof header) &&
              put(matrix.data(), static_cast<std::size_t>(matrix.size()) * sizeof(double)) &&
              put(&sum, sizeof sum) && ::fsync(handle) == 0;
  good = (::close(handle) == 0) && good;
  good = good && std::rename(temporary.c_str(), path.c_str()) == 0;
  if (!good) std::remove(temporary.c_str());
  return good;
}

}  // namespace vest::fem
