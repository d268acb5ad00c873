// SPDX-License-Identifier: Apache-2.0
/** @file Control socket of tandem-drive-sim, which injects faults and reports states: AF_UNIX seqpacket, one line per
 * packet. */
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace tandem::drive_sim {

/** Server side; not blocking. */
class ControlSocket {
 public:
  /// @throw std::system_error if the socket cannot be created at this path.
  explicit ControlSocket(const std::string& path);
  ~ControlSocket();
  ControlSocket(const ControlSocket&) = delete;
  ControlSocket& operator=(const ControlSocket&) = delete;

  /// Answers all received lines.
  void poll(const std::function<std::string(const std::string&)>& answer);
  /// For poll(): readable when a line or a connection is pending.
  int fd() const noexcept { return poll_; }

 private:
  std::string path_;
  int poll_ = -1;
  int listener_ = -1;
  std::vector<int> clients_;
};

/// Sends one line and waits for the answer. @throw std::system_error without an answer within `seconds`.
std::string askControl(const std::string& path, const std::string& line, double seconds = 5.0);

}  // namespace tandem::drive_sim
