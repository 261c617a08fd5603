/// What each value of an image looks like, and how it feels (docs/images.md).
#pragma once

#include <array>
#include <string>
#include <vector>

namespace vest::volume {

/// One row; between rows all is linear, beyond the first and the last it stays.
struct Transfer {
  double value = 0;                ///< HU, or the unit of the image
  std::array<double, 3> colour{};  ///< red, green, blue: 0 … 1
  double alpha = 0;                ///< 0 … 1: share of the light that a millimetre keeps back
  std::array<double, 4> feel{};    ///< stiffness N/m, yield N, viscosity N·s/m, friction N/m; ≥ 0
};

using TransferTable = std::vector<Transfer>;  ///< 2 … 256 rows, values rise

/// Reads `value,red,green,blue,alpha[,stiffness][,yield][,viscosity][,friction]`; a column that is missing is
/// 0. @throws std::invalid_argument: file, line, column, value, what is allowed
TransferTable readTransferTable(const std::string& path);
TransferTable readTransferTable(const std::string& path, const std::string& bytes);

Transfer transfer(const TransferTable& table, double value);

}  // namespace vest::volume
