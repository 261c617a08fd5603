// A serial device, or anything else that behaves like a tty.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace vest::transport {

/// Opened raw (8 data bits, no parity, one stop bit, no flow control) and locked for this process alone.
/// All methods may be called from one thread; wake() from any.
class SerialPort {
 public:
  enum class Read { kData, kTimeout, kWoken, kClosed };

  SerialPort();
  ~SerialPort();
  SerialPort(const SerialPort&) = delete;
  SerialPort& operator=(const SerialPort&) = delete;

  /// Empty on success, else what is wrong and what would be right, in words. Old input is thrown away.
  std::string open(const std::string& path, unsigned baud_rate);
  bool isOpen() const;
  void close();
  /// Waits up to `timeout_ms` for bytes. kClosed: the other end hung up or the device is gone (read gives 0
  /// or EIO); the port is closed then, and error() says why.
  Read read(std::uint8_t* buffer, std::size_t capacity, int timeout_ms, std::size_t& size);
  /// Sleeps up to `timeout_ms` unless woken.
  bool sleep(int timeout_ms);
  /// Ends a read() or sleep() now and for ever.
  void wake();
  const std::string& error() const { return error_; }

 private:
  struct Implementation;
  std::unique_ptr<Implementation> it_;
  std::string error_;
};

}  // namespace vest::transport
