#pragma once

#include <array>
#include <cstring>

#include "state_members.h"

/// What walks the State (state_fields.h).
namespace vest::scene {

struct Archive {
  static constexpr bool reads = false, checks = false, measures = false;
  Numbers at;
  bool shapes = true, everything = false;
};

/// What it wrote is in `out` once it is gone: numbers one by one would cost more to append than to write.
struct Writer : Archive {
  std::vector<std::uint8_t>& out;
  std::size_t waiting = 0;
  std::array<std::uint8_t, 1024> buffer{};

  ~Writer() { flush(); }
  void flush() {
    out.insert(out.end(), buffer.data(), buffer.data() + waiting);
    waiting = 0;
  }
  template <class T>
  void values(const T* v, std::size_t count, const Limits&) {
    const std::size_t size = count * sizeof(T);
    if (size > buffer.size() - waiting) flush();
    const auto* const p = reinterpret_cast<const std::uint8_t*>(v);
    if (size > buffer.size()) {
      out.insert(out.end(), p, p + size);
      return;
    }
    if (size > 0) std::memcpy(buffer.data() + waiting, p, size);
    waiting += size;
  }
  void count(std::uint64_t n, std::size_t, const Limits& l) { values(&n, 1, l); }
};

struct Reader : Archive {
  static constexpr bool reads = true;
  const std::vector<std::uint8_t>& in;
  std::size_t from = 0;
  template <class T>
  void values(T* v, std::size_t count, const Limits&) {
    const std::size_t size = count * sizeof(T);
    if (size > in.size() - from)
      refuse("ends after " + std::to_string(in.size()) + " bytes (more are needed: cut off?)");
    if constexpr (std::is_same_v<T, bool>)
      for (std::size_t i = 0; i < count; ++i) v[i] = in[from + i] != 0;
    else if (size > 0)
      std::memcpy(v, in.data() + from, size);
    from += size;
  }
  void count(std::size_t& n, std::size_t entry, const Limits& l) {
    values(&n, 1, l);
    // What an entry takes in memory is at most 32 times what it takes here.
    if (n > (in.size() - from) / (entry / 32 + 1))
      refuse("a list of " + std::to_string(n) + " entries does not fit in the rest of the file");
  }
};

/// Room that a Writer needs for any State that fits into this one's lists.
struct Measure : Archive {
  static constexpr bool measures = true;
  std::size_t bytes = 0;
  template <class T>
  void values(const T*, std::size_t count, const Limits&) {
    bytes += count * sizeof(T);
  }
  void count(std::size_t, std::size_t, const Limits&) { bytes += sizeof(std::size_t); }
};

/// Refuses what no State can be.
struct Checker : Archive {
  static constexpr bool checks = true;
  template <class T>
  void values(const T* v, std::size_t count, const Limits& l) {
    for (std::size_t i = 0; i < count; ++i) {
      if constexpr (std::is_floating_point_v<T>) {
        if (l.nan && std::isnan(v[i])) continue;
        if (!std::isfinite(v[i])) refuse(std::string(l.what) + " is not finite");
      } else if (l.below != kAny) {
        const auto n = static_cast<std::uint64_t>(v[i]);
        if (n >= l.below && !(l.none && n == interaction::kNone))
          refuse(std::string(l.what) + " " + std::to_string(n) + " (of " + std::to_string(l.below) + ")");
      }
      const auto n = static_cast<double>(v[i]);
      if (n >= l.least && n <= l.most) continue;
      char text[96];
      std::snprintf(text, sizeof text, " of %g (allowed: %g to %g)", n, l.least, l.most);
      refuse(l.what + std::string(text));
    }
  }
  void count(std::size_t n, std::size_t, const Limits& l) {
    if (l.size != kAny && n != l.size)
      refuse("lists of an object that do not fit each other: " + std::to_string(n) + " entries instead of " +
             std::to_string(l.size));
  }
};

/// The tables that the kernel reads, from the links: places as in the World that wrote them, for the order of
/// sums is part of the result. Refuses links that have no place.
void repack(ObjectState& s);

}  // namespace vest::scene
