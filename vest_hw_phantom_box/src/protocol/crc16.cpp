#include "vest_hw_phantom_box/protocol/crc16.h"

#include <array>

namespace vest::protocol {
namespace {

constexpr std::array<std::uint16_t, 256> makeTable() {
  std::array<std::uint16_t, 256> table{};
  for (unsigned i = 0; i < 256; ++i) {
    unsigned crc = i << 8;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x8000u) ? (crc << 1) ^ 0x1021u : crc << 1;
    table[i] = static_cast<std::uint16_t>(crc);
  }
  return table;
}
constexpr std::array<std::uint16_t, 256> kTable = makeTable();

}  // namespace

std::uint16_t crc16(const std::uint8_t* bytes, std::size_t size, std::uint16_t start) {
  std::uint16_t crc = start;
  for (std::size_t i = 0; i < size; ++i)
    crc = static_cast<std::uint16_t>((crc << 8) ^ kTable[(crc >> 8) ^ bytes[i]]);
  return crc;
}

}  // namespace vest::protocol
