// SPDX-License-Identifier: Apache-2.0
#include <fmt/chrono.h>
#include <fmt/format.h>

#include "services/security/authority.h"

namespace tandem::security {
namespace {

constexpr const char* kHead =
    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
    "<dds xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\"\n"
    "     xsi:noNamespaceSchemaLocation=\"http://www.omg.org/spec/DDS-SECURITY/20170901/{}\">\n";

std::string time(std::chrono::system_clock::time_point at) {
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}", fmt::gmtime(std::chrono::system_clock::to_time_t(at)));
}

std::string rule(const char* kind, const std::vector<std::string>& topics) {
  if (topics.empty())
    return {};
  std::string text = fmt::format("        <{}>\n          <topics>\n", kind);
  for (const std::string& topic : topics)
    text += fmt::format("            <topic>{}</topic>\n", topic);
  return text + fmt::format("          </topics>\n        </{}>\n", kind);
}

}  // namespace

/* Payloads are encrypted separately, which no reader can disable, and submessages in addition, so that sequence
 * numbers, heartbeats and acknowledgements are authentic, too, and no encrypted payload can be replayed under another
 * number. Whole messages are not encrypted (rtps_protection_kind): 2.9.1 aborts if a full one exceeds the size limit
 * after encryption. */
std::string governance() {
  return fmt::format(kHead, "omg_shared_ca_governance.xsd") + R"(  <domain_access_rules>
    <domain_rule>
      <domains>
        <id_range>
          <min>0</min>
          <max>232</max>
        </id_range>
      </domains>
      <allow_unauthenticated_participants>false</allow_unauthenticated_participants>
      <enable_join_access_control>true</enable_join_access_control>
      <discovery_protection_kind>ENCRYPT</discovery_protection_kind>
      <liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
      <rtps_protection_kind>NONE</rtps_protection_kind>
      <topic_access_rules>
        <topic_rule>
          <topic_expression>*</topic_expression>
          <enable_discovery_protection>true</enable_discovery_protection>
          <enable_liveliness_protection>true</enable_liveliness_protection>
          <enable_read_access_control>true</enable_read_access_control>
          <enable_write_access_control>true</enable_write_access_control>
          <metadata_protection_kind>ENCRYPT</metadata_protection_kind>
          <data_protection_kind>ENCRYPT</data_protection_kind>
        </topic_rule>
      </topic_access_rules>
    </domain_rule>
  </domain_access_rules>
</dds>
)";
}

std::string permissions(const Grant& grant, const std::string& subject) {
  std::vector<std::string> publish, subscribe;
  for (const std::string& prefix : grant.prefixes) {
    const dds::Rights rights = dds::rightsOf(grant.role, prefix);
    publish.insert(publish.end(), rights.publish.begin(), rights.publish.end());
    subscribe.insert(subscribe.end(), rights.subscribe.begin(), rights.subscribe.end());
  }
  std::string domains;
  for (int domain : grant.domains)
    domains += fmt::format("          <id>{}</id>\n", domain);
  const auto until = grant.validity.from + std::chrono::hours(24) * grant.validity.days;
  return fmt::format(kHead, "omg_shared_ca_permissions.xsd") +
         fmt::format(R"(  <permissions>
    <grant name="{}">
      <subject_name>{}</subject_name>
      <validity>
        <not_before>{}</not_before>
        <not_after>{}</not_after>
      </validity>
      <allow_rule>
        <domains>
{}        </domains>
{}{}      </allow_rule>
      <default>DENY</default>
    </grant>
  </permissions>
</dds>
)",
                     dds::name(grant.role), subject, time(grant.validity.from), time(until), domains,
                     rule("publish", publish), rule("subscribe", subscribe));
}

}  // namespace tandem::security
