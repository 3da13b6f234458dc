/* A subscriber in plain C that knows perimap by its IDL file alone (perimap.h is what idlc makes of perimap.idl), and
 * by the topic's name. Counts the gaps in the sequence numbers.
 *
 *   c_subscriber DOMAIN SAMPLES
 *
 * Exit code 0 when sequence numbers 0 to SAMPLES - 1 all came, in order; 1 when the writer has gone before that or when
 * any is missing. */
#include <dds/dds.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "perimap.h"

enum { kDepth = 16 };

static dds_entity_t checked(dds_entity_t entity, const char* what) {
  if (entity < 0) {
    fprintf(stderr, "c_subscriber: %s: %s\n", what, dds_strretcode(entity));
    exit(1);
  }
  return entity;
}

int main(int argc, char** argv) {
  if (argc != 3) {
    fprintf(stderr, "c_subscriber DOMAIN SAMPLES\n");
    return 2;
  }
  const uint64_t samples = strtoull(argv[2], NULL, 10);
  const dds_entity_t participant =
      checked(dds_create_participant((dds_domainid_t)atoi(argv[1]), NULL, NULL), "participant");
  const dds_entity_t topic =
      checked(dds_create_topic(participant, &perimap_Surface_desc, "perimap/surface", NULL, NULL), "topic");
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, kDepth);
  const dds_entity_t reader = checked(dds_create_reader(participant, topic, qos, NULL), "reader");
  dds_delete_qos(qos);
  const dds_entity_t condition = checked(dds_create_readcondition(reader, DDS_ANY_STATE), "condition");
  const dds_entity_t wait_set = checked(dds_create_waitset(participant), "wait set");
  checked(dds_waitset_attach(wait_set, condition, 0), "wait set");

  uint64_t expected = 0;
  uint64_t missing = 0;
  bool writer_gone = false;
  while (expected < samples && !writer_gone) {
    checked(dds_waitset_wait(wait_set, NULL, 0, DDS_INFINITY), "wait");
    void* loaned[kDepth] = {NULL};
    dds_sample_info_t infos[kDepth];
    const dds_return_t count = checked(dds_take(reader, loaned, infos, kDepth, kDepth), "take");
    for (dds_return_t i = 0; i < count; ++i) {
      if (!infos[i].valid_data) {
        writer_gone = true;
        continue;
      }
      const perimap_Surface* surface = loaned[i];
      missing += surface->sample_sequence - expected;
      expected = surface->sample_sequence + 1;
    }
    if (count > 0) {
      checked(dds_return_loan(reader, loaned, count), "loan");
    }
  }
  printf("c_subscriber: %" PRIu64 " of %" PRIu64 " surfaces, %" PRIu64 " missing in between\n", expected - missing,
         samples, missing);
  dds_delete(participant);
  return expected == samples && missing == 0 ? 0 : 1;
}
