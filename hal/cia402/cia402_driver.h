// SPDX-License-Identifier: Apache-2.0
/** @file Drive of the profile CiA 402 and encoder of CiA 406 on a CANopen bus. */
#pragma once

#include <cstdint>
#include <string>

#include "hal/axis_driver.h"
#include "hal/canopen/network.h"
#include "hal/cia402/mode_confirmation.h"
#include "hal/cia402/pdo_slots.h"
#include "hal/cia402/sdo_jobs.h"
#include "hal/cia402/temperature.h"
#include "hal/encoder_reading.h"
#include "hal/hardware.h"
#include "safety/budgets.h"

namespace tandem::hal {

/** Drive and encoder of one axis: reads and writes the PDOs of their nodes, and accesses their objects one after the
 * other; sends nothing by itself. Nothing after construction allocates, locks or throws, except texts. */
class Cia402Driver final : public AxisDriver {
 public:
  /** Adds the nodes to the network, which must outlive the driver.
   * @throw std::invalid_argument as Network::addNode() does. */
  Cia402Driver(const HardwareConfig& hardware,
               const AxisConfig& config,
               canopen::Network& network,
               const safety::Budgets& budgets);

  void boot(std::int64_t now) noexcept override;
  void update(std::int64_t now) noexcept override;
  DriverPhase phase() const noexcept override { return phase_; }
  ProtectionMask lostProtections() const noexcept override { return driveNode().lostProtections(); }
  const DriveFeedback& drive() const noexcept override { return feedback_; }
  const EncoderFeedback& encoder() const noexcept override { return encoder_feedback_; }
  DriveInputs inputs(bool of_status) const noexcept override;
  bool emergency() const noexcept override { return emergency_ || encoder_emergency_; }
  std::uint16_t errorCode() const noexcept override { return error_code_; }
  double temperature() const noexcept override { return temperature_.value(); }
  void command(const DriveCommand& command, std::int64_t now) noexcept override;
  void setLimits(double lower, double upper) noexcept override;
  Progress limits() const noexcept override { return limits_; }
  void prepare(DriveTask task) noexcept override;
  Progress prepared() const noexcept override { return prepared_; }
  Progress confirmed() const noexcept override;
  void startHoming() noexcept override { mode_bits_ = controlword::kStartHoming; }
  void endHoming() noexcept override { mode_bits_ = 0; }
  Progress homing() const noexcept override;
  bool setBrake(bool closed) noexcept override;
  Progress brake() const noexcept override { return progressOf(brake_jobs_.status()); }
  std::string deviceName(bool encoder) const override;
  std::string describe(const DeviceFailure& failure, bool encoder) const override;
  std::string remarks() const override;

  void onEmcy(int node, const canopen::Emcy& emcy) noexcept;
  bool isEncoder(int node) const noexcept { return node == encoder_; }
  canopen::Node& driveNode() noexcept { return network_.node(drive_); }
  const canopen::Node& driveNode() const noexcept { return network_.node(drive_); }
  /// Encoder node; nullptr: none.
  const canopen::Node* encoderNode() const noexcept { return encoder_ < 0 ? nullptr : &network_.node(encoder_); }

 private:
  static Progress progressOf(SdoJobs::Status status) noexcept { return static_cast<Progress>(status); }
  const canopen::Node& nodeOf(bool encoder) const noexcept;
  void updateNodes(std::int64_t now) noexcept;
  bool refusedForCounts() noexcept;
  std::string describeUnits(const canopen::ObjectAddress& object, std::uint64_t stated) const;
  void readDrive() noexcept;
  void readEncoder() noexcept;
  void stepJobs(std::int64_t now) noexcept;
  void stepMode(std::int64_t now) noexcept;
  void stepTemperature(std::int64_t now) noexcept;
  /// No access of brake, mode or temperature runs.
  bool sdoFree() const noexcept;
  bool idle() const noexcept { return sdoFree() && jobs_.status() != SdoJobs::Status::kBusy; }
  std::int64_t maximumTorque(bool push) const noexcept;

  AxisConfig config_;
  canopen::Network& network_;
  int drive_;
  DriveSlots slots_;
  CompleteSamples samples_;
  int encoder_ = -1;
  EncoderSlots encoder_slots_;
  CompleteSamples encoder_samples_;
  AxisUnits units_;  ///< from the drive's own zero
  EncoderReading encoder_reading_;
  DriverPhase phase_ = DriverPhase::kBooting;
  DriveFeedback feedback_;
  EncoderFeedback encoder_feedback_;
  std::uint16_t statusword_ = 0;
  bool operation_ = false;       ///< operation enabled at the last command
  std::uint16_t mode_bits_ = 0;  ///< of the controlword
  std::int64_t sampled_ = 0;     ///< time of the last SYNC, ns: sampling time of the TPDOs of this period
  SdoJobs jobs_;                 ///< of limits and of prepare()
  SdoJobs brake_jobs_{true};
  ModeConfirmation mode_;
  bool wrong_mode_ = false;
  Temperature temperature_;
  Progress limits_ = Progress::kIdle;
  Progress prepared_ = Progress::kIdle;
  std::uint16_t error_code_ = 0;
  bool emergency_ = false;
  bool encoder_emergency_ = false;
};

/// What a drive has stated of its units at its boot.
StatedFactors statedFactors(const canopen::Node& drive) noexcept;

/// Node failure in the numbers of an event, and back.
DeviceFailure deviceFailure(const canopen::NodeFailure& failure) noexcept;
canopen::NodeFailure nodeFailure(const DeviceFailure& failure) noexcept;

}  // namespace tandem::hal
