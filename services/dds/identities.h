// SPDX-License-Identifier: Apache-2.0
/** @file Private: identities of all participants, from topic `identity`. */
#pragma once

#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "services/dds/ends_detail.h"
#include "services/dds/wire_detail.h"

namespace tandem::dds::detail {

/** Keeps the identities of all other participants as long as these exist. */
class IdentityReader final : public ReaderEnd {
 public:
  explicit IdentityReader(const std::shared_ptr<Participant>& participant);
  ~IdentityReader() override;

  std::vector<Identity> all() const;
  /// Also finds recently ended sessions.
  std::optional<Identity> find(std::uint64_t session) const;

 private:
  using Handle = eprosima::fastrtps::rtps::InstanceHandle_t;

  void* target() override { return static_cast<Wire<Identity>::Generated*>(&sample_); }
  const char* deliver(const fast::SampleInfo& info) override;
  void left(const Handle& writer) override;

  Sample<Identity> sample_;
  mutable std::mutex mutex_;
  std::vector<std::pair<Handle, Identity>> known_;
  std::deque<Identity> gone_;
};

}  // namespace tandem::dds::detail
