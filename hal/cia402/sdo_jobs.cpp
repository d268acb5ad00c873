// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/sdo_jobs.h"

#include "hal/canopen/bytes.h"

namespace tandem::hal {

using canopen::SdoAbort;
using canopen::SdoStatus;

void SdoJobs::clear() noexcept {
  count_ = next_ = 0;
  running_ = reading_back_ = false;
  deadline_ = 0;
  status_ = Status::kIdle;
  abort_ = SdoAbort::kNone;
}

void SdoJobs::push(const Job& job) noexcept {
  if (status_ == Status::kDone || status_ == Status::kFailed)
    clear();
  if (count_ == kCapacity) {  // a programming error: reported as a failure instead of a lost job
    status_ = Status::kFailed;
    abort_ = SdoAbort::kMemory;
    next_ = kCapacity - 1;
    return;
  }
  jobs_[count_++] = job;
  status_ = Status::kBusy;
}

void SdoJobs::write(canopen::ObjectAddress object, std::int64_t value, int size) noexcept {
  push({Kind::kWrite, object, canopen::lowBits(static_cast<std::uint64_t>(value), 8 * size), size, 0});
}

void SdoJobs::await(canopen::ObjectAddress object, std::int64_t value, int size, std::int64_t timeout) noexcept {
  push({Kind::kAwait, object, canopen::lowBits(static_cast<std::uint64_t>(value), 8 * size), size, timeout});
}

void SdoJobs::read(canopen::ObjectAddress object) noexcept { push({Kind::kRead, object, 0, 0, 0}); }

void SdoJobs::fail(SdoAbort abort) noexcept {
  status_ = Status::kFailed;
  abort_ = abort;
  running_ = false;
}

void SdoJobs::begin(canopen::SdoClient& sdo, std::int64_t now) noexcept {
  const Job& job = jobs_[next_];
  if (job.kind == Kind::kWrite && !reading_back_) {
    sdo.download(job.object, job.value, job.size, now);
  } else {
    sdo.upload(job.object, now);
  }
  if (urgent_)
    sdo.setUrgent();
  if (job.kind == Kind::kAwait && deadline_ == 0)
    deadline_ = now + job.timeout;
  running_ = true;
}

void SdoJobs::finish(canopen::SdoClient& sdo, std::int64_t now) noexcept {
  const Job& job = jobs_[next_];
  running_ = false;
  if (sdo.status() != SdoStatus::kDone)
    return fail(sdo.abort());
  if (job.kind == Kind::kWrite && !reading_back_) {
    reading_back_ = true;
    return;
  }
  bool size_fits = true;
  value_ = sdo.value(job.size, size_fits);
  const bool equal = job.size == 0 || (size_fits && value_ == job.value);
  if (job.kind == Kind::kWrite && !equal)
    return fail(SdoAbort::kNone);
  if (job.kind == Kind::kAwait && !equal) {
    if (now >= deadline_)
      fail(SdoAbort::kTimeout);
    return;  // read again
  }
  reading_back_ = false;
  deadline_ = 0;
  if (++next_ == count_)
    status_ = Status::kDone;
}

SdoJobs::Status SdoJobs::step(canopen::Node& node, std::int64_t now) noexcept {
  if (status_ != Status::kBusy)
    return status_;
  canopen::SdoClient& sdo = node.sdo();
  if (running_ && !sdo.busy())
    finish(sdo, now);
  if (status_ == Status::kBusy && !running_ && node.sdoFree())
    begin(sdo, now);
  return status_;
}

}  // namespace tandem::hal
