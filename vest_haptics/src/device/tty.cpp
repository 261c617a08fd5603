#include "vest_haptics/device/tty.h"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/file.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace vest::haptics {
namespace {

speed_t speedOf(unsigned baud) {
  switch (baud) {
    case 9600:
      return B9600;
    case 19200:
      return B19200;
    case 38400:
      return B38400;
    case 57600:
      return B57600;
    case 115200:
      return B115200;
    default:
      return B0;
  }
}

}  // namespace

std::string Tty::open(const std::string& path, unsigned baud) {
  close();
  const speed_t speed = speedOf(baud);
  if (speed == B0) return "baud " + std::to_string(baud) + "; allowed: 9600, 19200, 38400, 57600, 115200";
  fd_ = ::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (fd_ < 0) {
    const std::string what = "port '" + path + "': " + std::strerror(errno);
    if (errno == EACCES)
      return what +
             "; ask whoever runs this computer to put this user into the group dialout, then log in anew";
    return what +
           "; allowed: a serial device, for example /dev/ttyS0, that this user may open (group dialout)";
  }
  termios raw{};
  if (::tcgetattr(fd_, &raw) != 0) {
    close();
    return "port '" + path + "' is no serial device";
  }
  if (::flock(fd_, LOCK_EX | LOCK_NB) != 0) {
    close();
    return "port '" + path + "' is in use by another program";
  }
  ::cfmakeraw(&raw);
  raw.c_cflag |= CLOCAL | CREAD;
  ::cfsetispeed(&raw, speed);
  ::cfsetospeed(&raw, speed);
  ::tcsetattr(fd_, TCSANOW, &raw);
  ::tcflush(fd_, TCIOFLUSH);
  return {};
}

std::string Tty::openPseudo(const std::string& link) {
  close();
  fd_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  char name[128];
  if (fd_ < 0 || ::grantpt(fd_) != 0 || ::unlockpt(fd_) != 0 || ::ptsname_r(fd_, name, sizeof name) != 0) {
    const std::string why = std::strerror(errno);
    close();
    return "no pseudo-terminal: " + why;
  }
  termios raw{};
  ::tcgetattr(fd_, &raw);
  ::cfmakeraw(&raw);
  ::tcsetattr(fd_, TCSANOW, &raw);
  pseudo_ = true;
  ::unlink(link.c_str());
  if (::symlink(name, link.c_str()) != 0) {
    const std::string why = std::strerror(errno);
    close();
    return "link '" + link + "': " + why;
  }
  link_ = link;
  return {};
}

void Tty::close() {
  if (!link_.empty()) ::unlink(link_.c_str());
  link_.clear();
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
  pseudo_ = false;
}

int Tty::read(std::uint8_t* buffer, std::size_t capacity, int timeout_ms) {
  pollfd p{fd_, POLLIN, 0};
  const int ready = ::poll(&p, 1, timeout_ms);
  if (ready <= 0) return ready < 0 && errno != EINTR ? -1 : 0;
  const ssize_t n = ::read(fd_, buffer, capacity);
  if (n > 0) return static_cast<int>(n);
  if (n < 0 && (errno == EAGAIN || errno == EINTR)) {
    if (!(p.revents & (POLLHUP | POLLERR))) return 0;
  }
  if (pseudo_) {  // nobody has the other end open yet
    ::usleep(static_cast<useconds_t>(timeout_ms > 0 ? 1000 : 0));
    return 0;
  }
  return -1;
}

bool Tty::write(const void* bytes, std::size_t size) {
  return ::write(fd_, bytes, size) == static_cast<ssize_t>(size);
}

void Tty::flush() {
  ::tcflush(fd_, TCIOFLUSH);
}

}  // namespace vest::haptics
