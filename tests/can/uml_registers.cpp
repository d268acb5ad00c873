// SPDX-License-Identifier: Apache-2.0
/** @file LD_PRELOAD library that lets user-mode Linux run on processors with larger register sets than it supports.
 *
 * User-mode Linux saves and restores the registers of its processes by ptrace, in a buffer that ends with AVX-512
 * and the protection keys. The host's kernel transfers the complete state or nothing, and with AMX the state is
 * larger: the first process of the guest ends with "ptrace set fp regs failed". This library enlarges the buffer to
 * the host's state; the part beyond the guest's is zero. Nothing is lost: AMX must be requested, and the guest has
 * no system call for it. */
#include <cpuid.h>
#include <dlfcn.h>
#include <elf.h>
#include <sys/ptrace.h>
#include <sys/uio.h>

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdint>
#include <cstring>

namespace {

using Ptrace = long (*)(int, ...);

constexpr std::size_t kRoom = 64 * 1024;
constexpr std::size_t kPresent = 512;          // offset of the bit mask of present components
constexpr std::uint64_t kKept = 0b1011100111;  // x87, SSE, AVX, three parts of AVX-512, protection keys

alignas(64) std::array<unsigned char, kRoom> room;

/// Size of the complete processor state that the kernel has enabled, bytes.
std::size_t wholeState() {
  unsigned enabled = 0, other = 0;
  __get_cpuid_count(0xd, 0, &other, &enabled, &other, &other);
  return std::min<std::size_t>(enabled, kRoom);
}

long registers(Ptrace real, int request, int pid, void* kind, iovec& guest) {
  static const std::size_t size = wholeState();
  if (guest.iov_len >= size)
    return real(request, pid, kind, &guest);
  room.fill(0);
  iovec all{room.data(), size};
  if (request == PTRACE_SETREGSET) {
    std::memcpy(room.data(), guest.iov_base, guest.iov_len);
    return real(request, pid, kind, &all);
  }
  const long result = real(request, pid, kind, &all);
  if (result == 0) {
    std::uint64_t present = 0;
    std::memcpy(&present, room.data() + kPresent, sizeof present);
    present &= kKept;
    std::memcpy(room.data() + kPresent, &present, sizeof present);
    std::memcpy(guest.iov_base, room.data(), guest.iov_len);
  }
  return result;
}

}  // namespace

extern "C" long ptrace(enum __ptrace_request request, ...) noexcept {
  static const auto real = reinterpret_cast<Ptrace>(dlsym(RTLD_NEXT, "ptrace"));
  va_list rest;
  va_start(rest, request);
  const int pid = va_arg(rest, int);
  void* const address = va_arg(rest, void*);
  void* const data = va_arg(rest, void*);
  va_end(rest);
  const bool whole = (request == PTRACE_GETREGSET || request == PTRACE_SETREGSET) && data != nullptr &&
                     reinterpret_cast<std::uintptr_t>(address) == NT_X86_XSTATE;
  return whole ? registers(real, request, pid, address, *static_cast<iovec*>(data)) : real(request, pid, address, data);
}
