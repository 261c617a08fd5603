#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace vest::scene {

/// Name of a segment of the vessel network, kept in place: steps hand it on without allocating.
class VesselName {
 public:
  static constexpr std::size_t kMost =
      47;  ///< bytes; a longer name becomes the empty one, which no vessel has

  VesselName() = default;
  VesselName(std::string_view name) {  // NOLINT: stands for a text
    if (name.size() > kMost) return;
    std::copy(name.begin(), name.end(), text_.begin());
    size_ = static_cast<std::uint8_t>(name.size());
  }
  VesselName(const char* name) : VesselName(std::string_view(name)) {}
  VesselName(const std::string& name) : VesselName(std::string_view(name)) {}

  std::string_view view() const { return {text_.data(), size_}; }
  bool empty() const { return size_ == 0; }
  friend bool operator==(const VesselName& a, const VesselName& b) { return a.view() == b.view(); }

 private:
  std::array<char, kMost> text_{};
  std::uint8_t size_ = 0;
};

}  // namespace vest::scene
