// CRC-16 of the box's frames.
#pragma once

#include <cstddef>
#include <cstdint>

namespace vest::protocol {

/// CRC-16/IBM-3740 (also called CCITT-FALSE): polynomial 0x1021, start 0xFFFF, nothing reflected, nothing
/// xored at the end. Check value: "123456789" gives 0x29B1 (catalogue of CRC algorithms, G. Cook,
/// entry CRC-16/IBM-3740). All 1, 2 and 3 bit errors and all bursts up to 16 bits are found in frames as
/// short as ours (Hamming distance 4 up to 32,751 data bits: P. Koopman, T. Chakravarty, "Cyclic redundancy
/// code polynomial selection for embedded networks", DSN 2004, doi:10.1109/DSN.2004.1311885).
std::uint16_t crc16(const std::uint8_t* bytes, std::size_t size, std::uint16_t start = 0xFFFF);

}  // namespace vest::protocol
