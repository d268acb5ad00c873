// SPDX-License-Identifier: Apache-2.0
/** @file SDO: a client and a simulated drive's server take each other's frames, some of them replaced by those of the
 * input. The client always ends its transfer, never exceeds its buffer, and sends frames of its node only. */
#include "hal/canopen/sdo_client.h"
#include "sim/drives/object_dictionary.h"
#include "sim/drives/sdo_server.h"
#include "tests/fuzz/harness.h"

using namespace tandem::hal::canopen;
using tandem::fuzz::expect;
using tandem::hal::can::CanFrame;

namespace {

constexpr int kNode = 5;
constexpr std::int64_t kTimeout = 100'000'000;

/** Objects of any length; writes are kept. */
class Objects final : public tandem::sim::drives::SdoAccess {
 public:
  SdoAbort readObject(ObjectAddress object, std::span<std::uint8_t> bytes, std::size_t& size) override {
    size = object == address_ ? size_ : object.index % 700u;
    if (size > bytes.size())
      return SdoAbort::kTooLong;
    for (std::size_t i = 0; i < size; ++i)
      bytes[i] = object == address_ ? kept_[i] : static_cast<std::uint8_t>(i);
    return SdoAbort::kNone;
  }
  SdoAbort writeObject(ObjectAddress object, std::span<const std::uint8_t> bytes) override {
    expect(bytes.size() <= kept_.size(), "a write is inside the server's buffer");
    address_ = object;
    size_ = bytes.size();
    std::copy(bytes.begin(), bytes.end(), kept_.begin());
    return SdoAbort::kNone;
  }

 private:
  ObjectAddress address_;
  std::size_t size_ = 0;
  std::array<std::uint8_t, tandem::sim::drives::SdoServer::kCapacity> kept_{};
};

class Dialogue {
 public:
  explicit Dialogue(tandem::fuzz::Input input) : input_(input) {}

  void run() {
    while (!input_.empty()) {
      const auto action = input_.number<std::uint8_t>();
      now_ += action % 16 == 15 ? kTimeout : 1'000'000;
      if (action % 4 == 0)
        begin(action);
      else if (action % 4 == 1)
        client_.feed(frame(0x580 + kNode), now_);
      else if (action % 4 == 2)
        serve(frame(0x600 + kNode));
      else
        exchange();
      look();
    }
    finish();
  }

 private:
  CanFrame frame(std::uint32_t id) {
    std::array<std::uint8_t, 8> payload{};
    for (auto& byte : payload)
      byte = input_.number<std::uint8_t>();
    return tandem::hal::can::makeFrame(id, payload);
  }
  void begin(int action) {
    const ObjectAddress object{input_.number<std::uint16_t>(), input_.number<std::uint8_t>()};
    if (action & 16) {
      client_.upload(object, now_);
      return;
    }
    written_.assign(input_.number<std::uint16_t>() % 1200, static_cast<std::uint8_t>(action));
    const bool started = client_.download(object, written_, now_);
    expect(started == (written_.size() <= SdoClient::kCapacity), "the client takes what its buffer can hold");
  }
  void serve(const CanFrame& request) {
    CanFrame answer;
    if (!server_.handle(request, now_, answer))
      return;
    expect(answer.id == 0x580 + kNode && answer.length == 8, "the server answers with its frames");
    client_.feed(answer, now_);
  }
  /// Passes one frame of the client to the server, and the answer back.
  void exchange() {
    if (const CanFrame* request = client_.request()) {
      const CanFrame copy = *request;
      client_.sent(now_);
      serve(copy);
    }
    client_.poll(now_);
    CanFrame answer;
    if (server_.poll(now_, answer))
      client_.feed(answer, now_);
  }
  void look() const {
    expect(client_.data().size() <= SdoClient::kCapacity, "a transfer is inside the client's buffer");
    if (const CanFrame* request = client_.request())
      expect(request->id == 0x600 + kNode && request->length == 8, "the client sends its node's frames");
    expect((client_.status() == SdoStatus::kAborted) == (client_.abort() != SdoAbort::kNone) || client_.busy(),
           "an abort has a code, and nothing else has");
  }
  /// Without foreign frames every transfer ends.
  void finish() {
    for (int k = 0; k < 2000 && client_.busy(); ++k) {
      exchange();
      look();
      now_ += kTimeout / 10;
    }
    expect(!client_.busy(), "every transfer ends");
    server_.reset();
    client_.reset();
    for (const std::size_t size : {1, 2, 3, 4, 5, 7, 8, 300}) {
      const std::vector<std::uint8_t> bytes(size, 7);
      transfer([&] { client_.download({0x2000, 1}, bytes, now_); });
      transfer([&] { client_.upload({0x2000, 1}, now_); });
      expect(std::ranges::equal(client_.data(), bytes), "after a reset what is written is read");
    }
  }
  template <class Begin>
  void transfer(Begin begin) {
    begin();
    for (int k = 0; k < 200 && client_.busy(); ++k)
      exchange();
    expect(client_.status() == SdoStatus::kDone, "after a reset a transfer is done", describe(client_.abort()));
  }

  tandem::fuzz::Input input_;
  std::int64_t now_ = 1'000'000'000;
  Objects objects_;
  SdoClient client_{kNode, kTimeout, 1};
  tandem::sim::drives::SdoServer server_{kNode, objects_};
  std::vector<std::uint8_t> written_;
};

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Dialogue(tandem::fuzz::Input(data, std::min<std::size_t>(size, 4096))).run();
  return 0;
}
