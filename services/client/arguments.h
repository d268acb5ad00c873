// SPDX-License-Identifier: Apache-2.0
/** @file Helpers shared by clients of a robot: exit codes, failures, input files. */
#pragma once

#include <chrono>
#include <functional>
#include <iosfwd>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

namespace tandem::config {
class Error;
}

namespace tandem::client {

/** Exit codes of `tandem`. */
enum ExitCode : int {
  kOk = 0,
  kFailure = 1,  ///< the command ran without success: rows refused, points not converged, a process ended
  kUsage = 2,    ///< the command line or a file is wrong
};

/** A failure with a message for people; the command ends with `code`. */
class Failure : public std::runtime_error {
 public:
  Failure(int code, const std::string& message) : std::runtime_error(message), code_(code) {}
  int code() const { return code_; }

 private:
  int code_;
};

/// Seconds since `start`.
inline double since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Input file, or standard input for "-". @throw Failure(kUsage) if it cannot be opened.
std::shared_ptr<std::istream> openInput(const std::string& path);

/// Failure of a stream that could not be opened or written: "FILE: cannot be written: No space left on device", from
/// errno.
[[noreturn]] void failToWrite(int code, const std::string& file);

/// Whether this program's results and refusals are JSON (--json). Set before a command runs.
bool& asJson();

/// Prints a result: `text` and a line break, or `fields` where asJson().
void answer(const std::string& text, const nlohmann::ordered_json& fields);

/// Prints why a command was refused or failed: the text to stderr; where asJson() also
/// {"error": {"message": text, ...}, "exit": code} to stdout, as one line. @param place  further members of "error"
void refuse(int code, const std::string& text, const nlohmann::ordered_json& place = nlohmann::ordered_json::object());

/// Each error of a file: line, column, key and text.
nlohmann::ordered_json errorsJson(const config::Error& error);

/// Runs a subcommand's body: prints failures by refuse(), sets the exit code.
void guarded(int& exit_code, const std::function<int()>& body);

/// CSV field of a text: commas become semicolons, line breaks and quotes become spaces, so that `status` stays one
/// column.
std::string statusField(std::string text);

/// Path of an installed or source-tree data file (plotting script). @throw Failure if it is not found.
std::string shareFile(const std::string& relative);

}  // namespace tandem::client
