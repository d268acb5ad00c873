// SPDX-License-Identifier: Apache-2.0
/** Message definitions of the published topics, from idl/msg: the same files that ROS 2 users get. */
import clockRequest from "@msg/tandem_msgs/ClockRequest.msg?raw";
import controlRequest from "@msg/tandem_msgs/ControlRequest.msg?raw";
import halRequest from "@msg/tandem_msgs/HalRequest.msg?raw";
import planningRequest from "@msg/tandem_msgs/PlanningRequest.msg?raw";
import stop from "@msg/tandem_msgs/Stop.msg?raw";
import teleopInput from "@msg/tandem_msgs/TeleopInput.msg?raw";

export interface Published {
  /** Relative to the prefix. */
  topic: string;
  schemaName: string;
  schema: string;
  /** Viewers may publish it, too. */
  viewers?: boolean;
}

export const messages: readonly Published[] = [
  { topic: "control/request", schemaName: "tandem_msgs/msg/ControlRequest", schema: controlRequest },
  { topic: "planning/request", schemaName: "tandem_msgs/msg/PlanningRequest", schema: planningRequest },
  { topic: "hal/request", schemaName: "tandem_msgs/msg/HalRequest", schema: halRequest },
  { topic: "clock/request", schemaName: "tandem_msgs/msg/ClockRequest", schema: clockRequest, viewers: true },
  { topic: "teleop/input", schemaName: "tandem_msgs/msg/TeleopInput", schema: teleopInput },
  { topic: "stop", schemaName: "tandem_msgs/msg/Stop", schema: stop, viewers: true },
];
