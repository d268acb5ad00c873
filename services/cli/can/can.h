// SPDX-License-Identifier: Apache-2.0
/** @file Helpers shared by the commands of `tandem can`. */
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hal/can/bus.h"
#include "hal/canopen/cob.h"
#include "hal/canopen/eds.h"
#include "hal/canopen/sdo_client.h"
#include "services/cli/subcommand.h"

namespace tandem::cli {

/** Options of the commands that send on a bus themselves. */
struct CanOptions {
  std::string bus;  ///< can:INTERFACE or unix:SOCKET
  bool json = false;
  bool force = false;    ///< proceed although a master is on the bus
  double timeout = 0.2;  ///< of an SDO response, s
  std::string node, object, value, file;
  std::string eds;                            ///< data sheet of the node; empty: none
  std::string first = "1000", last = "9FFF";  ///< indices of a dump without data sheet
  bool protections = false;
  double seconds = 0.0;
  double speed = 1.0;
};

/** A bus for tools: sequential SDO transfers, and reception of heartbeats. Not for periodic threads. */
class CanTool {
 public:
  /// @throw Failure if the bus cannot be opened.
  explicit CanTool(const CanOptions& options);

  /// Receives for the given time, s.
  void listen(double seconds);
  /// Refuses if a master sends SYNC or another node's heartbeat identifies it as a master: two SDO clients disturb each
  /// other. @throw Failure
  void refuseBesideMaster();
  /// State in the last heartbeat of a node, kUnknown if none was received.
  hal::canopen::NmtState state(int node) const { return states_[static_cast<std::size_t>(node)]; }

  /// Reads an object from many nodes at once; calls `take` for those that answered.
  void readMany(const std::vector<int>& nodes,
                hal::canopen::ObjectAddress object,
                const std::function<void(int node, const hal::canopen::SdoClient&)>& take);
  /// One transfer. @throw Failure with the meaning of the abort code.
  std::vector<std::uint8_t> read(int node, hal::canopen::ObjectAddress object);
  /// ... that may be refused: the abort code, kNone with `data`. @throw Failure if the node does not answer.
  hal::canopen::SdoAbort tryRead(int node, hal::canopen::ObjectAddress object, std::vector<std::uint8_t>& data);
  void write(int node, hal::canopen::ObjectAddress object, std::span<const std::uint8_t> data);

  hal::can::Bus& bus() { return *bus_; }

 private:
  void pump(std::vector<hal::canopen::SdoClient>& clients);
  void run(hal::canopen::SdoClient& client);
  void finish(hal::canopen::SdoClient& client);
  void wait(double seconds);

  const CanOptions& options_;
  std::unique_ptr<hal::can::Bus> bus_;
  std::vector<hal::canopen::NmtState> states_;
  std::uint64_t syncs_ = 0;
};

/// "6041" or "6041:2" in hexadecimal. @throw Failure
hal::canopen::ObjectAddress parseObject(const std::string& text);
/// "1" to "127". @throw Failure
int parseNode(const std::string& text);

/** A value as JSON: `bytes`, and `text`, or `unsigned` and `signed`, or `hex` of more than 8 bytes; of an integer also
 * `value`, with its sign. @param type  of the object; nothing, or one of another size: it is not known. */
nlohmann::ordered_json valueJson(const std::vector<std::uint8_t>& data, std::optional<hal::canopen::DataType> type);
/// ... as text: "-3, 0xFD (1 byte)", without a type "253, signed -3, 0xFD (1 byte)"; or "\"name\"".
std::string valueText(const std::vector<std::uint8_t>& data, std::optional<hal::canopen::DataType> type);

/// Adds a command with the options of all that send on a bus.
CLI::App* addCanCommand(CLI::App& can,
                        const std::shared_ptr<CanOptions>& options,
                        int& exit_code,
                        const std::string& name,
                        const std::string& text,
                        int (*run)(const CanOptions&));

void registerCanTools(CLI::App& can, const std::shared_ptr<CanOptions>& options, int& exit_code);
void registerCanMonitor(CLI::App& can, int& exit_code);
void registerCanSheets(CLI::App& can, const std::shared_ptr<CanOptions>& options, int& exit_code);
void registerCanImport(CLI::App& can, int& exit_code);

}  // namespace tandem::cli
