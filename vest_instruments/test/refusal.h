#pragma once

#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "vest_instruments/kinematics/trainer_box.h"

namespace vest::testing {

inline std::string fileText(const std::string& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// What `load` says when it refuses a file with this text; empty where it takes it.
template <class Load>
std::string refusal(const std::string& text, Load&& load) {
  const std::string path = ::testing::TempDir() + "/vest_refusal_test.yaml";
  std::ofstream(path) << text;
  std::string message;
  try {
    load(path);
  } catch (const files::FileError& e) {
    message = e.what();
  }
  std::remove(path.c_str());
  if (!message.empty()) {
    EXPECT_NE(message.find(path), std::string::npos) << "names the file: " << message;
  }
  return message;
}

/// The text with one place changed.
inline std::string changed(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

}  // namespace vest::testing
