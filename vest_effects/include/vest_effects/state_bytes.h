#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

/// State of an effect as bytes: numbers one after another, little-endian (as x86-64 and ARM64 hold them), no
/// padding. One function template writes both ways: walk(Archive&, State&).
namespace vest::effects {

class StateWriter {
 public:
  explicit StateWriter(std::vector<std::uint8_t>& bytes) : bytes_(bytes) {}
  template <class T>
  void operator()(const T& value) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    raw(&value, sizeof value);
  }
  template <class T>
  void operator()(const std::vector<T>& values) {
    static_assert(std::is_arithmetic_v<T>);
    (*this)(static_cast<std::uint64_t>(values.size()));
    raw(values.data(), values.size() * sizeof(T));
  }
  template <class T, std::size_t N>
  void operator()(const std::array<T, N>& values) {
    for (const T& v : values) (*this)(v);
  }

 private:
  void raw(const void* from, std::size_t count) {
    const auto* p = static_cast<const std::uint8_t*>(from);
    bytes_.insert(bytes_.end(), p, p + count);
  }
  std::vector<std::uint8_t>& bytes_;
};

/// Vectors keep their size: bytes of another size are refused (good() is false from then on).
class StateReader {
 public:
  StateReader(const std::uint8_t* bytes, std::size_t count) : at_(bytes), end_(bytes + count) {}
  template <class T>
  void operator()(T& value) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    if constexpr (std::is_same_v<T, bool>) {
      std::uint8_t byte = value ? 1 : 0;
      raw(&byte, 1);
      good_ = good_ && byte <= 1;
      value = byte == 1;
    } else {
      raw(&value, sizeof value);
      finite(&value, 1);
    }
  }
  template <class T>
  void operator()(std::vector<T>& values) {
    std::uint64_t size = 0;
    (*this)(size);
    good_ = good_ && size == values.size();
    if (good_) raw(values.data(), values.size() * sizeof(T));
    finite(values.data(), values.size());
  }
  template <class T, std::size_t N>
  void operator()(std::array<T, N>& values) {
    for (T& v : values) (*this)(v);
  }
  bool good() const { return good_; }
  bool done() const { return good_ && at_ == end_; }

 private:
  template <class T>
  void finite(const T* values, std::size_t count) {
    if constexpr (std::is_floating_point_v<T>)
      for (std::size_t i = 0; i < count; ++i) good_ = good_ && std::isfinite(values[i]);
  }
  void raw(void* to, std::size_t count) {
    good_ = good_ && static_cast<std::size_t>(end_ - at_) >= count;
    if (!good_) return;
    std::memcpy(to, at_, count);
    at_ += count;
  }
  const std::uint8_t* at_;
  const std::uint8_t* end_;
  bool good_ = true;
};

/// Appends what `visit(state, f)` shows f as (address, bytes), piece after piece, as memory holds it.
template <class State, class Visit>
void savePieces(const State& state, const Visit& visit, std::vector<std::uint8_t>& bytes) {
  visit(state, [&](const void* from, std::size_t size) {
    const auto* b = static_cast<const std::uint8_t*>(from);
    bytes.insert(bytes.end(), b, b + size);
  });
}

/// Fills the pieces of `state` from what savePieces() wrote. @return false if the bytes are fewer or more
/// than the pieces; `state` may be half filled then. Values are the caller's to check.
template <class State, class Visit>
bool restorePieces(const std::uint8_t* bytes, std::size_t size, State& state, const Visit& visit) {
  bool fits = true;
  visit(state, [&](void* to, std::size_t n) {
    fits = fits && n <= size;
    if (!fits) return;
    std::memcpy(to, bytes, n);
    bytes += n, size -= n;
  });
  return fits && size == 0;
}

}  // namespace vest::effects
