/// Values of a file that are looked at as they pass, before memory for all of them is taken. Plain:
/// volume_file.cpp sees no Eigen of ours.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

namespace vest::image {

/// @throws std::runtime_error
[[noreturn]] void refuseBeyond();
/// @throws std::runtime_error
[[noreturn]] void refuseNothing();

/// Refuses what readValues() refuses: values beyond 1e30, or none that is a number.
class Passing {
 public:
  Passing() = default;  ///< refuses nothing: whole numbers

  /// @param type in small letters, of NRRD or MetaImage @param sizes numbers of voxels along the axes
  static Passing ofText(const std::string& type, const std::string& sizes, bool big);
  /// @param type of nifti1.h @param count of values that are read; what follows is not looked at @param begin
  /// bytes before the first one @param slope of all values; 0, or no number, says nothing; then shift does
  /// not count either
  static Passing ofNifti(int type, std::size_t count, bool swapped, std::size_t begin, double slope,
                         double shift);

  /// Whether it looks at anything more.
  bool wanted() const { return look_ && left_ > 0; }
  /// To the end of the last value that is looked at.
  std::size_t bytes() const { return begin_ + width_ * count_; }

  /// The next bytes. @throws std::runtime_error: refused
  void take(const char* data, std::size_t size);

 private:
  template <class Value>
  static Passing of(std::size_t count, bool swapped, std::size_t begin, double slope, double shift);
  void judge(const char* data, std::size_t values);

  std::function<std::size_t(const char*, std::size_t)> look_;  ///< at values: how many are numbers
  std::size_t width_ = 1, count_ = 0, left_ = 0, begin_ = 0, skip_ = 0, numbers_ = 0;
  std::string part_;  ///< of a value that goes on in the next bytes
};

}  // namespace vest::image
