// SPDX-License-Identifier: Apache-2.0
/* A CRTK client on Cyclone DDS: it knows no lease and no echo, and none of our code. Enables both arms by
 * pair/state_command, then streams arm_a/servo_cp, STEP mm further along y 100 times a second, and disables. Prints a
 * line of JSON with what it read of measured_js, measured_cp, operating_state and control/status.
 *
 *   crtk_peer DOMAIN PREFIX SAMPLES STEP_MM
 */
#include <dds/dds.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "crtk_msgs.h"
#include "geometry_msgs.h"
#include "sensor_msgs.h"
#include "tandem_msgs.h"

static dds_entity_t participant;
static dds_qos_t* qos;
static const char* prefix;

static dds_entity_t checked(dds_entity_t entity, const char* what) {
  if (entity < 0) {
    fprintf(stderr, "crtk_peer: %s: %s\n", what, dds_strretcode(-entity));
    exit(1);
  }
  return entity;
}

/* ROS 2's names for topics and types. */
static dds_entity_t topic(const dds_topic_descriptor_t* generated, const char* type, const char* name) {
  dds_topic_descriptor_t* named = malloc(sizeof(*named));  // for as long as the process lives
  char full[200];
  memcpy(named, generated, sizeof(*named));  // some of its members are const
  named->m_typename = (char*)type;
  snprintf(full, sizeof(full), "rt/%s/%s", prefix, name);
  return checked(dds_create_topic(participant, named, full, NULL, NULL), name);
}

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void stampNow(std_msgs_msg_Header* header) {
  struct timespec t;
  clock_gettime(CLOCK_REALTIME, &t);
  header->stamp.sec = (int32_t)t.tv_sec;
  header->stamp.nanosec = (uint32_t)t.tv_nsec;
}

/* Takes what came; copies the last valid sample through `keep`. */
static int takeLast(dds_entity_t reader, void (*keep)(const void*)) {
  void* sample[1] = {NULL};
  dds_sample_info_t info;
  int count = 0;
  while (dds_take(reader, sample, &info, 1, 1) == 1) {
    if (info.valid_data) {
      keep(sample[0]);
      ++count;
    }
    dds_return_loan(reader, sample, 1);
    sample[0] = NULL;
  }
  return count;
}

static geometry_msgs_msg_PoseStamped pose;
static double joints[16];
static uint32_t joint_count;
static char state[32];
static tandem_msgs_msg_ControlStatus status;

static double oldest, newest; /* largest and smallest age of a pose by this host's wall clock, s */

static void keepPose(const void* m) {
  std_msgs_msg_Header own;
  memset(&own, 0, sizeof(own));
  stampNow(&own);
  const bool first = pose.header.stamp.sec == 0;
  pose = *(const geometry_msgs_msg_PoseStamped*)m;
  const double age = (double)own.stamp.sec - (double)pose.header.stamp.sec +
                     1e-9 * ((double)own.stamp.nanosec - (double)pose.header.stamp.nanosec);
  oldest = first || age > oldest ? age : oldest;
  newest = first || age < newest ? age : newest;
}
static void keepState(const void* m) {
  snprintf(state, sizeof(state), "%s", ((const crtk_msgs_msg_OperatingState*)m)->state);
}
static void keepStatus(const void* m) { status = *(const tandem_msgs_msg_ControlStatus*)m; }
static void keepJoints(const void* m) {
  const sensor_msgs_msg_JointState* j = m;
  joint_count = j->position._length < 16 ? j->position._length : 16;
  memcpy(joints, j->position._buffer, joint_count * sizeof(double));
}

static dds_entity_t poses, js, states, statuses, commands, servo;

static void look(void) {
  takeLast(poses, keepPose);
  takeLast(js, keepJoints);
  takeLast(states, keepState);
  takeLast(statuses, keepStatus);
}

/* `header`: of which it carries the stamp. */
static void command(const char* word, const std_msgs_msg_Header* header) {
  crtk_msgs_msg_StringStamped message;
  memset(&message, 0, sizeof(message));
  message.header.frame_id = (char*)"";
  message.header.stamp = header->stamp;
  message.string = (char*)word;
  dds_write(commands, &message);
}

/* What may give no power: our own clock's time, no time, and what we saw `seconds` ago. */
static void tryStale(double seconds) {
  const std_msgs_msg_Header seen = pose.header;
  std_msgs_msg_Header own, none;
  memset(&own, 0, sizeof(own));
  memset(&none, 0, sizeof(none));
  stampNow(&own);
  const double until = now() + seconds + 0.5;
  for (int round = 0; now() < until; ++round) {
    command("enable", &own);
    command("enable", &none);
    if (now() > until - 0.5) {
      command("enable", &seen);
    }
    dds_sleepfor(DDS_MSECS(100));  // the rate of the attempts, not a wait
    look();
    if (strcmp(state, "DISABLED") != 0) {
      fprintf(stderr, "crtk_peer: a stale command led to '%s'\n", state);
      exit(1);
    }
  }
}

/* Repeats a command until the arm is in the state that follows. */
static void reach(const char* word, const char* wanted) {
  const double deadline = now() + 20.0;
  for (int round = 0; strcmp(state, wanted) != 0; ++round) {
    if (now() > deadline) {
      fprintf(stderr, "crtk_peer: '%s' did not lead to %s but to '%s'\n", word, wanted, state);
      exit(1);
    }
    if (round % 20 == 0) {
      command(word, &pose.header);
    }
    dds_sleepfor(DDS_MSECS(10));
    look();
  }
}

int main(int argc, char** argv) {
  if (argc != 6) {
    fprintf(stderr, "usage: crtk_peer DOMAIN PREFIX SAMPLES STEP_MM STALE_S\n");
    return 2;
  }
  prefix = argv[2];
  const int samples = atoi(argv[3]);
  const double step = 1e-3 * atof(argv[4]);
  qos = dds_create_qos();
  dds_qset_entity_name(qos, "crtk_peer");
  participant = checked(dds_create_participant((dds_domainid_t)atoi(argv[1]), qos, NULL), "participant");
  dds_delete_qos(qos);
  qos = dds_create_qos();
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 10);
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  poses = checked(dds_create_reader(participant,
                                    topic(&geometry_msgs_msg_PoseStamped_desc, "geometry_msgs::msg::dds_::PoseStamped_",
                                          "arm_a/measured_cp"),
                                    qos, NULL),
                  "reader");
  js = checked(dds_create_reader(
                   participant,
                   topic(&sensor_msgs_msg_JointState_desc, "sensor_msgs::msg::dds_::JointState_", "arm_a/measured_js"),
                   qos, NULL),
               "reader");
  servo = checked(dds_create_writer(participant,
                                    topic(&geometry_msgs_msg_PoseStamped_desc, "geometry_msgs::msg::dds_::PoseStamped_",
                                          "arm_a/servo_cp"),
                                    qos, NULL),
                  "writer");
  commands = checked(dds_create_writer(participant,
                                       topic(&crtk_msgs_msg_StringStamped_desc, "crtk_msgs::msg::dds_::StringStamped_",
                                             "pair/state_command"),
                                       qos, NULL),
                     "writer");
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  states = checked(dds_create_reader(participant,
                                     topic(&crtk_msgs_msg_OperatingState_desc, "crtk_msgs::msg::dds_::OperatingState_",
                                           "pair/operating_state"),
                                     qos, NULL),
                   "reader");
  dds_qset_durability(qos, DDS_DURABILITY_VOLATILE);
  dds_qset_reliability(qos, DDS_RELIABILITY_BEST_EFFORT, 0);
  statuses = checked(dds_create_reader(participant,
                                       topic(&tandem_msgs_msg_ControlStatus_desc,
                                             "tandem_msgs::msg::dds_::ControlStatus_", "control/status"),
                                       qos, NULL),
                     "reader");
  const double deadline = now() + 20.0;
  while (((pose.header.stamp.sec == 0 && pose.header.stamp.nanosec == 0) || state[0] == 0) && now() < deadline) {
    dds_sleepfor(DDS_MSECS(10));
    look();
  }
  tryStale(atof(argv[5]));
  reach("enable", "ENABLED");
  geometry_msgs_msg_PoseStamped target = pose;
  const double from = pose.pose.position.y;
  int obeyed = 0;
  for (int i = 0; i < samples; ++i) {
    target.pose.position.y += step;
    target.header.frame_id = (char*)"";
    stampNow(&target.header);
    dds_write(servo, &target);
    dds_sleepfor(DDS_MSECS(10));  // the rate of the stream, not a wait
    look();
    obeyed += status.source == 3 ? 1 : 0;
  }
  const double asked = target.pose.position.y - from;
  reach("disable", "DISABLED");
  printf(
      "{\"oldest\": %.9g, \"newest\": %.9g, \"asked\": %.9g, \"moved\": %.9g, \"cycles_by_crtk\": %d, \"joint_count\": "
      "%u, \"status\": %llu, \"states\": "
      "\"%s\"}\n",
      oldest, newest, asked, pose.pose.position.y - from, obeyed, joint_count, (unsigned long long)status.sequence,
      state);
  dds_delete_qos(qos);
  dds_delete(participant);
  return 0;
}
