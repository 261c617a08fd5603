#include "vest_hw_phantom_box/emulator/pseudo_terminal.h"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <cstring>
#include <stdexcept>

namespace vest::emulator {
namespace {

[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error(what + ": " + std::strerror(errno));
}

bool isSymlink(const std::string& path) {
  struct stat info {};
  return ::lstat(path.c_str(), &info) == 0 && S_ISLNK(info.st_mode);
}

}  // namespace

void PseudoTerminal::open(const std::string& link) {
  close();
  master_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (master_ < 0) fail("cannot make a pseudo-terminal");
  char name[128];
  if (::grantpt(master_) != 0 || ::unlockpt(master_) != 0 || ::ptsname_r(master_, name, sizeof name) != 0) {
    ::close(master_);
    master_ = -1;
    fail("cannot make a pseudo-terminal");
  }
  path_ = name;
  // Raw before anybody reads. Opening and closing the other end once makes poll() report "no reader" from now
  // on.
  const int slave = ::open(name, O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (slave < 0) fail(path_);
  termios raw{};
  ::tcgetattr(slave, &raw);
  ::cfmakeraw(&raw);
  ::tcsetattr(slave, TCSANOW, &raw);
  ::close(slave);
  if (link.empty()) return;
  if (isSymlink(link)) ::unlink(link.c_str());
  if (::symlink(name, link.c_str()) != 0) {
    const int error = errno;
    close();
    errno = error;
    fail("--link " + link);
  }
  link_ = link;
}

void PseudoTerminal::close() {
  if (!link_.empty()) {
    char target[PATH_MAX];
    const ssize_t n = ::readlink(link_.c_str(), target, sizeof target);
    if (n > 0 && path_ == std::string(target, static_cast<std::size_t>(n))) ::unlink(link_.c_str());
    link_.clear();
  }
  if (master_ >= 0) ::close(master_);
  master_ = -1;
  pending_.clear();
}

bool PseudoTerminal::hasReader() const {
  if (master_ < 0) return false;
  pollfd fd{master_, 0, 0};
  return ::poll(&fd, 1, 0) >= 0 && !(fd.revents & POLLHUP);
}

void PseudoTerminal::flush() {
  pending_.clear();
  if (master_ >= 0) ::tcflush(master_, TCIOFLUSH);
}

bool PseudoTerminal::write(const protocol::Bytes& bytes) {
  if (master_ < 0) return false;
  if (!pending_.empty()) {
    const ssize_t n = ::write(master_, pending_.data(), pending_.size());
    if (n > 0) pending_.erase(pending_.begin(), pending_.begin() + n);
    if (!pending_.empty()) return false;
  }
  if (bytes.empty()) return true;
  const ssize_t n = ::write(master_, bytes.data(), bytes.size());
  if (n <= 0) return false;
  pending_.assign(bytes.begin() + n, bytes.end());
  return true;
}

}  // namespace vest::emulator
