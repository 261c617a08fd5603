/// What the tests of device plug-ins share. One program.
#pragma once

#include <dlfcn.h>

#include <string>

#include <gtest/gtest.h>

#include "vest_haptics/device/device.h"

namespace vest::haptics::testing {

/// The conformance suite, each promise of it an expectation.
/// @param attempts more than one where the device is another process or has its own thread: the suite cannot
/// see that a busy machine stops it; a device that breaks a promise breaks it each time
void conforms(Device& device, const DeviceOptions& words, int attempts = 1);

/// What a device says where it cannot be opened.
inline std::string refusal(Device& device, const DeviceOptions& words) {
  try {
    device.open(words);
  } catch (const DeviceError& e) {
    return e.what();
  }
  return "";
}

/// Functions of a stand-in library, by name.
struct FakeLibrary {
  void* handle;
  explicit FakeLibrary(const char* path) : handle(::dlopen(path, RTLD_NOW | RTLD_LOCAL)) {
    EXPECT_NE(handle, nullptr) << ::dlerror();
  }
  ~FakeLibrary() { ::dlclose(handle); }
  template <class F>
  F* get(const char* name) const {
    return reinterpret_cast<F*>(::dlsym(handle, name));
  }
};

}  // namespace vest::haptics::testing
