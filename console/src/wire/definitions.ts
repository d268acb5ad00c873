// SPDX-License-Identifier: Apache-2.0
/** Message definitions of the published topics, from idl/msg: the same files that ROS 2 users get. */
import clockRequest from "@msg/tandem_msgs/ClockRequest.msg?raw";
import computationRequest from "@msg/tandem_msgs/ComputationRequest.msg?raw";
import controlRequest from "@msg/tandem_msgs/ControlRequest.msg?raw";
import halRequest from "@msg/tandem_msgs/HalRequest.msg?raw";
import parameterSetting from "@msg/tandem_msgs/ParameterSetting.msg?raw";
import planningRequest from "@msg/tandem_msgs/PlanningRequest.msg?raw";
import stop from "@msg/tandem_msgs/Stop.msg?raw";
import teleopInput from "@msg/tandem_msgs/TeleopInput.msg?raw";
import tipTarget from "@msg/tandem_msgs/TipTarget.msg?raw";

export interface Published {
  /** Relative to the prefix. */
  topic: string;
  schemaName: string;
  schema: string;
  /** Viewers may publish it, too. */
  viewers?: boolean;
}

/** Definition of a message with those of the messages in it, as in bag files of ROS 2. */
const withParts = (definition: string, parts: Record<string, string>): string =>
  [definition, ...Object.entries(parts).map(([name, part]) => `MSG: ${name}\n${part}`)].join(`\n${"=".repeat(80)}\n`);

export const messages: readonly Published[] = [
  { topic: "control/request", schemaName: "tandem_msgs/msg/ControlRequest", schema: controlRequest },
  { topic: "planning/request", schemaName: "tandem_msgs/msg/PlanningRequest", schema: planningRequest },
  {
    topic: "planning/compute",
    schemaName: "tandem_msgs/msg/ComputationRequest",
    schema: withParts(computationRequest, {
      "tandem_msgs/TipTarget": tipTarget,
      "tandem_msgs/ParameterSetting": parameterSetting,
    }),
  },
  { topic: "hal/request", schemaName: "tandem_msgs/msg/HalRequest", schema: halRequest },
  { topic: "clock/request", schemaName: "tandem_msgs/msg/ClockRequest", schema: clockRequest, viewers: true },
  { topic: "teleop/input", schemaName: "tandem_msgs/msg/TeleopInput", schema: teleopInput },
  { topic: "stop", schemaName: "tandem_msgs/msg/Stop", schema: stop, viewers: true },
];
