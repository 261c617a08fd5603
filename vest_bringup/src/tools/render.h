#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <string>
#include <vector>

namespace vest::tools {

/// Runs `vest_render` of vest_viz on a bag, without its words on standard output. @return whether it
/// succeeded
inline bool render(const std::string& bag, const std::vector<std::string>& options) {
  std::vector<std::string> words{"rosrun", "vest_viz", "vest_render", bag};
  words.insert(words.end(), options.begin(), options.end());
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  std::fflush(stdout);  // else the child writes it, too
  const pid_t child = fork();
  if (child == 0) {
    if (std::freopen("/dev/null", "w", stdout) == nullptr) _exit(1);
    execvp(arguments[0], arguments.data());
    _exit(127);
  }
  int status = 0;
  return child > 0 && waitpid(child, &status, 0) == child && status == 0;
}

}  // namespace vest::tools
