#include "worker.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <new>
#include <stdexcept>

#include "vest_instruments/files/read.h"

namespace vest::image {
namespace {

struct Report {
  volatile std::size_t file;
  volatile bool failed;
  char message[1024];
};

/// Private writable memory of this process now, bytes (proc(5), statm).
std::size_t dataSize() {
  unsigned long size = 0, resident = 0, shared = 0, text = 0, lib = 0, data = 0;
  FILE* const file = std::fopen("/proc/self/statm", "r");
  if (file == nullptr) return 0;
  const int read =
      std::fscanf(file, "%lu %lu %lu %lu %lu %lu", &size, &resident, &shared, &text, &lib, &data);
  std::fclose(file);
  return read == 6 ? data * static_cast<std::size_t>(sysconf(_SC_PAGESIZE)) : 0;
}

/// Where workHere() was called.
struct {
  volatile bool* within = nullptr;
  std::size_t memory = 0;
} here;

void limit(const std::string& file, std::size_t before, std::optional<std::size_t> unpacked) {
  struct stat status {};
  const int failed = stat(file.c_str(), &status);
  if (failed != 0 || !S_ISREG(status.st_mode))
    throw std::invalid_argument(failed != 0 ? std::strerror(errno) : "is no regular file");
  const std::size_t bytes = unpacked.value_or(static_cast<std::size_t>(status.st_size));
  const itimerval most{{0, 0}, {static_cast<time_t>(4 + bytes / 10'000'000), 0}};
  setitimer(ITIMER_PROF, &most, nullptr);
  // A file system may never answer, and a busy machine may be slow.
  const itimerval longest{{0, 0}, {60 * most.it_value.tv_sec, 0}};
  setitimer(ITIMER_REAL, &longest, nullptr);
  const std::size_t least = here.within != nullptr ? here.memory : 300'000'000;
  const rlim_t memory = before + least + 4 * std::min<std::size_t>(bytes, 1'000'000'000);
  const rlimit data{memory, RLIM_INFINITY};
  setrlimit(RLIMIT_DATA, &data);
}

/// What work throws becomes a message of the report.
void worked(const std::vector<std::string>& files, const std::function<void(std::size_t)>& work,
            std::optional<std::size_t> bytes, Report& report) {
  const std::size_t before = dataSize();
  const char* message = nullptr;
  std::string text;
  try {
    for (std::size_t i = 0; i < files.size(); ++i) {
      report.file = i;
      limit(files[i], before, bytes);
      work(i);
    }
  } catch (const std::bad_alloc&) {
    message = "needs more memory than a file of its size may take";
  } catch (const std::exception& error) {
    text = error.what();
    message = text.c_str();
  } catch (...) {
    message = "is damaged";
  }
  if (message != nullptr) {
    report.failed = true;
    std::strncpy(report.message, message, sizeof report.message - 1);
  }
}

[[noreturn]] void child(const std::vector<std::string>& files, const std::function<void(std::size_t)>& work,
                        std::optional<std::size_t> bytes, Report& report) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  const int nothing = open("/dev/null", O_RDWR);
  for (const int fd : {0, 1, 2}) dup2(nothing, fd);
  for (const int s : {SIGPROF, SIGALRM, SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGXCPU})
    std::signal(s, SIG_DFL);
  const rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);
  setrlimit(RLIMIT_FSIZE, &none);  // it writes no file
  worked(files, work, bytes, report);
  _exit(0);
}

/// In this process, which has its limits again afterwards. @returns as a child that ended well
int workedHere(const std::vector<std::string>& files, const std::function<void(std::size_t)>& work,
               std::optional<std::size_t> bytes, Report& report) {
  rlimit data{};
  getrlimit(RLIMIT_DATA, &data);
  *here.within = true;
  worked(files, work, bytes, report);
  *here.within = false;
  setrlimit(RLIMIT_DATA, &data);
  const itimerval none{};
  setitimer(ITIMER_PROF, &none, nullptr);
  setitimer(ITIMER_REAL, &none, nullptr);
  return 0;
}

/// In a process of its own. @returns its status
int workedApart(const std::vector<std::string>& files, const std::function<void(std::size_t)>& work,
                std::optional<std::size_t> bytes, Report& report) {
  const pid_t pid = fork();
  if (pid < 0) throw std::invalid_argument(std::string("no process to read files: ") + std::strerror(errno));
  if (pid == 0) child(files, work, bytes, report);
  int status = 0;
  while (waitpid(pid, &status, 0) < 0)
    if (errno != EINTR)
      throw std::invalid_argument(std::string("the reading process is lost: ") + std::strerror(errno));
  return status;
}

}  // namespace

void workHere(volatile bool& within, std::size_t memory) {
  here.within = &within, here.memory = memory;
}

std::shared_ptr<void> sharedMemory(std::size_t bytes) {
  bytes = std::max<std::size_t>(bytes, 1);
  void* const at =
      mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (at == MAP_FAILED) throw std::invalid_argument("no memory for " + std::to_string(bytes) + " bytes");
  return {at, [bytes](void* p) { munmap(p, bytes); }};
}

void inWorker(const std::vector<std::string>& files, const std::function<void(std::size_t)>& work,
              std::optional<std::size_t> bytes) {
  const auto memory = sharedMemory(sizeof(Report));
  Report& report = *static_cast<Report*>(memory.get());
  const int status = here.within != nullptr ? workedHere(files, work, bytes, report)
                                            : workedApart(files, work, bytes, report);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0 && !report.failed) return;
  const std::string& file = files.at(std::min(std::size_t{report.file}, files.size() - 1));
  report.message[sizeof report.message - 1] = 0;
  std::string cause;
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM)
    cause = "reading it does not end";
  else if (WIFSIGNALED(status) && WTERMSIG(status) == SIGPROF)
    cause = "is damaged: reading it takes too long";
  else if (report.failed && WIFEXITED(status) && WEXITSTATUS(status) == 0)
    cause = report.message;
  else
    cause = "is damaged: its reader ended with " +
            (WIFSIGNALED(status) ? "signal " + std::to_string(WTERMSIG(status)) : std::string("an error"));
  throw std::invalid_argument(files::shown(file, 300) + ": " + files::shown(cause, 600));
}

}  // namespace vest::image
