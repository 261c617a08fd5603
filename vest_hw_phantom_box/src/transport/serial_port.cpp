#include "vest_hw_phantom_box/transport/serial_port.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <termios.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/serial_port.hpp>
#include <cerrno>
#include <cstring>

namespace vest::transport {

namespace asio = boost::asio;
using asio::serial_port_base;

struct SerialPort::Implementation {
  asio::io_context io;
  asio::serial_port port{io};
  int wake_fd = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  ~Implementation() {
    if (wake_fd >= 0) ::close(wake_fd);
  }
};

SerialPort::SerialPort() : it_(std::make_unique<Implementation>()) {}
SerialPort::~SerialPort() = default;

bool SerialPort::isOpen() const {
  return it_->port.is_open();
}

void SerialPort::close() {
  if (!isOpen()) return;
  ::ioctl(it_->port.native_handle(), TIOCNXCL);
  boost::system::error_code ignored;
  it_->port.close(ignored);
}

std::string SerialPort::open(const std::string& path, unsigned baud_rate) {
  close();
  const std::string allowed = "; allowed: a serial device (tty), for example /dev/ttyUSB0";
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) return std::strerror(errno) + allowed;
  if (!S_ISCHR(info.st_mode)) return "is not a serial device" + allowed;
  boost::system::error_code ec;
  it_->port.open(path, ec);
  if (ec) {
    if (ec == boost::system::errc::device_or_resource_busy)
      return "is in use by another program; allowed: one reader";
    // ENOTTY from the termios calls inside open(): a character device, but no tty.
    return (ec.value() == ENOTTY || ec.value() == EINVAL ? "is not a serial device" : ec.message()) + allowed;
  }
  const int fd = it_->port.native_handle();
  if (!::isatty(fd)) {
    close();
    return "is not a serial device" + allowed;
  }
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0) {
    boost::system::error_code ignored;
    it_->port.close(ignored);  // not close(): the other program keeps its exclusive mode
    return "is in use by another program; allowed: one reader";
  }
  // A pseudo-terminal would stay exclusive after a killed reader; a real device forgets it on its last close.
  const unsigned device = major(info.st_rdev);
  if (device < 136 || device > 143) ::ioctl(fd, TIOCEXCL);
  it_->port.set_option(serial_port_base::baud_rate(baud_rate), ec);
  const boost::system::error_code rate_error = ec;
  const auto set = [&](const auto& option) {
    if (!ec) it_->port.set_option(option, ec);
  };
  set(serial_port_base::character_size(8));
  set(serial_port_base::parity(serial_port_base::parity::none));
  set(serial_port_base::stop_bits(serial_port_base::stop_bits::one));
  set(serial_port_base::flow_control(serial_port_base::flow_control::none));
  termios raw{};
  if (!ec && ::tcgetattr(fd, &raw) == 0) {
    ::cfmakeraw(&raw);
    raw.c_cflag |= CLOCAL | CREAD;
    raw.c_cc[VMIN] = 1;
    raw.c_cc[VTIME] = 0;
    if (::tcsetattr(fd, TCSANOW, &raw) != 0) ec = {errno, boost::system::system_category()};
  }
  if (ec) {
    close();
    if (rate_error) return "baud_rate " + std::to_string(baud_rate) + " is not supported by this device";
    return "cannot be set to 8N1 raw (" + ec.message() + ")" + allowed;
  }
  ::tcflush(fd, TCIFLUSH);
  return {};
}

SerialPort::Read SerialPort::read(std::uint8_t* buffer, std::size_t capacity, int timeout_ms,
                                  std::size_t& size) {
  size = 0;
  const int fd = isOpen() ? it_->port.native_handle() : -1;
  pollfd fds[2] = {{fd, POLLIN, 0}, {it_->wake_fd, POLLIN, 0}};
  const int ready = ::poll(fds, 2, timeout_ms);
  if (ready < 0) return errno == EINTR ? Read::kTimeout : Read::kClosed;
  if (fds[1].revents) return Read::kWoken;
  if (ready == 0) return Read::kTimeout;
  if (fds[0].revents & POLLNVAL) return Read::kClosed;
  const ssize_t n = ::read(fd, buffer, capacity);
  if (n > 0) {
    size = static_cast<std::size_t>(n);
    return Read::kData;
  }
  if (n < 0 && (errno == EAGAIN || errno == EINTR) && !(fds[0].revents & (POLLHUP | POLLERR)))
    return Read::kTimeout;
  error_ = n == 0 ? "the other end hung up" : std::strerror(errno);
  close();
  return Read::kClosed;
}

bool SerialPort::sleep(int timeout_ms) {
  pollfd fd{it_->wake_fd, POLLIN, 0};
  return ::poll(&fd, 1, timeout_ms) > 0;
}

void SerialPort::wake() {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t n = ::write(it_->wake_fd, &one, sizeof one);
}

}  // namespace vest::transport
