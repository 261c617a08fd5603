#include "vest_tissue/fem/cache.h"

#include <xxhash.h>

#include <algorithm>

#include "vest_tissue/cache/block.h"

namespace vest::fem {
namespace {

// The last digit is the version of the computation: raised whenever its numbers change.
constexpr char kMagic[8] = {'V', 'E', 'S', 'T', 'F', 'E', 'M', '1'};

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

}  // namespace

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
  return cache::path(directory, "fem", content_hash);
}

bool loadMatrix(const std::string& directory, std::uint64_t content_hash, Eigen::Index rows,
                Eigen::MatrixXd& matrix) {
  const auto n = static_cast<std::uint64_t>(rows);
  Eigen::MatrixXd read(rows, rows);
  if (!cache::load(cachePath(directory, content_hash), {content_hash, n, n}, read.data(),
                   n * n * sizeof(double)))
    return false;
  matrix.swap(read);
  return true;
}

bool saveMatrix(const std::string& directory, std::uint64_t content_hash, const Eigen::MatrixXd& matrix) {
  return cache::save(
      cachePath(directory, content_hash),
      {content_hash, static_cast<std::uint64_t>(matrix.rows()), static_cast<std::uint64_t>(matrix.cols())},
      matrix.data(), static_cast<std::size_t>(matrix.size()) * sizeof(double));
}

}  // namespace vest::fem
