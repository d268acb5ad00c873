// SPDX-License-Identifier: Apache-2.0
/** @file Private: conversion between plain messages and generated DDS types. */
#pragma once

#include <algorithm>
#include <cstdint>

#include "idl/wire_members.h"
#include "services/dds/messages.h"
#include "services/dds/validate.h"

namespace tandem::dds {

/// Structs with a list of members, possibly nested.
template <class M>
concept Listed = requires {
  typename Wire<M>::Generated;
};
/// Points, quaternions, colours: arrays of numbers in plain messages.
template <class W>
concept Numbers = requires(W& w) {
  numbersOf(w);
};
/// Times and durations: ns in plain messages.
template <class W>
concept Seconds = requires(W& w) {
  w.nanosec();
};

struct CopyToWire {
  template <class T, class W>
  void operator()(const T& ours, W& wire) const {
    if constexpr (Listed<T>) {
      Wire<T>::members(ours, wire, *this);
    } else if constexpr (Seconds<W>) {
      constexpr std::int64_t kSecond = 1'000'000'000;
      const std::int64_t rest = (ours % kSecond + kSecond) % kSecond;  // not below zero: nanosec is unsigned
      wire.sec(static_cast<std::int32_t>((ours - rest) / kSecond));
      wire.nanosec(static_cast<std::uint32_t>(rest));
    } else if constexpr (Numbers<W>) {
      for (std::size_t i = 0; i < ours.size(); ++i)
        *numbersOf(wire)[i] = ours[i];
    } else {
      wire = ours;
    }
  }
  template <Listed T, std::size_t N, class W>
  void operator()(const std::array<T, N>& ours, W& wire) const {
    for (std::size_t i = 0; i < N; ++i)
      (*this)(ours[i], wire[i]);
  }
  template <class T, class W>
  requires(Listed<T> || Numbers<W>) void operator()(const std::vector<T>& ours, std::vector<W>& wire) const {
    wire.resize(ours.size());
    for (std::size_t i = 0; i < ours.size(); ++i)
      (*this)(ours[i], wire[i]);
  }
};

struct CopyFromWire {
  template <class T, class W>
  void operator()(T& ours, W& wire) const {
    if constexpr (Listed<T>) {
      Wire<T>::members(ours, wire, *this);
    } else if constexpr (Seconds<W>) {
      ours = std::int64_t{1'000'000'000} * wire.sec() + wire.nanosec();
    } else if constexpr (Numbers<W>) {
      for (std::size_t i = 0; i < ours.size(); ++i)
        ours[i] = *numbersOf(wire)[i];
    } else {
      ours = wire;
    }
  }
  template <Listed T, std::size_t N, class W>
  void operator()(std::array<T, N>& ours, W& wire) const {
    for (std::size_t i = 0; i < N; ++i)
      (*this)(ours[i], wire[i]);
  }
  template <class T, class W>
  requires(Listed<T> || Numbers<W>) void operator()(std::vector<T>& ours, std::vector<W>& wire) const {
    ours.resize(wire.size());
    for (std::size_t i = 0; i < wire.size(); ++i)
      (*this)(ours[i], wire[i]);
  }
};

template <class M>
void toWire(const M& message, typename Wire<M>::Generated& wire) {
  CopyToWire{}(message, wire);
}
template <class M>
void fromWire(typename Wire<M>::Generated& wire, M& message) {
  CopyFromWire{}(message, wire);
}

/** A generated value with the success of its last decoding. */
template <class M>
struct Sample : Wire<M>::Generated {
  bool decoded = false;
};

/** Generated type support, hardened against arbitrary bytes of foreign writers. Decodes only into a Sample<M>; after a
 * failure `decoded` is false, but DDS gets success, because it would otherwise stop taking samples. */
template <class M>
class GuardedSupport : public Wire<M>::Support {
 public:
  using Generated = typename Wire<M>::Generated;

  GuardedSupport() {
    this->auto_fill_type_object(false);
    this->auto_fill_type_information(false);
    if (!this->is_plain())
      this->m_typeSize = std::min(this->m_typeSize, kUsualPayload);
  }

  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override;
  void* createData() override { return static_cast<Generated*>(new Sample<M>); }
  void deleteData(void* data) override { delete static_cast<Sample<M>*>(static_cast<Generated*>(data)); }
};

}  // namespace tandem::dds
