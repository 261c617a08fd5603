#include "apart.h"

#include <link.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csetjmp>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <vector>

#include "../vest_tissue/src/image/worker.h"
#include "readers.h"

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
extern "C" void __sanitizer_set_death_callback(void (*)());
extern "C" void __sanitizer_symbolize_pc(void* pc, const char* format, char* out, std::size_t size);
#define VEST_SANITIZED
#endif
#endif

namespace vest::fuzz {
namespace {

constexpr std::size_t kMostInput = 64u << 20, kMostRefusal = 8192, kMostSaid = 1u << 16;
constexpr std::size_t kMemory = 32'000'000;  ///< bytes that an image may take: those of the corpus take less
constexpr int kPatience = 100'000;           ///< ms for an input: below what the fuzzer waits
constexpr int kMostInputs = 20000;           ///< of one process: libraries may keep memory
constexpr int kMostJumps = 200;              ///< of one process: each leaves memory and an open file behind
constexpr std::size_t kMostLeft = 300'000'000;  ///< bytes of such memory
constexpr std::size_t kMostEdges = 4u << 20;
constexpr int kNoMoreInputs = 4;                     ///< a process's exit status then
constexpr std::uint64_t kEnded = ~std::uint64_t{0};  ///< instead of an answer: the process did

[[noreturn]] void broken(const std::string& what) {
  std::fprintf(stderr, "vest_fuzz: %s\n", what.c_str());
  std::abort();
}

bool transfer(bool write, int fd, std::uint64_t& number) {
  ssize_t done = 0;
  do {
    done = write ? ::write(fd, &number, sizeof number) : ::read(fd, &number, sizeof number);
  } while (done < 0 && errno == EINTR);
  return done == sizeof number;
}

/// Whether a sanitizer's report is of a library, or of memory that a file asked for in vain.
bool ofALibrary(const std::string& said) {
  for (const char* memory : {"out of memory", "allocation-size-too-big", "failed to allocate"})
    if (said.find(memory) != std::string::npos) return true;
  if (said.find("runtime error:") != std::string::npos) return false;
  // An assertion of ours, or of a header that our code was compiled with.
  for (const char* own : {"vest_", "/c++/", "Eigen"}) {
    const std::size_t at = said.find("Assertion");
    if (at != std::string::npos && said.rfind(own, at) < at) return false;
  }
  std::istringstream lines(said);
  for (std::string line; std::getline(lines, line);)
    if (line.find("#0 ") != std::string::npos || line.find("#1 ") != std::string::npos)
      for (const char* library :
           {"libgdcm", "libITK", "libitk", "libopenjp", "libcharls", "libjpeg", "libz.so"})
        if (line.find(library) != std::string::npos) return true;
  return said.find("ERROR: ") == std::string::npos;
}

/// Bytes that this process has mapped (proc(5), statm).
std::size_t mapped() {
  unsigned long pages = 0;
  FILE* const file = std::fopen("/proc/self/statm", "r");
  if (file == nullptr || std::fscanf(file, "%lu", &pages) != 1) broken("no /proc/self/statm");
  std::fclose(file);
  return pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

/// Where the library that reads images counts its edges for the fuzzer: section __sancov_cntrs. None in an
/// ordinary build.
std::vector<Apart::Counters> ourCounters() {
  std::vector<Apart::Counters> found;
  dl_iterate_phdr(
      [](dl_phdr_info* library, std::size_t, void* to) {
        FILE* const file = std::strstr(library->dlpi_name, "/libvest_tissue_image")
                               ? std::fopen(library->dlpi_name, "rb")
                               : nullptr;
        if (file == nullptr) return 0;
        const auto read = [file](auto* into, std::size_t count, std::size_t at) {
          return std::fseek(file, static_cast<long>(at), SEEK_SET) == 0 &&
                 std::fread(into, sizeof *into, count, file) == count;
        };
        ElfW(Ehdr) head;
        std::vector<ElfW(Shdr)> sections;
        std::string names;
        bool whole = read(&head, 1, 0);
        if (whole)
          sections.resize(head.e_shnum), whole = read(sections.data(), sections.size(), head.e_shoff);
        if (whole && head.e_shstrndx < sections.size()) {
          const auto& of = sections[head.e_shstrndx];
          names.resize(of.sh_size);
          whole = read(names.data(), names.size(), of.sh_offset);
        }
        for (const auto& section : sections)
          if (whole && section.sh_name < names.size() &&
              std::strcmp(&names[section.sh_name], "__sancov_cntrs") == 0)
            static_cast<std::vector<Apart::Counters>*>(to)->push_back(
                {reinterpret_cast<std::uint8_t*>(library->dlpi_addr + section.sh_addr), section.sh_size});
        std::fclose(file);
        return 0;
      },
      &found);
  return found;
}

sigjmp_buf refused;      ///< where the child goes on behind an assertion
int said_in_child = -1;  ///< what it has said

/// An assertion of GDCM, which ends one changed file in ten, is a refusal. A process for each of them would
/// take longer than all else.
void assertion(int signal) {
  char text[2000];
  const off_t end = lseek(said_in_child, 0, SEEK_END), last = sizeof text - 1;
  const ssize_t size = pread(said_in_child, text, sizeof text - 1, end > last ? end - last : 0);
  text[size > 0 ? size : 0] = 0;
  if (gettid() == getpid() && std::strstr(text, "gdcm::") != nullptr &&
      std::strstr(text, "Assertion `") != nullptr)
    siglongjmp(refused, 1);
  std::signal(signal, SIG_DFL);
  raise(signal);
}

}  // namespace

struct Apart::Shared {
  volatile bool within;  ///< the work of a worker
  volatile int status;   ///< of the process that ended
  char refusal[kMostRefusal];
  std::uint8_t edges[kMostEdges];  ///< that the last input reached: as Counters, one after the other
  char input[kMostInput];
};

Apart::Apart(std::function<void(const std::string&)> run) : run_(std::move(run)), parent_(getpid()) {
  void* const at = mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE,
                        MAP_SHARED | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (at == MAP_FAILED) broken("no memory for a reader");
  shared_ = static_cast<Shared*>(at);
}

Apart::~Apart() {
  if (getpid() != parent_ || pid_ < 0) return;
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
  for (const int fd : {to_, from_, said_}) close(fd);
}

void Apart::begin() {
  int there[2], back[2];
  std::size_t edges = 0;
  counters_ = ourCounters();
  for (const Counters& c : counters_) edges += c.count;
  if (edges > kMostEdges) broken("more than " + std::to_string(kMostEdges) + " edges");
  said_ = memfd_create("said", MFD_CLOEXEC);
  if (said_ < 0 || pipe(there) != 0 || pipe(back) != 0 || (pid_ = fork()) < 0)
    broken("no process for a reader");
  if (pid_ == 0) {
    close(there[1]), close(back[0]);
    attend(there[0], back[1]);
  }
  close(there[0]), close(back[1]);
  to_ = there[1], from_ = back[0];
}

void Apart::attend(int from, int to) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
#ifdef VEST_SANITIZED
  // What reports need to know of the libraries is read once. In each process that dies it took longer than
  // all else.
  char text[200];
  __sanitizer_symbolize_pc(__builtin_return_address(0), "%F %L", text, sizeof text);
#endif
  for (;;) {
    const pid_t pid = fork();
    if (pid < 0) _exit(1);
    if (pid == 0) serve(from, to);
    int status = 0;
    while (waitpid(pid, &status, 0) < 0 && errno == EINTR) continue;
    if (WIFEXITED(status) && WEXITSTATUS(status) == kNoMoreInputs) _exit(0);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) continue;  // its time was up, between two inputs
    shared_->status = status;
    std::uint64_t answer = kEnded;
    if (!transfer(true, to, answer)) _exit(1);
  }
}

void Apart::serve(int from, int to) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const int fd : {1, 2}) dup2(said_, fd);  // what libraries say, and sanitizers
  for (const int s : {SIGPROF, SIGALRM, SIGXCPU, SIGXFSZ}) std::signal(s, SIG_DFL);
#ifdef VEST_SANITIZED
  __sanitizer_set_death_callback(nullptr);  // the fuzzer's, which would keep the input of a crash
#endif
  image::workHere(shared_->within, kMemory);
  rlimit data{};
  getrlimit(RLIMIT_DATA, &data);
  const std::size_t at_first = mapped();
  said_in_child = said_;
  std::signal(SIGABRT, assertion);
  volatile int inputs = 0, jumps = 0;
  for (std::uint64_t size = 0; inputs < kMostInputs && jumps < kMostJumps; ++inputs) {
    if (!transfer(false, from, size)) _exit(kNoMoreInputs);
    lastRefusal().clear();
    for (const Counters& c : counters_) std::memset(c.at, 0, c.count);
    if (sigsetjmp(refused, 1) == 0) {
      run_(std::string(shared_->input, size));
    } else {  // what the worker would have done at its end
      shared_->within = false;
      jumps = mapped() > at_first + kMostLeft ? kMostJumps : jumps + 1;
      setrlimit(RLIMIT_DATA, &data);
      const itimerval none{};
      setitimer(ITIMER_PROF, &none, nullptr);
      setitimer(ITIMER_REAL, &none, nullptr);
      lastRefusal() = "its reader ended";
    }
    std::uint8_t* edges = shared_->edges;
    for (const Counters& c : counters_) edges = std::copy_n(c.at, c.count, edges);
    const std::string& why = lastRefusal();
    std::memset(shared_->refusal, 0, 1);
    std::strncpy(shared_->refusal, why.c_str(), kMostRefusal - 1);
    if (ftruncate(said_, 0) != 0 || lseek(said_, 0, SEEK_SET) != 0) _exit(3);
    if (!transfer(true, to, size)) _exit(kNoMoreInputs);
  }
  _exit(0);
}

void Apart::ended() {
  std::string said(kMostSaid, '\0');
  const ssize_t size = pread(said_, said.data(), said.size(), 0);
  said.resize(static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
  if (!shared_->within || !ofALibrary(said)) {
    std::fwrite(said.data(), 1, said.size(), stderr);
    broken("a reader's process ended with status " + std::to_string(shared_->status));
  }
  if (ftruncate(said_, 0) != 0 || lseek(said_, 0, SEEK_SET) != 0) broken("no file for what a reader says");
  shared_->within = false;
  lastRefusal() = "its reader ended";
}

void Apart::operator()(const std::string& input) {
  if (input.size() > kMostInput) return;
  if (pid_ < 0) begin();
  std::memcpy(shared_->input, input.data(), input.size());
  std::uint64_t size = input.size();
  pollfd answer{from_, POLLIN, 0};
  if (!transfer(true, to_, size)) broken("no process for a reader");
  int answers = 0;
  do {
    answers = poll(&answer, 1, kPatience);
  } while (answers < 0 && errno == EINTR);  // the fuzzer's clock
  if (answers <= 0) broken("a reader's process does not answer");
  if (!transfer(false, from_, size)) broken("no process for a reader");
  if (size == kEnded) return ended();
  lastRefusal() = shared_->refusal;
  // The fuzzer sees what its input reached there.
  const std::uint8_t* edges = shared_->edges;
  for (const Counters& c : counters_)
    for (std::size_t i = 0; i < c.count; ++i, ++edges) c.at[i] = std::max(c.at[i], *edges);
}

}  // namespace vest::fuzz
