// SPDX-License-Identifier: Apache-2.0
#include "sim/drives/sdo_server.h"

#include <algorithm>

#include "hal/canopen/cob.h"

namespace tandem::sim::drives {

namespace sdo = hal::canopen::sdo;

std::uint32_t SdoServer::id() const noexcept { return hal::canopen::cob::kSdoAnswer + node_; }

CanFrame SdoServer::refuse(SdoAbort code) noexcept {
  mode_ = Mode::kIdle;
  return sdo::abort(id(), object_, code);
}

bool SdoServer::handle(const CanFrame& request, std::int64_t now, CanFrame& answer) noexcept {
  if (request.length != 8)
    return false;
  deadline_ = now + kSegmentTimeout;
  switch (sdo::requestOf(request)) {
    case sdo::Request::kDownload:
      answer = beginDownload(request);
      return true;
    case sdo::Request::kUpload:
      answer = beginUpload(request);
      return true;
    case sdo::Request::kDownloadSegment:
      answer = takeSegment(request);
      return true;
    case sdo::Request::kUploadSegment:
      answer = giveSegment(request);
      return true;
    case sdo::Request::kAbort:
      mode_ = Mode::kIdle;
      return false;
    case sdo::Request::kUnknown:
      break;
  }
  if (mode_ == Mode::kIdle)
    object_ = sdo::objectOf(request);
  answer = refuse(SdoAbort::kCommand);
  return true;
}

bool SdoServer::poll(std::int64_t now, CanFrame& answer) noexcept {
  if (mode_ == Mode::kIdle || now < deadline_)
    return false;
  answer = refuse(SdoAbort::kTimeout);
  return true;
}

CanFrame SdoServer::beginDownload(const CanFrame& request) noexcept {
  const sdo::Initiate first = sdo::parseInitiate(request);
  mode_ = Mode::kIdle;
  object_ = first.object;
  if (first.expedited) {
    // Without a size the object's own length counts; the frame contains four bytes.
    std::size_t size = first.size;
    if (!first.size_known) {
      std::array<std::uint8_t, kCapacity> present;
      std::size_t own = present.size();
      if (access_.readObject(object_, present, own) == SdoAbort::kNone)
        size = std::min<std::size_t>(own, 4);
    }
    const SdoAbort code = access_.writeObject(object_, first.data.first(size));
    return code == SdoAbort::kNone ? sdo::downloadAnswer(id(), object_) : refuse(code);
  }
  if (first.size > kCapacity)
    return refuse(SdoAbort::kMemory);
  mode_ = Mode::kDownload;
  toggle_ = false;
  size_ = first.size;
  position_ = 0;
  return sdo::downloadAnswer(id(), object_);
}

CanFrame SdoServer::takeSegment(const CanFrame& request) noexcept {
  const sdo::Segment segment = sdo::parseSegment(request);
  if (mode_ != Mode::kDownload)
    return refuse(SdoAbort::kCommand);
  if (segment.toggle != toggle_)
    return refuse(SdoAbort::kToggle);
  if (position_ + segment.data.size() > kCapacity)
    return refuse(SdoAbort::kMemory);
  std::ranges::copy(segment.data, buffer_.begin() + static_cast<std::ptrdiff_t>(position_));
  position_ += segment.data.size();
  if (size_ != 0 && position_ > size_)
    return refuse(SdoAbort::kTooLong);
  if (segment.last) {
    mode_ = Mode::kIdle;
    if (size_ != 0 && position_ < size_)
      return refuse(SdoAbort::kTooShort);
    const SdoAbort code = access_.writeObject(object_, {buffer_.data(), position_});
    if (code != SdoAbort::kNone)
      return refuse(code);
  }
  toggle_ = !toggle_;
  return sdo::downloadSegmentAnswer(id(), segment.toggle);
}

CanFrame SdoServer::beginUpload(const CanFrame& request) noexcept {
  mode_ = Mode::kIdle;
  object_ = sdo::objectOf(request);
  size_ = buffer_.size();
  const SdoAbort code = access_.readObject(object_, buffer_, size_);
  if (code != SdoAbort::kNone)
    return refuse(code);
  if (size_ == 0 || size_ > 4) {
    mode_ = Mode::kUpload;
    toggle_ = false;
    position_ = 0;
    return sdo::initiate(id(), true, object_, {buffer_.data(), size_});
  }
  return expedited();
}

CanFrame SdoServer::expedited() noexcept {
  constexpr std::uint8_t kGarbage = 0xA5, kWithoutSize = 0x42;
  const bool negative = (buffer_[size_ - 1] & 0x80) != 0;
  const std::size_t sent = form == AnswerForm::kSized ? size_ : 4;
  const std::uint8_t filler = form == AnswerForm::kUnsized ? kGarbage : negative ? 0xFF : 0x00;
  std::fill(buffer_.begin() + static_cast<std::ptrdiff_t>(size_), buffer_.begin() + 4, filler);
  CanFrame answer = sdo::initiate(id(), true, object_, {buffer_.data(), sent});
  if (form == AnswerForm::kUnsized)
    answer.data[0] = kWithoutSize;
  return answer;
}

CanFrame SdoServer::giveSegment(const CanFrame& request) noexcept {
  if (mode_ != Mode::kUpload)
    return refuse(SdoAbort::kCommand);
  if (sdo::toggleOf(request) != toggle_)
    return refuse(SdoAbort::kToggle);
  const std::size_t count = std::min<std::size_t>(7, size_ - position_);
  const bool last = position_ + count == size_;
  const CanFrame answer = sdo::segment(id(), toggle_, last, {buffer_.data() + position_, count});
  position_ += count;
  toggle_ = !toggle_;
  if (last)
    mode_ = Mode::kIdle;
  return answer;
}

}  // namespace tandem::sim::drives
