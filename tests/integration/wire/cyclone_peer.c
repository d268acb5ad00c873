// SPDX-License-Identifier: Apache-2.0
/* A peer on Cyclone DDS, with types that its own IDL compiler made. Ends when its standard input closes.
 *
 *   cyclone_peer read DOMAIN PREFIX    prints every arm_a/measured_js and actuation/state, exactly
 *   cyclone_peer bad DOMAIN PREFIX     writes actuation/state with arm_count 9 and 2 in turn
 */
#include <dds/dds.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "sensor_msgs.h"
#include "tandem_msgs.h"

static int inputClosed(int milliseconds) {
  struct pollfd input = {STDIN_FILENO, POLLIN, 0};
  char byte;
  return poll(&input, 1, milliseconds) == 1 && read(STDIN_FILENO, &byte, 1) <= 0;
}

static dds_entity_t checked(dds_entity_t entity, const char* what) {
  if (entity < 0) {
    fprintf(stderr, "cyclone_peer: %s: %s\n", what, dds_strretcode(-entity));
    exit(1);
  }
  return entity;
}

static void printNumbers(const double* values, uint32_t count) {
  for (uint32_t i = 0; i < count; ++i) {
    printf("%a ", values[i]);
  }
}

static void printState(const tandem_msgs_msg_ActuationState* s) {
  printf("state %llu %llu %lld %llu %u %u ", (unsigned long long)s->session, (unsigned long long)s->sequence,
         (long long)s->stamp, (unsigned long long)s->answers_command, s->lock_step, s->arm_count);
  for (int arm = 0; arm < 8; ++arm) {
    printf("%u %u %u %u ", s->joint_count[arm], s->valid[arm], s->operating_state[arm], s->faults[arm]);
  }
  printNumbers(s->position, 64);
  printNumbers(s->velocity, 64);
  printNumbers(s->setpoint, 64);
  printf("\n");
}

static void printJoints(const sensor_msgs_msg_JointState* j) {
  printf("joints %d %u %s ", j->header.stamp.sec, j->header.stamp.nanosec, j->header.frame_id);
  for (uint32_t i = 0; i < j->name._length; ++i) {
    printf("%s ", j->name._buffer[i]);
  }
  printf("| ");
  printNumbers(j->position._buffer, j->position._length);
  printf("| ");
  printNumbers(j->velocity._buffer, j->velocity._length);
  printf("| ");
  printNumbers(j->effort._buffer, j->effort._length);
  printf("\n");
}

static void readAll(dds_entity_t state_reader, dds_entity_t joints_reader) {
  void* sample[1] = {NULL};
  dds_sample_info_t info;
  while (dds_take(state_reader, sample, &info, 1, 1) == 1) {
    if (info.valid_data) {
      printState(sample[0]);
    }
    dds_return_loan(state_reader, sample, 1);
    sample[0] = NULL;
  }
  while (dds_take(joints_reader, sample, &info, 1, 1) == 1) {
    if (info.valid_data) {
      printJoints(sample[0]);
    }
    dds_return_loan(joints_reader, sample, 1);
    sample[0] = NULL;
  }
  fflush(stdout);
}

static void runBad(dds_entity_t writer) {
  tandem_msgs_msg_ActuationState state;
  memset(&state, 0, sizeof(state));
  while (!inputClosed(10)) {
    ++state.sequence;
    state.arm_count = state.sequence % 2 == 0 ? 2 : 9;
    checked(dds_write(writer, &state), "write");
  }
}

int main(int argc, char** argv) {
  if (argc != 4) {
    fprintf(stderr, "usage: cyclone_peer read|bad DOMAIN PREFIX\n");
    return 2;
  }
  const dds_entity_t participant =
      checked(dds_create_participant((dds_domainid_t)atoi(argv[2]), NULL, NULL), "participant");
  // ROS 2's names for topics and types.
  dds_topic_descriptor_t state_type = tandem_msgs_msg_ActuationState_desc;
  state_type.m_typename = "tandem_msgs::msg::dds_::ActuationState_";
  dds_topic_descriptor_t joints_type = sensor_msgs_msg_JointState_desc;
  joints_type.m_typename = "sensor_msgs::msg::dds_::JointState_";
  char state_name[200], joints_name[200];
  snprintf(state_name, sizeof(state_name), "rt/%s/actuation/state", argv[3]);
  snprintf(joints_name, sizeof(joints_name), "rt/%s/arm_a/measured_js", argv[3]);
  const dds_entity_t state_topic = checked(dds_create_topic(participant, &state_type, state_name, NULL, NULL), "topic");
  const dds_entity_t joints_topic =
      checked(dds_create_topic(participant, &joints_type, joints_name, NULL, NULL), "topic");

  dds_qos_t* qos = dds_create_qos();
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 1000);
  dds_qset_reliability(qos, DDS_RELIABILITY_BEST_EFFORT, 0);
  if (strcmp(argv[1], "bad") == 0) {
    runBad(checked(dds_create_writer(participant, state_topic, qos, NULL), "writer"));
  } else {
    const dds_entity_t state_reader = checked(dds_create_reader(participant, state_topic, qos, NULL), "reader");
    // What a default ROS 2 subscription asks for.
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
    const dds_entity_t joints_reader = checked(dds_create_reader(participant, joints_topic, qos, NULL), "reader");
    while (!inputClosed(5)) {
      readAll(state_reader, joints_reader);
    }
  }
  dds_delete_qos(qos);
  dds_delete(participant);
  return 0;
}
