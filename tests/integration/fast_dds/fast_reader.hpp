// Reads topics by eProsima Fast DDS on loopback, and counts.
#pragma once

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <memory>
#include <thread>

namespace perimap::test {

namespace fast = eprosima::fastdds::dds;

inline std::atomic<int> wrong{0};

inline void expect(bool right, const char* what) {
  if (right) return;
  if (++wrong < 10) std::fprintf(stderr, "WRONG: %s\n", what);
}

struct FastDomain {
  explicit FastDomain(int domain) {
    fast::DomainParticipantQos qos;
    // Loopback alone: no test is heard elsewhere.
    const auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList = {"127.0.0.1"};
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports = {udp};
    participant =
        fast::DomainParticipantFactory::get_instance()->create_participant(static_cast<std::uint32_t>(domain), qos);
    subscriber = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
  }
  fast::DomainParticipant* participant;
  fast::Subscriber* subscriber;
};

// Counts the samples that a judge was content with. `Type` is what fastddsgen made for T.
template <class T, class Type>
class FastReader final : public fast::DataReaderListener {
 public:
  using Judge = bool (*)(const T&);
  FastReader(FastDomain& domain, const char* name, Judge judge,
             fast::ReliabilityQosPolicyKind reliability = fast::RELIABLE_RELIABILITY_QOS)
      : judge_(judge) {
    fast::TypeSupport type(new Type());
    type.register_type(domain.participant);
    fast::Topic* topic = domain.participant->create_topic(name, type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
    fast::DataReaderQos qos = fast::DATAREADER_QOS_DEFAULT;
    qos.reliability().kind = reliability;
    expect(topic != nullptr && domain.subscriber->create_datareader(topic, qos, this) != nullptr, name);
  }
  void on_data_available(fast::DataReader* reader) override {
    T sample;
    fast::SampleInfo info;
    while (reader->take_next_sample(&sample, &info) == ReturnCode_t::RETCODE_OK) {
      if (info.valid_data && judge_(sample)) ++content_;
    }
  }
  [[nodiscard]] int content() const { return content_; }

 private:
  const Judge judge_;
  std::atomic<int> content_{0};
};

// Whether it was seen within so many seconds, and nothing was wrong.
template <class Seen>
[[nodiscard]] bool wait_for(int seconds, Seen seen) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(seconds);
  while (!seen() && std::chrono::steady_clock::now() < end) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  return seen() && wrong == 0;
}

}  // namespace perimap::test
