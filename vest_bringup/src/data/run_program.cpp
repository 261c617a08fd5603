#include "vest_bringup/data/run_program.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>

namespace vest::data {

int runProgram(std::vector<std::string> words, const std::string& log, bool errors_too) {
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  std::fflush(nullptr);  // else the child writes it, too
  const pid_t child = fork();
  if (child == 0) {
    const int to = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    if (to < 0 || dup2(to, STDOUT_FILENO) < 0 || (errors_too && dup2(to, STDERR_FILENO) < 0)) _exit(1);
    execvp(arguments[0], arguments.data());
    _exit(127);
  }
  int status = 0;
  if (child <= 0 || waitpid(child, &status, 0) != child || !WIFEXITED(status)) return -1;
  return WEXITSTATUS(status);
}

}  // namespace vest::data
