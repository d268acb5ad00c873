// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/sdo_client.h"

#include <algorithm>

#include "hal/canopen/bytes.h"
#include "hal/canopen/cob.h"

namespace tandem::hal::canopen {

SdoClient::SdoClient(int node, std::int64_t timeout, int retries) noexcept
    : node_(node), timeout_(timeout), retries_(retries) {}

void SdoClient::begin(ObjectAddress object, bool upload) noexcept {
  const bool interrupted = busy();
  const ObjectAddress before = object_;
  outgoing_count_ = 0;
  if (interrupted)
    push(sdo::abort(requestId(), before, SdoAbort::kGeneral));
  object_ = object;
  upload_ = upload;
  urgent_ = false;
  retried_ = 0;
  abort_ = SdoAbort::kNone;
  status_ = SdoStatus::kBusy;
}

void SdoClient::open(std::int64_t now) noexcept {
  toggle_ = false;
  phase_ = Phase::kInitiate;
  position_ = 0;
  deadline_ = now + timeout_ + kTurn;  // until sent()
  if (upload_) {
    size_ = 0;
    expected_ = 0;
    announced_ = false;
    all_count_ = true;
    push(sdo::uploadRequest(requestId(), object_));
  } else {
    push(sdo::initiate(requestId(), false, object_, {buffer_.data(), size_}));
  }
}

bool SdoClient::download(ObjectAddress object, std::span<const std::uint8_t> data, std::int64_t now) noexcept {
  if (data.size() > kCapacity)
    return false;
  begin(object, false);
  size_ = data.size();
  std::ranges::copy(data, buffer_.begin());
  open(now);
  return true;
}

bool SdoClient::download(ObjectAddress object, std::uint64_t value, int size, std::int64_t now) noexcept {
  std::array<std::uint8_t, 8> bytes{};
  toBytes(value, bytes);
  return download(object, std::span<const std::uint8_t>(bytes.data(), std::clamp(size, 1, 8)), now);
}

void SdoClient::upload(ObjectAddress object, std::int64_t now) noexcept {
  begin(object, true);
  open(now);
}

void SdoClient::cancel(SdoAbort reason) noexcept {
  if (busy())
    fail(reason, true);
}

void SdoClient::reset() noexcept {
  status_ = SdoStatus::kIdle;
  outgoing_count_ = 0;
}

void SdoClient::poll(std::int64_t now) noexcept {
  if (!busy() || now < deadline_)
    return;
  if (retried_ == retries_) {
    fail(SdoAbort::kTimeout, true);
    return;
  }
  ++retried_;
  outgoing_count_ = 0;
  push(sdo::abort(requestId(), object_, SdoAbort::kTimeout));
  open(now);
}

void SdoClient::sent(std::int64_t now) noexcept {
  if (outgoing_count_ == 0)
    return;
  outgoing_[0] = outgoing_[1];
  --outgoing_count_;
  deadline_ = now + timeout_;
}

std::uint64_t SdoClient::value() const noexcept { return fromBytes(data()); }

std::uint64_t SdoClient::value(int size, bool& fits) const noexcept {
  const int bits = 8 * size;
  const int sent = 8 * std::min(static_cast<int>(data().size()), 8);
  if (all_count_ || bits == 0)
    return withoutExtension(value(), sent, bits, fits);
  fits = true;
  return lowBits(value(), bits);
}

void SdoClient::push(const CanFrame& frame) noexcept {
  if (outgoing_count_ < outgoing_.size())
    outgoing_[outgoing_count_++] = frame;
}

void SdoClient::fail(SdoAbort code, bool send_abort) noexcept {
  status_ = SdoStatus::kAborted;
  abort_ = code == SdoAbort::kNone ? SdoAbort::kGeneral : code;  // a node may send an abort whose code is 0
  outgoing_count_ = 0;
  if (send_abort)
    push(sdo::abort(requestId(), object_, code));
}

bool SdoClient::feed(const CanFrame& frame, std::int64_t now) noexcept {
  if (!frame.classicData() || frame.id != cob::kSdoAnswer + static_cast<std::uint32_t>(node_))
    return false;
  // An answer before the request was sent belongs to another transfer.
  if (frame.length != 8 || !busy() || outgoing_count_ > 0) {
    ++unexpected_responses_;
    return true;
  }
  deadline_ = now + timeout_;
  switch (sdo::answerOf(frame)) {
    case sdo::Answer::kAbort:
      if (sdo::objectOf(frame) == object_ || sdo::objectOf(frame) == ObjectAddress{}) {
        fail(sdo::abortOf(frame), false);
      } else {
        ++unexpected_responses_;
      }
      break;
    case sdo::Answer::kDownload:
      onDownloadAnswer(frame);
      break;
    case sdo::Answer::kDownloadSegment:
      onDownloadSegmentAnswer(frame);
      break;
    case sdo::Answer::kUpload:
      onUploadAnswer(frame);
      break;
    case sdo::Answer::kUploadSegment:
      onUploadSegment(frame);
      break;
    case sdo::Answer::kUnknown:
      fail(SdoAbort::kCommand, true);
      break;
  }
  return true;
}

void SdoClient::onDownloadAnswer(const CanFrame& frame) noexcept {
  if (upload_ || phase_ != Phase::kInitiate || sdo::objectOf(frame) != object_) {
    ++unexpected_responses_;
  } else if (size_ >= 1 && size_ <= 4) {
    status_ = SdoStatus::kDone;
  } else {
    phase_ = Phase::kSegments;
    sendSegment();
  }
}

void SdoClient::sendSegment() noexcept {
  const std::size_t count = std::min<std::size_t>(7, size_ - position_);
  const bool last = position_ + count == size_;
  push(sdo::segment(requestId(), toggle_, last, {buffer_.data() + position_, count}));
  position_ += count;
}

void SdoClient::onDownloadSegmentAnswer(const CanFrame& frame) noexcept {
  if (upload_ || phase_ != Phase::kSegments) {
    ++unexpected_responses_;
  } else if (sdo::toggleOf(frame) != toggle_) {
    fail(SdoAbort::kToggle, true);
  } else if (position_ == size_) {
    status_ = SdoStatus::kDone;
  } else {
    toggle_ = !toggle_;
    sendSegment();
  }
}

void SdoClient::onUploadAnswer(const CanFrame& frame) noexcept {
  const sdo::Initiate answer = sdo::parseInitiate(frame);
  if (!upload_ || phase_ != Phase::kInitiate || answer.object != object_) {
    ++unexpected_responses_;
  } else if (answer.expedited) {
    std::ranges::copy(answer.data, buffer_.begin());
    size_ = answer.size;
    all_count_ = answer.size_known;
    status_ = SdoStatus::kDone;
  } else if (answer.size_known && answer.size > kCapacity) {
    fail(SdoAbort::kMemory, true);
  } else {
    announced_ = answer.size_known;
    expected_ = answer.size;
    phase_ = Phase::kSegments;
    push(sdo::uploadSegmentRequest(requestId(), toggle_));
  }
}

void SdoClient::onUploadSegment(const CanFrame& frame) noexcept {
  const sdo::Segment segment = sdo::parseSegment(frame);
  if (!upload_ || phase_ != Phase::kSegments) {
    ++unexpected_responses_;
    return;
  }
  if (segment.toggle != toggle_) {
    fail(SdoAbort::kToggle, true);
    return;
  }
  if (size_ + segment.data.size() > kCapacity) {
    fail(SdoAbort::kMemory, true);
    return;
  }
  std::ranges::copy(segment.data, buffer_.begin() + static_cast<std::ptrdiff_t>(size_));
  size_ += segment.data.size();
  if (announced_ && (size_ > expected_ || (segment.last && size_ < expected_))) {
    fail(size_ > expected_ ? SdoAbort::kTooLong : SdoAbort::kTooShort, true);
  } else if (segment.last) {
    status_ = SdoStatus::kDone;
  } else {
    toggle_ = !toggle_;
    push(sdo::uploadSegmentRequest(requestId(), toggle_));
  }
}

std::uint32_t SdoClient::requestId() const noexcept { return cob::kSdoRequest + static_cast<std::uint32_t>(node_); }

}  // namespace tandem::hal::canopen
