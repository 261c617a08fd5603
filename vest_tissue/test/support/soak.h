/// Memory and descriptors of this process over hours of simulated time. docs/HAZARDS.md: the slope of memory
/// stays below 1 MB/h, descriptors are constant.
#pragma once

#include <dirent.h>
#include <malloc.h>

#include <cstdio>
#include <cstring>
#include <vector>

#include <gtest/gtest.h>

namespace vest::testing {

class Soak {
 public:
  Soak() { samples_.reserve(200); }

  /// Bytes that are allocated, resident bytes that belong to no file, open descriptors.
  struct Sample {
    double hours, heap, resident;
    int descriptors;
  };

  /// Now and then, at a simulated time. The first is taken when all has run once.
  void sample(double hours) {
#if __GLIBC_PREREQ(2, 33)
    const struct mallinfo2 info = ::mallinfo2();
#else
    const struct mallinfo info = ::mallinfo();
#endif
    samples_.push_back({hours, static_cast<double>(info.uordblks) + static_cast<double>(info.hblkhd),
                        residentBytes(), openDescriptors()});
  }

  void judge() const {
    ASSERT_GE(samples_.size(), 10U);
    const double heap = slope(&Sample::heap), resident = slope(&Sample::resident);
    std::printf("%.3f h: allocated %+.4f MB/h, resident %+.4f MB/h, %d descriptors\n",
                samples_.back().hours - samples_.front().hours, 1e-6 * heap, 1e-6 * resident,
                samples_.back().descriptors);
    EXPECT_LT(heap, 1e6) << "bytes an hour";
    // In minutes a few pages that are touched for the first time would count as megabytes an hour.
    if (samples_.back().hours - samples_.front().hours > 0.05) {
      EXPECT_LT(resident, 1e6) << "bytes an hour";
    }
    for (const Sample& s : samples_)
      EXPECT_EQ(s.descriptors, samples_.front().descriptors) << s.hours << " h";
  }

 private:
  static double residentBytes() {
    double kilobytes = 0;
    if (std::FILE* f = std::fopen("/proc/self/status", "r")) {
      char line[256];
      while (std::fgets(line, sizeof line, f)) {
        if (std::sscanf(line, "RssAnon: %lf", &kilobytes) == 1) break;
      }
      std::fclose(f);
    }
    EXPECT_GT(kilobytes, 0.0) << "the kernel tells";
    return 1024.0 * kilobytes;
  }
  static int openDescriptors() {
    int count = 0;
    if (DIR* d = ::opendir("/proc/self/fd")) {
      while (::readdir(d)) ++count;
      ::closedir(d);
    }
    return count;
  }
  /// Least squares, bytes an hour.
  double slope(double Sample::*what) const {
    double n = 0, t = 0, y = 0, tt = 0, ty = 0;
    for (const Sample& s : samples_) {
      n += 1;
      t += s.hours;
      y += s.*what;
      tt += s.hours * s.hours;
      ty += s.hours * s.*what;
    }
    return (n * ty - t * y) / (n * tt - t * t);
  }
  std::vector<Sample> samples_;
};

}  // namespace vest::testing
