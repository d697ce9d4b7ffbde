#include "apps/console/tell_consent.h"

#include "apps/console/standard_streams.h"
#include "capture/check_consent.h"
#include "core/printable.h"

namespace atelier {

void tell_ended_consent(const Dataset& dataset) {
  for (const Finding& finding : check_ended_consent(dataset)) {
    standard_error() << printable(to_string(finding)) << "\n";
  }
}

}  // namespace atelier
