#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <string>
#include <vector>

namespace vest::tools {

/// Runs a program without its words on standard output. @return its exit status; 127: there is none of this
/// name, -1: it was killed
inline int runQuietly(std::vector<std::string> words) {
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
  if (child <= 0 || waitpid(child, &status, 0) != child || !WIFEXITED(status)) return -1;
  return WEXITSTATUS(status);
}

/// Runs `vest_render` of vest_viz on a bag. @return whether it succeeded
inline bool render(const std::string& bag, const std::vector<std::string>& options) {
  std::vector<std::string> words{"rosrun", "vest_viz", "vest_render", bag};
  words.insert(words.end(), options.begin(), options.end());
  return runQuietly(std::move(words)) == 0;
}

}  // namespace vest::tools
