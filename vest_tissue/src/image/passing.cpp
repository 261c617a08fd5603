#include "passing.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <type_traits>

#include "vest_tissue/image/volume.h"

namespace vest::image {
namespace {

/// @returns how many are numbers @throws std::runtime_error: some are beyond 1e30
template <class Value>
std::size_t look(const char* bytes, std::size_t values, bool swapped, double slope, double shift) {
  constexpr std::size_t kAtOnce = 4096;
  Value some[kAtOnce];
  std::size_t numbers = 0, beyond = 0;
  for (std::size_t n = 0; values > 0; values -= n, bytes += n * sizeof(Value)) {
    n = std::min(values, kAtOnce);
    std::memcpy(some, bytes, n * sizeof(Value));
    for (std::size_t i = 0; swapped && i < n; ++i) {
      char* const at = reinterpret_cast<char*>(some + i);
      std::reverse(at, at + sizeof(Value));
    }
    for (std::size_t i = 0; i < n; ++i) {
      const double value = slope * static_cast<double>(some[i]) + shift;
      numbers += value == value;
      beyond += std::abs(value) > 1e30;
    }
    if (beyond > 0) refuseBeyond();
  }
  return numbers;
}

}  // namespace

void refuseBeyond() {
  throw std::runtime_error("holds values beyond 1e30");
}

void refuseNothing() {
  throw std::runtime_error("no value is a number");
}

template <class Value>
Passing Passing::of(std::size_t count, bool swapped, std::size_t begin, double slope, double shift) {
  Passing passing;
  if (count > kMostVoxels) return passing;  // refused by its size
  const double greatest =
      std::abs(slope) * static_cast<double>(std::numeric_limits<Value>::max()) + std::abs(shift);
  if (std::is_integral<Value>::value && greatest < 1e29) return passing;
  passing.width_ = sizeof(Value), passing.left_ = passing.count_ = count;
  passing.begin_ = passing.skip_ = begin;
  passing.look_ = [=](const char* bytes, std::size_t values) {
    return look<Value>(bytes, values, swapped, slope, shift);
  };
  return passing;
}

Passing Passing::ofText(const std::string& type, const std::string& sizes, bool big) {
  std::size_t count = 1;
  std::istringstream words(sizes);
  // What is no size is refused by ITK: nothing is looked at then.
  for (std::size_t size = 0; words >> size;)
    count = size > 0 && size <= kMostVoxels ? std::min(count * size, kMostVoxels + 1) : kMostVoxels + 1;
  if (type == "float" || type == "met_float") return of<float>(count, big, 0, 1, 0);
  if (type == "double" || type == "met_double") return of<double>(count, big, 0, 1, 0);
  return {};
}

Passing Passing::ofNifti(int type, std::size_t count, bool swapped, std::size_t begin, double slope,
                         double shift) {
  if (!std::isfinite(slope) || slope == 0) slope = 1, shift = 0;
  if (!std::isfinite(shift)) shift = 0;
  const auto with = [&](auto value) { return of<decltype(value)>(count, swapped, begin, slope, shift); };
  switch (type) {
    case 2:
      return with(std::uint8_t{});
    case 4:
      return with(std::int16_t{});
    case 8:
      return with(std::int32_t{});
    case 16:
      return with(float{});
    case 64:
      return with(double{});
    case 256:
      return with(std::int8_t{});
    case 512:
      return with(std::uint16_t{});
    case 768:
      return with(std::uint32_t{});
    case 1024:
      return with(std::int64_t{});
    case 1280:
      return with(std::uint64_t{});
    default:
      return {};
  }
}

void Passing::take(const char* data, std::size_t size) {
  if (!wanted()) return;
  const std::size_t skipped = std::min(skip_, size);
  skip_ -= skipped, data += skipped, size -= skipped;
  if (!part_.empty()) {
    const std::size_t more = std::min(width_ - part_.size(), size);
    part_.append(data, more), data += more, size -= more;
    if (part_.size() < width_) return;
    judge(part_.data(), 1);
    part_.clear();
  }
  const std::size_t values = std::min(left_, size / width_);
  judge(data, values);
  if (left_ > 0) part_.assign(data + values * width_, size - values * width_);
}

void Passing::judge(const char* data, std::size_t values) {
  if (values == 0) return;
  numbers_ += look_(data, values);
  left_ -= values;
  if (left_ == 0 && numbers_ == 0) refuseNothing();
}

}  // namespace vest::image
