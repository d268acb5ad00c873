// SPDX-License-Identifier: Apache-2.0
/** @file DDS domain and prefix for the processes of a command, and detection of a system that already uses them. */
#pragma once

#include <string>

#include "config/config.h"

namespace tandem::cli {

/// Assigns an unused domain and prefix to the processes of one run, so that they cannot receive from or move a running
/// robot. No effect with --domain or --prefix, with several hosts (which must agree), or with security (certificates
/// name domain and prefix).
/// @throw Failure if no domain is free.
void useOwnDomain(config::Deployment& deployment);

/** Exclusive use of a deployment's domain and prefix on this machine while the object lives. */
class DomainLock {
 public:
  /// @param host  this machine's name in the deployment; empty without hosts
  /// @throw Failure with pid, host and start time of a process that already runs one of this host's services.
  DomainLock(const config::Deployment& deployment, const std::string& host);
  ~DomainLock();
  DomainLock(const DomainLock&) = delete;
  DomainLock& operator=(const DomainLock&) = delete;

 private:
  int socket_ = -1;
};

}  // namespace tandem::cli
