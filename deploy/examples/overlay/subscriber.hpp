// The newest samples of a topic of perimap's, by Cyclone DDS.
#pragma once

#include <dds/dds.h>

#include <array>
#include <stdexcept>
#include <string>

// Ends the program's use of DDS; everything else of DDS goes with the participant.
class Participant {
 public:
  explicit Participant(int domain)
      : entity_(dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr)) {
    if (entity_ < 0) throw std::runtime_error(std::string("cannot join the DDS domain: ") + dds_strretcode(entity_));
  }
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;
  ~Participant() { dds_delete(entity_); }

  [[nodiscard]] dds_entity_t get() const { return entity_; }

 private:
  dds_entity_t entity_;
};

// T: a type of perimap.idl or perimap_mesh.idl.
template <class T>
class Subscriber {
 public:
  // Reliable topics (surface_model, status) are transient local too: who comes late gets the last sample. Their depth
  // may be 1; where every sample counts, 16 is enough for the pauses of a loaded host.
  Subscriber(const Participant& participant, const dds_topic_descriptor_t& type, const char* topic, bool reliable,
             int depth) {
    dds_qos_t* qos = dds_create_qos();
    dds_qset_reliability(qos, reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, DDS_MSECS(10));
    dds_qset_durability(qos, reliable ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, depth);
    const dds_entity_t made = dds_create_topic(participant.get(), &type, topic, qos, nullptr);
    reader_ = made < 0 ? made : dds_create_reader(participant.get(), made, qos, nullptr);
    dds_delete_qos(qos);
    if (reader_ < 0) throw std::runtime_error(std::string(topic) + ": " + dds_strretcode(reader_));
  }
  Subscriber(const Subscriber&) = delete;
  Subscriber& operator=(const Subscriber&) = delete;
  ~Subscriber() { give_back(); }

  // What has come since the last call, in order; `use` gets each sample. The last one stays: newest().
  template <class Use>
  void take(Use use) {
    std::array<void*, kMost> samples{};
    std::array<dds_sample_info_t, kMost> infos{};
    const int taken = dds_take(reader_, samples.data(), infos.data(), kMost, kMost);
    if (taken <= 0) return;
    give_back();
    samples_ = samples;
    taken_ = taken;
    newest_ = nullptr;
    for (int i = 0; i < taken; ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (!infos[k].valid_data) continue;  // tells only that a writer has gone
      newest_ = static_cast<const T*>(samples_[k]);
      use(*newest_);
    }
  }

  // Null before the first, and when the writer has gone.
  [[nodiscard]] const T* newest() const { return newest_; }

 private:
  static constexpr int kMost = 16;

  void give_back() {
    if (taken_ > 0) dds_return_loan(reader_, samples_.data(), taken_);
    taken_ = 0;
  }

  dds_entity_t reader_ = 0;
  std::array<void*, kMost> samples_{};
  int taken_ = 0;
  const T* newest_ = nullptr;
};
