#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

/// Results that cost seconds and depend on their inputs alone, kept on disk by content hash. Losing them
/// costs time and nothing else.
namespace vest::cache {

/// $VEST_CACHE_DIR, else $XDG_CACHE_HOME/vest, else $HOME/.cache/vest; empty: none of them is set.
std::string defaultDirectory();

/// What a file holds: rows times columns of something, under the hash of all that it depends on.
struct Key {
  std::uint64_t content = 0;
  std::uint64_t rows = 0, columns = 0;
};

/// XXH64.
std::uint64_t hash(const void* data, std::size_t bytes, std::uint64_t seed = 0);

/// DIRECTORY/vest_KIND_HASH.bin, little-endian: magic, key, data, XXH64 of all that.
std::string path(const std::string& directory, const std::string& kind, std::uint64_t content);

/// False, and `data` holds anything, where there is no such file, or it is cut short, damaged or of other
/// content: then it is to be made again.
bool load(const std::string& path, const Key& key, void* data, std::size_t bytes);

/// Written beside and renamed, so that a reader never sees half a file; the folder is made. False: could not
/// be written (a full disk, no permission).
bool save(const std::string& path, const Key& key, const void* data, std::size_t bytes);

}  // namespace vest::cache
