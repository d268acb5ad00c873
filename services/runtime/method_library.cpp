// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/method_library.h"

#include <dlfcn.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <exception>
#include <regex>
#include <stdexcept>

#include "control/method_check.h"
#include "control/method_names.h"
#include "services/runtime/allocation_counter.h"

namespace tandem::runtime {
namespace {

constexpr int kLongestCheck = 30;        // s
constexpr char kGood = '+', kBad = '-';  // first byte of the child's result

std::string foundAndExpected(const char* what, std::uint64_t found, std::uint64_t expected, const char* why) {
  return std::string("found another binary interface: ") + what + " " + std::to_string(found) + ", expected " +
         std::to_string(expected) + " (" + why + "); build it against the installed headers with the target's options";
}

std::string differenceOf(const control::MethodAbi& found, const control::MethodAbi& expected) {
  if (found.interface != expected.interface)
    return foundAndExpected("version", found.interface, expected.interface, "of control/foreign_method.h");
  if (found.eigen_alignment != expected.eigen_alignment)
    return foundAndExpected("Eigen alignment", found.eigen_alignment, expected.eigen_alignment,
                            "bytes; -mavx and -march=native change it");
  if (found.eigen_version != expected.eigen_version)
    return foundAndExpected("Eigen version", found.eigen_version, expected.eigen_version, "major, minor, patch");
  if (found.compiler_abi != expected.compiler_abi)
    return foundAndExpected("compiler ABI", found.compiler_abi, expected.compiler_abi, "__GXX_ABI_VERSION");
  if (found.layout != expected.layout)
    return foundAndExpected("layout hash", found.layout, expected.layout, "of the headers in control/");
  return {};
}

/// @throw std::invalid_argument "found ..., expected ..."
const control::ForeignMethod& open(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored))
    throw std::invalid_argument("found no such file, expected a shared library with a method (docs/own-method.md)");
  void* const library = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr)
    throw std::invalid_argument(std::string("found a file that cannot be loaded: ") + ::dlerror() +
                                "; expected a shared library with a method (docs/own-method.md)");
  const auto* const method = static_cast<const control::ForeignMethod*>(::dlsym(library, control::kForeignSymbol));
  if (method == nullptr)
    throw std::invalid_argument(std::string("found no symbol ") + control::kForeignSymbol +
                                ", expected a library that uses TANDEM_METHOD once (docs/own-method.md)");
  // Only the ABI header is read before it is compared.
  if (const std::string difference = differenceOf(method->abi, control::methodAbi()); !difference.empty())
    throw std::invalid_argument(difference);
  const std::string name = method->name == nullptr ? "" : method->name;
  if (!std::regex_match(name, std::regex("[a-z][a-z0-9-]{0,39}")) || idl::fromName<control::Method>(name))
    throw std::invalid_argument("found the name '" + name +
                                "', expected at most 40 small letters, digits and -, a "
                                "letter first, and none of " +
                                control::methodList());
  return *method;
}

/// Work of the child process. @throw std::exception with the reason of a refusal @return remarks
std::string openAndCheck(const std::filesystem::path& file, const control::CheckConditions& conditions) {
  const auto resolver = open(file).make(conditions.parameters);
  if (!resolver)
    throw std::invalid_argument("the factory of the library returned a null pointer, expected a Resolver");
  const control::CheckResult result = checkMethod(*resolver, conditions);
  if (!result.refusal.empty())
    throw std::invalid_argument(result.refusal);
  return result.remarks;
}

int child_answer = -1;

void reply(char verdict, const std::string& text) {
  const std::string line = verdict + text;
  // A pipe accepts this size at once; otherwise the parent receives no result.
  [[maybe_unused]] const auto written = ::write(child_answer, line.data(), std::min<std::size_t>(line.size(), 4000));
}

/// Terminate handler: an exception that leaves noexcept code ends the child.
[[noreturn]] void sayException() {
  std::string what = "an unknown exception";
  try {
    if (const auto exception = std::current_exception())
      std::rethrow_exception(exception);
    what = "std::terminate()";
  } catch (const std::exception& exception) {
    what = std::string("an exception, '") + exception.what() + "'";
  } catch (...) {  // NOLINT(bugprone-empty-catch): not a std::exception, `what` is set above
  }
  reply(kBad, "found " + what + ", expected resolve() to throw nothing");
  ::_exit(0);
}

[[noreturn]] void runChild(const std::filesystem::path& file, const control::CheckConditions& conditions) {
  std::set_terminate(sayException);
  try {
    reply(kGood, openAndCheck(file, conditions));
  } catch (const std::exception& error) {
    reply(kBad, error.what());
  }
  ::_exit(0);  // no destructors: the parent runs them
}

/// Reads the pipe until it is closed. @return false after the time-out
bool readAnswer(int pipe, std::string& answer) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::seconds(kLongestCheck);
  std::array<char, 512> bytes{};
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
    pollfd wait{pipe, POLLIN, 0};
    const int ready = left <= 0 ? 0 : ::poll(&wait, 1, static_cast<int>(left));
    if (ready < 0 && errno == EINTR)
      continue;
    if (ready <= 0)
      return false;
    const auto size = ::read(pipe, bytes.data(), bytes.size());
    if (size < 0 && errno == EINTR)
      continue;
    if (size <= 0)
      return true;
    answer.append(bytes.data(), static_cast<std::size_t>(size));
  }
}

/// Opens and checks the library in a child process. @throw std::invalid_argument @return remarks
std::string checkApart(const std::filesystem::path& file, const control::CheckConditions& conditions) {
  std::array<int, 2> ends{};
  if (::pipe(ends.data()) != 0)
    throw std::runtime_error(std::string("pipe: ") + std::strerror(errno));
  const pid_t child = ::fork();
  if (child == 0) {
    ::close(ends[0]);
    child_answer = ends[1];
    runChild(file, conditions);
  }
  ::close(ends[1]);
  std::string answer;
  const bool in_time = child > 0 && readAnswer(ends[0], answer);
  ::close(ends[0]);
  if (child < 0)
    throw std::runtime_error(std::string("fork: ") + std::strerror(errno));
  if (!in_time)
    ::kill(child, SIGKILL);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!in_time)
    throw std::invalid_argument("found no answer of the method within " + std::to_string(kLongestCheck) +
                                " s, expected one");
  if (answer.empty()) {
    const std::string how = WIFSIGNALED(status) ? ::strsignal(WTERMSIG(status)) : "exit";
    throw std::invalid_argument("the method ended the process of the check (" + how + ") before it returned a result");
  }
  if (answer.front() != kGood)
    throw std::invalid_argument(answer.substr(1));
  return answer.substr(1);
}

}  // namespace

std::string loadMethod(const std::filesystem::path& library, double period, config::Robot& robot) {
  if (library.empty())
    return {};
  // Absolute, because dlopen() searches the library path for a name without a slash.
  const std::filesystem::path file = std::filesystem::absolute(library);
  control::CheckConditions conditions;
  conditions.parameters = robot.parameters;
  conditions.judge_time = period > 0.0;
  if (period > 0.0)
    conditions.parameters.period = period;
  for (const config::Arm& arm : robot.arms)
    conditions.limits.push_back(&arm.limits);
  if (canCountAllocations != nullptr && canCountAllocations())
    conditions.allocation_count = allocationCount;
  try {
    const std::string remarks = checkApart(file, conditions);
    robot.parameters.foreign = &open(file);
    return std::string("foreign method ") + robot.parameters.foreign->name + " of " + file.string() + ": " + remarks;
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(file.string() + ": " + error.what());
  }
}

std::string loadMethod(const config::Deployment& deployment, config::Robot& robot) {
  const bool real_time = deployment.clock == config::ClockMode::kRealTime;
  try {
    return loadMethod(deployment.method_library, real_time ? deployment.control_period : 0.0, robot);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(deployment.file.string() + ": method_library: " + error.what());
  }
}

std::string describeMethod(control::Method method, const config::Deployment& deployment, const config::Robot& robot) {
  std::string text(name(method));
  if (method == control::Method::kForeign && robot.parameters.foreign != nullptr)
    text += std::string(": ") + robot.parameters.foreign->name + " of " + deployment.method_library.string();
  return text;
}

}  // namespace tandem::runtime
