#pragma once

#include <array>
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

}  // namespace vest::effects
