// SPDX-License-Identifier: Apache-2.0
#include "services/cli/version.h"

#include "config/values.h"
#include "idl/version.h"
#include "services/cli/commit.h"

namespace tandem::cli {

std::string versionText() {
  return "tandem " TANDEM_VERSION ", wire " + config::fingerprintText(idl::kWireVersion) +
         ", commit " TANDEM_COMMIT ", Fast DDS " TANDEM_FAST_DDS ", " TANDEM_BUILD_TYPE " build";
}

}  // namespace tandem::cli
