// SPDX-License-Identifier: Apache-2.0
/** @file DDS domain and prefix for the processes of a command, and detection of a system that already uses them. */
#pragma once

#include <string>

#include "config/config.h"

namespace tandem::cli {

/// A place of its own for what is started for one run: a domain and a prefix that nobody else has, so that it neither
/// meets nor moves a robot that runs. Not where --domain or --prefix names a place, where the deployment spreads over
/// hosts, which have to agree, or where it is secured: certificates name the place.
/// @throw Failure where no domain is free.
void useOwnDomain(config::Deployment& deployment);

/** Holds the place of a deployment on this machine while it lives. */
class DomainLock {
 public:
  /// @param host  of the deployment, this machine; empty without hosts
  /// @throw Failure that names pid, host and start of whoever runs one of this host's processes already.
  DomainLock(const config::Deployment& deployment, const std::string& host);
  ~DomainLock();
  DomainLock(const DomainLock&) = delete;
  DomainLock& operator=(const DomainLock&) = delete;

 private:
  int socket_ = -1;
};

}  // namespace tandem::cli
