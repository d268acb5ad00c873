// SPDX-License-Identifier: Apache-2.0
#include <arpa/inet.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>

#include <algorithm>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/log/StdoutErrConsumer.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <set>
#include <sstream>
#include <stdexcept>
#include <typeinfo>

#include "services/dds/host_addresses.h"
#include "services/dds/participant_detail.h"
#include "services/dds/start_transport.h"

namespace tandem::dds::detail {
namespace {

namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastrtps::Duration_t;

constexpr std::uint32_t kMostParticipants = 32;   // per host; with the default of 4, later ones remain unmatched
constexpr std::uint32_t kSocketBuffer = 1 << 20;  // bytes; the kernel may grant less

bool isIpv4(const std::string& text) {
  in_addr address{};
  return inet_pton(AF_INET, text.c_str(), &address) == 1;
}

bool isLoopback(const std::string& text) { return text.rfind("127.", 0) == 0; }

void check(const BusOptions& options) {
  if (options.domain < 0 || options.domain > 232) {
    throw std::invalid_argument("DDS domain " + std::to_string(options.domain) + ": expected 0 to 232");
  }
  ddsTopicName(options.prefix, "check");
  if (!isIpv4(options.interface_address)) {
    throw std::invalid_argument("interface_address '" + options.interface_address +
                                "': expected an IPv4 address, e.g. 127.0.0.1");
  }
  const std::set<std::string> here = hostAddresses();
  if (here.count(options.interface_address) == 0) {
    std::string known;
    for (const std::string& address : here) {
      known += (known.empty() ? "" : ", ") + address;
    }
    throw std::invalid_argument("interface_address " + options.interface_address +
                                ": no interface of this host has this address, expected one of: " + known);
  }
  if (options.discovery && !isIpv4(options.discovery->address)) {
    throw std::invalid_argument("discovery server '" + options.discovery->address + "': expected an IPv4 address");
  }
  for (const std::string& peer : options.peers) {
    if (!isIpv4(peer)) {
      throw std::invalid_argument("peer '" + peer + "': expected an IPv4 address, e.g. 127.0.0.1");
    }
    if (isLoopback(options.interface_address) && !isLoopback(peer)) {
      throw std::invalid_argument("peer " + peer + " cannot be reached from interface_address " +
                                  options.interface_address + ": give the address of an interface on its network");
    }
  }
}

/// @param port  0: the well-known ones of the domain
rtps::Locator_t locator(const std::string& address, int port = 0) {
  rtps::Locator_t result;
  rtps::IPLocator::setIPv4(result, address);
  result.port = static_cast<std::uint32_t>(port);
  return result;
}

/// GUID prefix that identifies a server; this is the usual one.
constexpr const char* kServerPrefix = "44.53.00.5f.45.50.52.4f.53.49.4d.41";

/// Configures discovery through a server, which announces participants to one another.
void discoverThrough(const DiscoveryServer& server, fast::WireProtocolConfigQos& wire) {
  auto& config = wire.builtin.discovery_config;
  const rtps::Locator_t place = locator(server.address, server.port);
  if (server.serve) {
    std::istringstream(kServerPrefix) >> wire.prefix;
    config.discoveryProtocol = rtps::DiscoveryProtocol_t::SERVER;
    wire.builtin.metatrafficUnicastLocatorList.clear();
    wire.builtin.metatrafficUnicastLocatorList.push_back(place);
    return;
  }
  rtps::RemoteServerAttributes remote;
  remote.ReadguidPrefix(kServerPrefix);
  remote.metatrafficUnicastLocatorList.push_back(place);
  config.discoveryProtocol = rtps::DiscoveryProtocol_t::CLIENT;
  config.discoveryServer_client_syncperiod = Duration_t(0, 250'000'000);
  config.m_DiscoveryServers.push_back(remote);
}

void secure(const Credentials& credentials, fast::DomainParticipantQos& qos) {
  const auto set = [&qos](const std::string& name, const std::string& value) {
    qos.properties().properties().emplace_back("dds.sec." + name, value);
  };
  const auto file = [](const std::filesystem::path& path) { return "file://" + path.string(); };
  const std::string auth = "auth.builtin.PKI-DH.", access = "access.builtin.Access-Permissions.";
  set("auth.plugin", "builtin.PKI-DH");
  set(auth + "identity_ca", file(credentials.ca));
  set(auth + "identity_crl", file(credentials.crl));
  set(auth + "identity_certificate", file(credentials.certificate));
  set(auth + "private_key", file(credentials.key));
  set("access.plugin", "builtin.Access-Permissions");
  set(access + "permissions_ca", file(credentials.ca));
  set(access + "governance", file(credentials.governance));
  set(access + "permissions", file(credentials.permissions));
  set("crypto.plugin", "builtin.AES-GCM-GMAC");
}

std::shared_ptr<StartTransportDescriptor> transportOf(const BusOptions& options) {
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList.push_back(options.interface_address);
  udp->maxInitialPeersRange = kMostParticipants;
  udp->receiveBufferSize = kSocketBuffer;
  udp->sendBufferSize = kSocketBuffer;
  return std::make_shared<StartTransportDescriptor>(udp);
}

fast::DomainParticipantQos participantQos(const BusOptions& options,
                                          const std::shared_ptr<StartTransportDescriptor>& transport) {
  fast::DomainParticipantQos qos;
  if (options.credentials)
    secure(*options.credentials, qos);
  qos.name(options.name);
  qos.transport().user_transports.push_back(transport);
  qos.transport().use_builtin_transports = false;

  auto& builtin = qos.wire_protocol().builtin;
  // An explicit unicast metatraffic locator replaces the multicast one.
  builtin.metatrafficUnicastLocatorList.push_back(locator(options.interface_address));
  std::set<std::string> peers;
  if (options.discovery) {
    discoverThrough(*options.discovery, qos.wire_protocol());
  } else {
    peers.insert(options.peers.begin(), options.peers.end());
    peers.insert(options.interface_address);
  }
  for (const std::string& peer : peers) {
    builtin.initialPeersList.push_back(locator(peer));
  }
  // Longer than any freeze that a process is to survive: when a participant resumes after its lease has expired, its
  // peers have removed it but it has not removed them, and 2.9.1 may take a minute to match them again. Tandem's
  // watchdogs detect silence long before.
  builtin.discovery_config.leaseDuration = Duration_t(15, 0);
  // A new participant announces itself five times within its first 0.1 s; each existing one replies to the first one
  // that it receives. Later announcements only repair losses; each is a datagram to 32 ports of each peer.
  builtin.discovery_config.initial_announcements = {5, Duration_t(0, 20'000'000)};
  builtin.discovery_config.leaseDuration_announcementperiod = Duration_t(1, 0);
  return qos;
}

/// Sends the log of Fast DDS, mainly refusals of uncertified participants, to stderr: stdout is for results.
void logToStderr() {
  static std::once_flag once;
  std::call_once(once, [] {
    auto consumer = std::make_unique<fast::StdoutErrConsumer>();
    consumer->stderr_threshold(fast::Log::Kind::Info);
    fast::Log::ClearConsumers();
    fast::Log::RegisterConsumer(std::move(consumer));
  });
}

/// Quality of service common to readers and writers of a topic.
struct Contract {
  bool reliable = true;
  bool latched = false;
  bool exclusive = false;
  double expiry = 0.0;  ///< s, of commands: deadline, liveliness; 0 = none
};

Contract contractOf(Profile profile, const BusOptions& options) {
  Contract contract;
  contract.latched = profile == Profile::kLatched;
  contract.exclusive = profile == Profile::kCommand;
  const bool stream = isStream(profile);
  contract.reliable = !stream || options.deterministic;
  if (profile == Profile::kCommand && !options.deterministic) {
    contract.expiry = options.command_age;
  }
  return contract;
}

template <class Qos>
void applyContract(const Contract& contract, bool limited, Qos& qos) {
  qos.reliability().kind = contract.reliable ? fast::RELIABLE_RELIABILITY_QOS : fast::BEST_EFFORT_RELIABILITY_QOS;
  qos.durability().kind = contract.latched ? fast::TRANSIENT_LOCAL_DURABILITY_QOS : fast::VOLATILE_DURABILITY_QOS;
  qos.ownership().kind = contract.exclusive ? fast::EXCLUSIVE_OWNERSHIP_QOS : fast::SHARED_OWNERSHIP_QOS;
  if (contract.expiry > 0.0 && limited) {
    const auto expiry = Duration_t(static_cast<long double>(contract.expiry));
    // No lifespan: Fast DDS measures it by the sender's wall clock, and clocks may differ. Commands contain the
    // sequence of the state that they answer.
    qos.deadline().period = expiry;
    // AUTOMATIC would report a dead writer as alive while any other participant lives.
    qos.liveliness().kind = fast::MANUAL_BY_TOPIC_LIVELINESS_QOS;
    qos.liveliness().lease_duration = expiry;
  }
}

constexpr int kReserved = 64;  ///< most samples for which a history has memory before the first one

template <class Qos>
void applyHistory(int depth, int reserved, bool plain, Qos& qos) {
  qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = depth;
  auto& limits = qos.resource_limits();
  limits.max_instances = 1;
  limits.max_samples = depth;
  limits.max_samples_per_instance = depth;
  limits.allocated_samples = reserved;
  qos.endpoint().history_memory_policy =
      plain ? rtps::PREALLOCATED_MEMORY_MODE : rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  // Off: a 2.9.1 reader that joins during a write can abort its process (race condition at an assertion in ReaderPool),
  // and killed writers leave their pools in /dev/shm. UDP costs about 20 us more per hop.
  qos.data_sharing().off();
}

}  // namespace

Participant::Participant(const BusOptions& options) : options_(options) {
  check(options);
  logToStderr();
  // Otherwise callbacks within one process would run in the writer's thread.
  eprosima::fastrtps::LibrarySettingsAttributes settings;
  settings.intraprocess_delivery = eprosima::fastrtps::INTRAPROCESS_OFF;
  eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings(settings);

  auto* factory = fast::DomainParticipantFactory::get_instance();
  const std::shared_ptr<StartTransportDescriptor> transport = transportOf(options);
  participant_ = factory->create_participant(static_cast<std::uint32_t>(options.domain),
                                             participantQos(options, transport), this, fast::StatusMask::none());
  transport->open();
  if (participant_ != nullptr) {
    publisher_ = participant_->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
    subscriber_ = participant_->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
  }
  if (publisher_ == nullptr || subscriber_ == nullptr) {
    throw std::runtime_error(
        "DDS did not start in domain " + std::to_string(options.domain) + " on " + options.interface_address +
        (options.credentials ? ": check the credentials in " + options.credentials->certificate.parent_path().string() +
                                   " with `tandem security verify`"
                             : ": check whether all its UDP ports are in use"));
  }
}

Participant::~Participant() {
  std::vector<fast::DataWriter*> writers;
  publisher_->get_datawriters(writers);
  for (fast::DataWriter* writer : writers)
    remove(writer);
  participant_->delete_contained_entities();
  fast::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

void Participant::on_participant_discovery(fast::DomainParticipant*, rtps::ParticipantDiscoveryInfo&& info) {
  const std::lock_guard lock(names_mutex_);
  const bool gone = info.status == rtps::ParticipantDiscoveryInfo::REMOVED_PARTICIPANT ||
                    info.status == rtps::ParticipantDiscoveryInfo::DROPPED_PARTICIPANT;
  if (gone) {
    names_.erase(info.info.m_guid.guidPrefix);
    endpoints_.forget(info.info.m_guid.guidPrefix);
  } else {
    names_[info.info.m_guid.guidPrefix] = info.info.m_participantName.to_string();
  }
}

std::string Participant::senderOf(const rtps::InstanceHandle_t& writer) const {
  const std::lock_guard lock(names_mutex_);
  const auto found = names_.find(rtps::iHandle2GUID(writer).guidPrefix);
  return found == names_.end() ? std::string() : found->second;
}

void Participant::remove(fast::DataWriter* writer) {
  std::size_t removed = 0;
  writer->clear_history(&removed);
  publisher_->delete_datawriter(writer);
}

fast::Topic* Participant::topic(const std::string& dds_name, const fast::TypeSupport& type) {
  std::lock_guard lock(mutex_);
  const fast::TypeSupport registered = participant_->find_type(type.get_type_name());
  const auto differs = [&type](const fast::TopicDataType& known) {
    const fast::TopicDataType& wanted = *type.get();
    return typeid(known) != typeid(wanted);
  };
  if (!registered.empty() && differs(*registered.get())) {
    throw std::runtime_error("topic " + dds_name + ": this bus uses type " + type.get_type_name() +
                             " as messages and as bytes; create a second dds::Bus to read it as bytes");
  }
  if (auto* known = participant_->lookup_topicdescription(dds_name)) {
    if (known->get_type_name() != type.get_type_name()) {
      throw std::runtime_error("topic " + dds_name + ": found type " + type.get_type_name() + ", expected " +
                               known->get_type_name() + ", with which it was created");
    }
    return static_cast<fast::Topic*>(known);
  }
  if (registered.empty()) {
    type.register_type(participant_);
  }
  auto* created = participant_->create_topic(dds_name, type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
  if (created == nullptr) {
    throw std::runtime_error("DDS cannot create topic " + dds_name + "; the lines of Fast DDS above name the cause");
  }
  return created;
}

void Participant::noteDropped(const std::string& topic, const char* why) {
  const std::lock_guard lock(dropped_mutex_);
  auto found = std::find_if(dropped_.begin(), dropped_.end(), [&](const Dropped& d) { return d.topic == topic; });
  if (found == dropped_.end())
    found = dropped_.insert(found, {topic, 0, {}});
  ++found->count;
  found->why = why;
}

std::vector<Dropped> Participant::dropped() const {
  const std::lock_guard lock(dropped_mutex_);
  return dropped_;
}

void Participant::onMismatch(std::function<void(const Mismatch&)> handler) {
  const std::lock_guard lock(mismatch_mutex_);
  mismatch_handler_ = std::move(handler);
}

void Participant::noteMismatch(const Mismatch& mismatch) const {
  const std::lock_guard lock(mismatch_mutex_);
  if (mismatch_handler_)
    mismatch_handler_(mismatch);
}

fast::DataWriterQos writerQos(Profile profile, const BusOptions& options, bool plain) {
  const Contract contract = contractOf(profile, options);
  fast::DataWriterQos qos;
  applyContract(contract, true, qos);
  const bool stream = isStream(profile);
  const int depth = contract.latched ? 1 : stream && options.deterministic ? 4096 : 64;
  applyHistory(depth, std::min(depth, kReserved), plain, qos);
  qos.publish_mode().kind = fast::SYNCHRONOUS_PUBLISH_MODE;
  // A lost sample is requested again within milliseconds, not seconds.
  auto& times = qos.reliable_writer_qos().times;
  times.initialHeartbeatDelay = Duration_t(0, 5'000'000);
  times.heartbeatPeriod = Duration_t(0, 20'000'000);
  times.nackResponseDelay = Duration_t(0, 0);
  times.nackSupressionDuration = Duration_t(0, 0);
  return qos;
}

fast::DataReaderQos readerQos(Profile profile, const BusOptions& options, const ReaderOptions& reader, bool plain) {
  const Contract contract = contractOf(profile, options);
  fast::DataReaderQos qos;
  applyContract(contract, reader.depth == 0, qos);
  const bool stream = isStream(profile);
  int depth = contract.latched ? 1 : !stream ? 10 : options.deterministic ? 4096 : 1;
  int reserved = std::min(depth, kReserved);
  if (reader.depth > 0) {  // a deep history is seldom filled, and nothing periodic depends on it
    depth = reader.depth;
    reserved = 1;
  }
  applyHistory(depth, reserved, plain, qos);
  auto& times = qos.reliable_reader_qos().times;
  times.initialAcknackDelay = Duration_t(0, 5'000'000);
  times.heartbeatResponseDelay = Duration_t(0, 1'000'000);
  return qos;
}

std::string describeIncompatible(const std::string& topic, std::uint32_t policy) {
  const char* what = "quality of service";
  switch (policy) {
    case fast::DURABILITY_QOS_POLICY_ID:
      what = "durability";
      break;
    case fast::DEADLINE_QOS_POLICY_ID:
      what = "deadline";
      break;
    case fast::OWNERSHIP_QOS_POLICY_ID:
      what = "ownership";
      break;
    case fast::LIVELINESS_QOS_POLICY_ID:
      what = "liveliness";
      break;
    case fast::RELIABILITY_QOS_POLICY_ID:
      what = "reliability";
      break;
    default:
      break;
  }
  return "another process on topic " + topic + " was rejected: different " + what +
         " (do both use the same deployment file?)";
}

}  // namespace tandem::dds::detail
