#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <string>
#include <vector>

struct Ended {
  int code;
  std::string output;
};

inline Ended shell(const std::string& command) {
  Ended e{-1, {}};
  FILE* pipe = ::popen(("timeout 20 " + command + " 2>&1").c_str(), "r");
  if (!pipe) return e;
  std::array<char, 4096> buffer;
  while (std::fgets(buffer.data(), buffer.size(), pipe)) e.output += buffer.data();
  const int status = ::pclose(pipe);
  e.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return e;
}

/// The node ends with code 1 and one message that holds all of `parts`.
inline void expectRefusal(const std::string& node, const std::string& arguments,
                          const std::vector<std::string>& parts) {
  const Ended e = shell(node + " __name:=box " + arguments);
  EXPECT_EQ(1, e.code) << arguments << "\n" << e.output;
  std::size_t messages = 0;
  for (std::size_t at = e.output.find("[FATAL]"); at != std::string::npos;
       at = e.output.find("[FATAL]", at + 1))
    ++messages;
  EXPECT_EQ(1u, messages) << e.output;
  for (const auto& p : parts)
    EXPECT_NE(std::string::npos, e.output.find(p)) << "lacks " << p << "\n" << e.output;
}
